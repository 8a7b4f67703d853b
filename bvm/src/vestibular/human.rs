//! How a person would feel the motion: canals and otoliths in place of gyroscope and accelerometer.
//!
//! In: the rates and forces that an inertial sensor measured, which stand for the true motion of the head. Out: the estimate of
//! `models/self_motion.bp`. Invariant: the filter is the code that the compiler emits for the program's question `felt`.
//!
//! The signals of canals and otoliths are those of the model without their noise, as in the published simulations: the estimate is
//! that of the mean person.

use super::inertial::{Estimate, GRAVITY};
use super::rotation::{self, Quaternion, Vector};
use crate::error::Error;
use crate::programs::self_motion::{self, felt};
use nalgebra::Matrix3;

/// Seconds between two instants of the program.
pub const DT: f64 = self_motion::DEFAULT_DT;

/// The observer.
#[derive(Clone, Debug)]
pub struct Human {
    /// The true state of the fluid, which makes the signal of the canals.
    fluid: Vector,
    /// Gravity at the start, in the axes of the head.
    up: Vector,
    felt: felt::State<f64>,
    orientation: Quaternion,
}

impl Human {
    /// A head at rest, with gravity in its axes, and a heading.
    pub fn at_rest(gravity: Vector, heading: f64) -> Self {
        let length = rotation::dot(gravity, gravity).sqrt();
        let up = gravity.map(|cell| cell * GRAVITY / length.max(1e-9));
        let upright = rotation::between(up, [0.0, 0.0, 1.0]);
        let found = rotation::heading(upright).unwrap_or(0.0);
        let turn = rotation::from_vector([0.0, 0.0, heading - found]);
        let orientation = rotation::product(turn, upright);
        Self { fluid: [0.0; 3], up, felt: felt::State::new(), orientation }
    }

    /// One instant of true motion: rate (rad/s) and force (m/s²).
    ///
    /// # Errors
    /// Numbers with which the filter has no answer; the estimate is then as it was.
    pub fn move_on(&mut self, rate: Vector, force: Vector) -> Result<(), Error> {
        let tau = self_motion::DEFAULT_TAU_C;
        for axis in 0..3 {
            self.fluid[axis] = (tau * self.fluid[axis] + DT * rate[axis]) / (tau + DT);
        }
        self.feel(std::array::from_fn(|axis| rate[axis] - self.fluid[axis]), force)
    }

    /// One instant: the signals of canals (rad/s) and otoliths (m/s²).
    ///
    /// # Errors
    /// Those of [`Human::move_on`].
    pub fn feel(&mut self, canals: Vector, otoliths: Vector) -> Result<(), Error> {
        self_motion::felt().time(1).up(&self.up).v(&canals).f(&otoliths).step(&mut self.felt)?;
        let turn = rotation::from_vector(self.rate().map(|rate| DT * rate));
        let integrated = rotation::normalised(rotation::product(self.orientation, turn));
        let seen = rotation::apply(&rotation::matrix(integrated), self.gravity());
        self.orientation = rotation::product(rotation::between(seen, [0.0, 0.0, 1.0]), integrated);
        Ok(())
    }

    /// Whether there was no instant yet.
    fn is_new(&self) -> bool {
        self.felt.instants() == 0
    }

    /// The estimated rate, rad/s.
    pub fn rate(&self) -> Vector {
        self.felt.mean_omega().map(number)
    }

    /// The estimated gravity, upwards, m/s².
    pub fn gravity(&self) -> Vector {
        if self.is_new() { self.up } else { self.felt.mean_g().map(number) }
    }

    /// The estimate, with deviations; before the first instant they are those of the program's priors.
    pub fn estimate(&self) -> Estimate {
        let q @ [w, x, y, z] = self.orientation;
        // Gravity in the head's axes changes by −turn × gravity: the part of the covariance across it is that of the tilt.
        let matrix = rotation::matrix(q);
        let to_world = Matrix3::from_fn(|row, column| matrix[row][column]);
        let covariance = match self.is_new() {
            true => Matrix3::identity() * self_motion::DEFAULT_SIGMA_UP.powi(2),
            false => {
                let of_gravity = self.felt.covariance_g();
                Matrix3::from_fn(|row, column| number(of_gravity[row][column]))
            }
        };
        let spread = to_world * covariance * to_world.transpose() / (GRAVITY * GRAVITY);
        let heading = deviation(self.felt.variance_turn());
        let (about_x, about_y) = (spread[(1, 1)].max(0.0), spread[(0, 0)].max(0.0));
        let turn = [about_x, about_y, heading * heading];
        let by_turn = [[-x, -y, -z], [w, z, -y], [-z, w, x], [y, -x, w]];
        let of_part =
            |row: [f64; 3]| row.iter().zip(turn).map(|(cell, turn)| 0.25 * cell * cell * turn).sum::<f64>();
        let or_prior = |found: Vector, prior: f64| if self.is_new() { [prior; 3] } else { found };
        Estimate {
            orientation: q,
            sd_orientation: by_turn.map(|row| of_part(row).sqrt().min(1.0)),
            rate: self.rate(),
            sd_rate: or_prior(self.felt.variance_omega().map(deviation), self_motion::DEFAULT_SIGMA_OMEGA),
            gravity: self.gravity(),
            sd_gravity: or_prior(self.felt.variance_g().map(deviation), self_motion::DEFAULT_SIGMA_UP),
            acceleration: self.felt.mean_a().map(number),
            sd_acceleration: or_prior(self.felt.variance_a().map(deviation), self_motion::DEFAULT_SIGMA_A),
            sd_heading: heading,
        }
    }
}

/// The number of the only filter; 0 before the first instant.
fn number(numbers: &[f64]) -> f64 {
    numbers.first().copied().unwrap_or(0.0)
}

fn deviation(variances: &[f64]) -> f64 {
    number(variances).max(0.0).sqrt()
}
