//! How a person would feel the motion: canals and otoliths in place of gyroscope and accelerometer.
//!
//! In: the rates and forces that an inertial sensor measured, which stand for the true motion of the head. Out: the estimate of
//! `models/self_motion.bp`. Invariant: this is the program linearised about its own estimate, iterated as the compiler's extended
//! Kalman filter does it, with the program's numbers; a test compares them.
//!
//! The signals of canals and otoliths are those of the model without their noise, as in the published simulations: the estimate is
//! that of the mean person.

use super::inertial::{Estimate, GRAVITY};
use super::rotation::{self, Quaternion, Vector};
use crate::programs::self_motion;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Seconds between two instants of the program.
pub const DT: f64 = self_motion::DEFAULT_DT;

/// Rows before an instant: canals, gravity, turn; then the rate.
const CANAL: usize = 0;
const TILT: usize = 3;
const TURN: usize = 6;
const RATE: usize = 7;
const CARRIED: usize = 7;
const ALL: usize = 10;

/// How often the tangent is taken, and the change at which it stays.
const PASSES: (usize, f64) = (8, 1e-10);

/// The observer.
#[derive(Clone, Debug)]
pub struct Human {
    /// The true state of the fluid, which makes the signal of the canals.
    fluid: Vector,
    mean: SVector<f64, CARRIED>,
    covariance: SMatrix<f64, CARRIED, CARRIED>,
    rate: Vector,
    rate_deviation: Vector,
    force: Vector,
    orientation: Quaternion,
}

impl Human {
    /// A head at rest, with gravity in its axes, and a heading.
    pub fn at_rest(gravity: Vector, heading: f64) -> Self {
        let length = rotation::dot(gravity, gravity).sqrt();
        let up = gravity.map(|cell| cell * GRAVITY / length.max(1e-9));
        let mut mean = SVector::<f64, CARRIED>::zeros();
        mean.fixed_rows_mut::<3>(TILT).copy_from_slice(&up);
        let deviations =
            [1e-4, 1e-4, 1e-4].into_iter().chain([self_motion::DEFAULT_SIGMA_UP; 3]).chain([1e-6]);
        let diagonal = SVector::from_iterator(deviations.map(|deviation| deviation * deviation));
        let upright = rotation::between(up, [0.0, 0.0, 1.0]);
        let found = rotation::heading(upright).unwrap_or(0.0);
        let turn = rotation::from_vector([0.0, 0.0, heading - found]);
        Self {
            fluid: [0.0; 3],
            mean,
            covariance: SMatrix::from_diagonal(&diagonal),
            rate: [0.0; 3],
            rate_deviation: [self_motion::DEFAULT_SIGMA_OMEGA; 3],
            force: up,
            orientation: rotation::product(turn, upright),
        }
    }

    /// One instant of true motion.
    pub fn move_on(&mut self, rate: Vector, force: Vector) {
        let tau = self_motion::DEFAULT_TAU_C;
        for axis in 0..3 {
            self.fluid[axis] = (tau * self.fluid[axis] + DT * rate[axis]) / (tau + DT);
        }
        self.feel(std::array::from_fn(|axis| rate[axis] - self.fluid[axis]), force);
    }

    /// One instant: the signals of canals (rad/s) and otoliths (m/s²).
    pub fn feel(&mut self, canals: Vector, otoliths: Vector) {
        let (tau, dt) = (self_motion::DEFAULT_TAU_C, DT);
        let (keep, take) = (tau / (tau + dt), dt / (tau + dt));
        let mut prior = SVector::<f64, ALL>::zeros();
        prior.fixed_rows_mut::<CARRIED>(0).copy_from(&self.mean);
        let mut spread = SMatrix::<f64, ALL, ALL>::zeros();
        spread.fixed_view_mut::<CARRIED, CARRIED>(0, 0).copy_from(&self.covariance);
        for axis in RATE..ALL {
            spread[(axis, axis)] = self_motion::DEFAULT_SIGMA_OMEGA.powi(2);
        }
        // The canals are linear.
        for axis in 0..3 {
            let mut row = SVector::<f64, ALL>::zeros();
            row[RATE + axis] = 1.0 - take;
            row[CANAL + axis] = -keep;
            observe(&mut prior, &mut spread, &row, canals[axis], self_motion::DEFAULT_SIGMA_V.powi(2));
        }
        // The otoliths feel gravity turned by the rate, and an acceleration.
        let noise = self_motion::DEFAULT_SIGMA_A.powi(2) + self_motion::DEFAULT_SIGMA_F.powi(2);
        let (mut mean, mut covariance) = (prior, spread);
        for _ in 0..PASSES.0 {
            let (turned, by_gravity, by_rate) = turned(&mean, dt);
            let at = mean;
            (mean, covariance) = (prior, spread);
            for axis in 0..3 {
                let mut row = SVector::<f64, ALL>::zeros();
                row.fixed_rows_mut::<3>(TILT).copy_from(&by_gravity.row(axis).transpose());
                row.fixed_rows_mut::<3>(RATE).copy_from(&by_rate.row(axis).transpose());
                let value = otoliths[axis] - turned[axis] + row.dot(&at);
                observe(&mut mean, &mut covariance, &row, value, noise);
            }
            if (mean - at).amax() <= PASSES.1 * (1.0 + mean.amax()) {
                break;
            }
        }
        let (turned, by_gravity, by_rate) = turned(&mean, dt);
        let mut onwards = SMatrix::<f64, CARRIED, ALL>::zeros();
        let mut next = SVector::<f64, CARRIED>::zeros();
        for axis in 0..3 {
            onwards[(CANAL + axis, CANAL + axis)] = keep;
            onwards[(CANAL + axis, RATE + axis)] = take;
            next[CANAL + axis] = keep * mean[CANAL + axis] + take * mean[RATE + axis];
            next[TILT + axis] = turned[axis];
        }
        onwards.fixed_view_mut::<3, 3>(TILT, TILT).copy_from(&by_gravity);
        onwards.fixed_view_mut::<3, 3>(TILT, RATE).copy_from(&by_rate);
        let rate = Vector3::new(mean[RATE], mean[RATE + 1], mean[RATE + 2]);
        let length = turned.norm();
        let up = turned / length;
        next[TURN] = mean[TURN] + dt * rate.dot(&up);
        // Along `up` the length of gravity does not matter.
        let by_tilt = (rate - up * rate.dot(&up)).transpose() * (dt / length);
        onwards[(TURN, TURN)] = 1.0;
        onwards.fixed_view_mut::<1, 3>(TURN, TILT).copy_from(&(by_tilt * by_gravity));
        onwards.fixed_view_mut::<1, 3>(TURN, RATE).copy_from(&(by_tilt * by_rate + up.transpose() * dt));
        self.mean = next;
        self.covariance = onwards * covariance * onwards.transpose();
        self.rate = rate.into();
        self.rate_deviation =
            std::array::from_fn(|axis| covariance[(RATE + axis, RATE + axis)].max(0.0).sqrt());
        self.force = otoliths;
        let turn = rotation::from_vector(self.rate.map(|rate| dt * rate));
        let integrated = rotation::normalised(rotation::product(self.orientation, turn));
        let seen = rotation::apply(&rotation::matrix(integrated), turned.into());
        self.orientation = rotation::product(rotation::between(seen, [0.0, 0.0, 1.0]), integrated);
    }

    /// The estimated rate, rad/s.
    pub fn rate(&self) -> Vector {
        self.rate
    }

    /// The estimated gravity, upwards, m/s².
    pub fn gravity(&self) -> Vector {
        std::array::from_fn(|axis| self.mean[TILT + axis])
    }

    /// The state of the canals' fluid, as it is estimated, rad/s.
    pub fn canals(&self) -> Vector {
        std::array::from_fn(|axis| self.mean[CANAL + axis])
    }

    /// The estimated acceleration, m/s².
    pub fn acceleration(&self) -> Vector {
        let [a, f] = [self_motion::DEFAULT_SIGMA_A, self_motion::DEFAULT_SIGMA_F].map(|sigma| sigma * sigma);
        std::array::from_fn(|axis| a / (a + f) * (self.force[axis] - self.mean[TILT + axis]))
    }

    /// Angle turned about the vertical, rad, and its deviation.
    pub fn turned(&self) -> [f64; 2] {
        [self.mean[TURN], self.covariance[(TURN, TURN)].max(0.0).sqrt()]
    }

    /// Deviations of the components of gravity, m/s².
    pub fn gravity_deviations(&self) -> Vector {
        std::array::from_fn(|axis| self.covariance[(TILT + axis, TILT + axis)].max(0.0).sqrt())
    }

    /// The estimate, with deviations.
    pub fn estimate(&self) -> Estimate {
        let q @ [w, x, y, z] = self.orientation;
        // Gravity in the head's axes changes by −turn × gravity: the part of the covariance across it is that of the tilt.
        let matrix = rotation::matrix(q);
        let to_world = Matrix3::from_fn(|row, column| matrix[row][column]);
        let covariance = self.covariance.fixed_view::<3, 3>(TILT, TILT);
        let spread = to_world * covariance * to_world.transpose() / (GRAVITY * GRAVITY);
        let [_, heading] = self.turned();
        let (about_x, about_y) = (spread[(1, 1)].max(0.0), spread[(0, 0)].max(0.0));
        let turn = [about_x, about_y, heading * heading];
        let by_turn = [[-x, -y, -z], [w, z, -y], [-z, w, x], [y, -x, w]];
        let deviation =
            |row: [f64; 3]| row.iter().zip(turn).map(|(cell, turn)| 0.25 * cell * cell * turn).sum::<f64>();
        let sd_gravity = self.gravity_deviations();
        Estimate {
            orientation: q,
            sd_orientation: by_turn.map(|row| deviation(row).sqrt().min(1.0)),
            rate: self.rate,
            sd_rate: self.rate_deviation,
            gravity: self.gravity(),
            sd_gravity,
            acceleration: self.acceleration(),
            sd_acceleration: sd_gravity.map(|gravity| gravity.hypot(self_motion::DEFAULT_SIGMA_F)),
            sd_heading: heading,
        }
    }
}

/// Gravity turned by a rate, and its derivatives by gravity and by the rate.
fn turned(at: &SVector<f64, ALL>, dt: f64) -> (Vector3<f64>, Matrix3<f64>, Matrix3<f64>) {
    let rate = Vector3::new(at[RATE], at[RATE + 1], at[RATE + 2]);
    let angle = -dt * rate;
    let matrix = rotation::matrix(rotation::from_vector(angle.into()));
    let by_gravity = Matrix3::from_fn(|row, column| matrix[row][column]);
    let turned = by_gravity * Vector3::new(at[TILT], at[TILT + 1], at[TILT + 2]);
    // The left Jacobian of a rotation, by its series: an instant turns by little.
    let cross = angle.cross_matrix();
    let jacobian = Matrix3::identity() + 0.5 * cross + cross * cross / 6.0 + cross * cross * cross / 24.0;
    (turned, by_gravity, turned.cross_matrix() * jacobian * dt)
}

/// A scalar observation: row · x = value, with noise.
fn observe(
    mean: &mut SVector<f64, ALL>,
    covariance: &mut SMatrix<f64, ALL, ALL>,
    row: &SVector<f64, ALL>,
    value: f64,
    variance: f64,
) {
    let gain = *covariance * row;
    let total = row.dot(&gain) + variance;
    *mean += gain * ((value - row.dot(mean)) / total);
    *covariance -= gain * gain.transpose() / total;
}
