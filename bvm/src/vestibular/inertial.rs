//! The filter of an inertial sensor: its orientation, and what is uncertain about it.
//!
//! In: angular rates and specific forces, each with the time that it stands for. Out: orientation, gravity, bias of the
//! gyroscope, with their covariance. Invariant: this is `models/inertial.bp` linearised about its own estimate (an extended
//! Kalman filter), with the program's numbers; a test compares it with the filter that the compiler makes of the program. It is
//! written by hand because it runs once a sample, at up to 10 kHz.
//!
//! A reading of the gyroscope is taken as the mean rate since the one before.
//!
//! State: the small rotation, in the world, between the estimate and the truth; velocity in the world; bias; the length of
//! gravity. In these coordinates the transition is the identity but for three blocks.

use super::noise::Noise;
use super::rotation::{self, Matrix, Quaternion, Vector};
use crate::programs::inertial;

/// Rows of the state.
const SIZE: usize = 10;
const TURN: usize = 0;
const VELOCITY: usize = 3;
const BIAS: usize = 6;
const WEIGHT: usize = 9;

/// Standard gravity, m/s².
pub const GRAVITY: f64 = 9.80665;

/// Deviation of the first tilt, and of one that is taken anew from a reading of the accelerometer, rad.
const FIRST_TILT: f64 = inertial::DEFAULT_SIGMA_UP / GRAVITY;

/// A tilt less certain than this, rad, is taken anew from the accelerometer: tangents do not reach so far.
const LOST: f64 = 0.5;

/// Deviation of an angle that is uniform on the circle: a heading that is not known at all.
const UNKNOWN_ANGLE: f64 = 1.813_799_364_234_218;

/// The filter.
#[derive(Clone, Debug)]
pub struct Inertial {
    noise: Noise,
    /// From the sensor to the world: z up.
    orientation: Quaternion,
    velocity: Vector,
    bias: Vector,
    weight: f64,
    covariance: [[f64; SIZE]; SIZE],
    /// Rate without its bias, and linear acceleration, in the axes of the sensor.
    rate: Vector,
    acceleration: Vector,
    deviations: [f64; 2],
    /// Whether a reading of the accelerometer has put the sensor upright.
    upright: bool,
}

impl Inertial {
    /// A sensor at rest whose orientation is not known; its heading is `heading`, by definition.
    pub fn new(noise: Noise, heading: f64) -> Self {
        let mut covariance = [[0.0; SIZE]; SIZE];
        let first = [1.0, 1.0, 0.0, 0.1, 0.1, 0.1, noise.bias, noise.bias, noise.bias];
        first.iter().enumerate().for_each(|(row, deviation)| covariance[row][row] = deviation * deviation);
        covariance[WEIGHT][WEIGHT] = inertial::DEFAULT_SIGMA_WEIGHT.powi(2);
        let orientation = rotation::from_vector([0.0, 0.0, heading]);
        let none = [0.0; 3];
        Self {
            noise,
            orientation,
            velocity: none,
            bias: none,
            weight: GRAVITY,
            covariance,
            rate: none,
            acceleration: none,
            deviations: [noise.omega, inertial::DEFAULT_SIGMA_UP],
            upright: false,
        }
    }

    /// The sensor turned with a mean rate (rad/s, as measured) for `dt` seconds; `spread` is the deviation of that mean
    /// beyond the sensor's noise.
    pub fn turn(&mut self, measured: Vector, spread: f64, dt: f64) {
        let noise = self.noise;
        self.rate = std::array::from_fn(|axis| measured[axis] - self.bias[axis]);
        let half = rotation::from_vector(self.rate.map(|rate| 0.5 * dt * rate));
        let middle = rotation::product(self.orientation, half);
        self.orientation = rotation::normalised(rotation::product(middle, half));
        let turning = rotation::matrix(middle);
        let own = (noise.gyroscope.powi(2) + noise.stray[0].powi(2) * square(self.rate)) / dt.max(1e-6)
            + spread * spread;
        let drift = noise.drift.powi(2) * dt;
        self.deviations[0] = own.sqrt();
        let p = &mut self.covariance;
        for axis in 0..3 {
            p[BIAS + axis][BIAS + axis] += drift;
        }
        // Turn ← Turn − dt · R · bias, in rows and in columns.
        for row in 0..3 {
            let [x, y, z] = turning[row].map(|cell| dt * cell);
            for column in 0..SIZE {
                p[TURN + row][column] -=
                    x * p[BIAS][column] + y * p[BIAS + 1][column] + z * p[BIAS + 2][column];
            }
        }
        for cells in p.iter_mut() {
            let [x, y, z] = [cells[BIAS], cells[BIAS + 1], cells[BIAS + 2]];
            for (row, turning) in turning.iter().enumerate() {
                cells[TURN + row] -= dt * (turning[0] * x + turning[1] * y + turning[2] * z);
            }
        }
        for axis in 0..3 {
            p[TURN + axis][TURN + axis] += own * dt * dt;
        }
    }

    /// A first reading of the gyroscope, which stands for no time.
    pub fn look(&mut self, measured: Vector) {
        self.rate = std::array::from_fn(|axis| measured[axis] - self.bias[axis]);
    }

    /// The accelerometer measured a specific force (m/s², upwards at rest) over `dt` seconds.
    pub fn push(&mut self, force: Vector, dt: f64) {
        let tilt = self.covariance[TURN][TURN].max(self.covariance[TURN + 1][TURN + 1]).sqrt();
        if !self.upright || tilt > LOST {
            self.raise(force);
        }
        let noise = self.noise;
        let world = rotation::apply(&rotation::matrix(self.orientation), force);
        let acceleration = [world[0], world[1], world[2] - self.weight];
        let own = (noise.accelerometer.powi(2) + noise.stray[1].powi(2) * square(acceleration)) / dt;
        self.deviations[1] = own.sqrt();
        for axis in 0..3 {
            self.velocity[axis] += dt * acceleration[axis];
        }
        // Velocity ← Velocity + dt · (Turn × force − weight · up), in rows and in columns.
        let [x, y, z] = world.map(|cell| dt * cell);
        let p = &mut self.covariance;
        for column in 0..SIZE {
            let [a, b, c] = [p[TURN][column], p[TURN + 1][column], p[TURN + 2][column]];
            p[VELOCITY][column] += b * z - c * y;
            p[VELOCITY + 1][column] += c * x - a * z;
            p[VELOCITY + 2][column] += a * y - b * x - dt * p[WEIGHT][column];
        }
        for cells in p.iter_mut() {
            let [a, b, c] = [cells[TURN], cells[TURN + 1], cells[TURN + 2]];
            cells[VELOCITY] += b * z - c * y;
            cells[VELOCITY + 1] += c * x - a * z;
            cells[VELOCITY + 2] += a * y - b * x - dt * cells[WEIGHT];
        }
        let mut change = [0.0; SIZE];
        for axis in 0..3 {
            p[VELOCITY + axis][VELOCITY + axis] += own * dt * dt;
            let residual = -self.velocity[axis] - change[VELOCITY + axis];
            observe(p, VELOCITY + axis, residual, noise.speed.powi(2) / dt, &mut change);
        }
        self.correct(&change);
        let seen = rotation::apply(
            &rotation::transposed(&rotation::matrix(self.orientation)),
            [0.0, 0.0, self.weight],
        );
        self.acceleration = std::array::from_fn(|axis| force[axis] - seen[axis]);
    }

    /// A first reading of the accelerometer, which stands for no time: it puts the estimate upright.
    pub fn start(&mut self, force: Vector) {
        if !self.upright {
            self.raise(force);
        }
    }

    /// The sensor is at rest: what the gyroscope measured over `dt` seconds is its bias.
    pub fn still(&mut self, measured: Vector, dt: f64) {
        let mut change = [0.0; SIZE];
        for axis in 0..3 {
            let residual = measured[axis] - self.bias[axis] - change[BIAS + axis];
            observe(
                &mut self.covariance,
                BIAS + axis,
                residual,
                self.noise.gyroscope.powi(2) / dt,
                &mut change,
            );
        }
        self.correct(&change);
    }

    /// Nothing was measured for `dt` seconds: the estimate stays, its deviation grows by the prior of rates. `rotates`, rad, is
    /// the deviation of the rotation; `None`: that of the prior.
    pub fn blind(&mut self, dt: f64, rotates: Option<f64>) {
        let spread = rotates.unwrap_or(self.noise.omega * dt).min(UNKNOWN_ANGLE).powi(2);
        let p = &mut self.covariance;
        for axis in 0..3 {
            p[TURN + axis][TURN + axis] = (p[TURN + axis][TURN + axis] + spread).min(UNKNOWN_ANGLE.powi(2));
            p[BIAS + axis][BIAS + axis] += self.noise.drift.powi(2) * dt;
        }
    }

    /// The velocity is not known: accelerations were not measured for a while.
    pub fn forget_velocity(&mut self) {
        for axis in VELOCITY..VELOCITY + 3 {
            self.velocity[axis - VELOCITY] = 0.0;
            for other in 0..SIZE {
                self.covariance[axis][other] = 0.0;
                self.covariance[other][axis] = 0.0;
            }
            self.covariance[axis][axis] = 1.0;
        }
    }

    /// Turns the estimate upright by a force, about a horizontal axis.
    fn raise(&mut self, force: Vector) {
        let world = rotation::apply(&rotation::matrix(self.orientation), force);
        if square(world) == 0.0 {
            return;
        }
        let about = rotation::between(world, [0.0, 0.0, 1.0]);
        let heading = rotation::heading(self.orientation);
        self.orientation = rotation::product(about, self.orientation);
        if !self.upright {
            // The heading is a definition: the x axis keeps it, unless it is nearly vertical.
            if let Some((wanted, found)) = heading.zip(rotation::heading(self.orientation)) {
                let turn = rotation::from_vector([0.0, 0.0, wanted - found]);
                self.orientation = rotation::product(turn, self.orientation);
            }
        }
        self.upright = true;
        let p = &mut self.covariance;
        for axis in TURN..TURN + 2 {
            for other in 0..SIZE {
                p[axis][other] = 0.0;
                p[other][axis] = 0.0;
            }
            p[axis][axis] = FIRST_TILT * FIRST_TILT;
        }
        self.forget_velocity();
        for axis in VELOCITY..VELOCITY + 3 {
            self.covariance[axis][axis] = 0.01;
        }
    }

    fn correct(&mut self, change: &[f64; SIZE]) {
        let turn = rotation::from_vector([change[TURN], change[TURN + 1], change[TURN + 2]]);
        self.orientation = rotation::normalised(rotation::product(turn, self.orientation));
        for axis in 0..3 {
            self.velocity[axis] += change[VELOCITY + axis];
            self.bias[axis] += change[BIAS + axis];
        }
        self.weight += change[WEIGHT];
    }

    /// From the sensor to the world.
    pub fn orientation(&self) -> Quaternion {
        self.orientation
    }

    /// The bias of the gyroscope, rad/s.
    pub fn bias(&self) -> Vector {
        self.bias
    }

    /// Deviations of the bias, rad/s.
    pub fn bias_deviations(&self) -> Vector {
        std::array::from_fn(|axis| self.covariance[BIAS + axis][BIAS + axis].max(0.0).sqrt())
    }

    /// The velocity, in the world; m/s.
    pub fn velocity(&self) -> Vector {
        self.velocity
    }

    /// The covariance of the small rotation in the world, without the misalignment of the case; rad².
    pub fn rotation_covariance(&self) -> Matrix {
        std::array::from_fn(|row| std::array::from_fn(|column| self.covariance[TURN + row][TURN + column]))
    }

    /// Deviations of gravity in the axes of the sensor, without the misalignment of the case; m/s².
    pub fn gravity_deviations(&self) -> Vector {
        self.deviations_of_gravity(&self.rotation_covariance(), &rotation::matrix(self.orientation))
    }

    /// Gravity in the sensor changes by −Rᵀ (turn × up) weight.
    fn deviations_of_gravity(&self, turn: &Matrix, matrix: &Matrix) -> Vector {
        let weight = self.covariance[WEIGHT];
        std::array::from_fn(|axis| {
            let column = [matrix[1][axis], -matrix[0][axis], 0.0].map(|cell| self.weight * cell);
            let up = matrix[2][axis];
            // The length of gravity, and what it has in common with the turn.
            let both = 2.0 * up * (column[0] * weight[TURN] + column[1] * weight[TURN + 1]);
            (quadratic(turn, column) + up * up * weight[WEIGHT] + both).max(0.0).sqrt()
        })
    }

    /// Deviation between the axes of the sensor and those of its case, rad.
    pub fn level(&self) -> f64 {
        self.noise.level / GRAVITY
    }

    /// The estimate, with deviations.
    pub fn estimate(&self) -> Estimate {
        let level = self.level().powi(2);
        let mut turn = self.rotation_covariance();
        for (axis, row) in turn.iter_mut().enumerate() {
            row[axis] = (row[axis].max(0.0) + if axis < 2 { level } else { 0.0 }).min(UNKNOWN_ANGLE.powi(2));
        }
        let q @ [w, x, y, z] = self.orientation;
        // q changes by ½ (0, turn) q.
        let by_turn = [[-x, -y, -z], [w, z, -y], [-z, w, x], [y, -x, w]];
        let sd_orientation = by_turn.map(|row| (0.25 * quadratic(&turn, row)).sqrt().min(1.0));
        let matrix = rotation::matrix(q);
        let gravity = matrix[2].map(|cell| self.weight * cell);
        let sd_gravity = self.deviations_of_gravity(&turn, &matrix);
        let bias = self.bias_deviations();
        let [rate, force] = self.deviations;
        Estimate {
            orientation: q,
            sd_orientation,
            rate: self.rate,
            sd_rate: bias.map(|bias| bias.hypot(rate)),
            gravity,
            sd_gravity,
            acceleration: self.acceleration,
            sd_acceleration: sd_gravity.map(|gravity: f64| gravity.hypot(force)),
            sd_heading: turn[2][2].sqrt(),
        }
    }
}

/// What the filter knows at an instant, in SI units and the axes of the sensor; each with its deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// From the sensor to the world, w first; z of the world is up.
    pub orientation: Quaternion,
    /// Deviations of its components.
    pub sd_orientation: Quaternion,
    /// Angular rate, rad/s.
    pub rate: Vector,
    /// rad/s.
    pub sd_rate: Vector,
    /// The specific force of rest: upwards, m/s².
    pub gravity: Vector,
    /// m/s².
    pub sd_gravity: Vector,
    /// Specific force without gravity, m/s².
    pub acceleration: Vector,
    /// m/s².
    pub sd_acceleration: Vector,
    /// Deviation of the heading since the start, rad.
    pub sd_heading: f64,
}

/// One scalar observation of a row of the state; `change` is the correction of the state so far.
fn observe(p: &mut [[f64; SIZE]; SIZE], row: usize, residual: f64, variance: f64, change: &mut [f64; SIZE]) {
    let own = p[row];
    let scale = 1.0 / (own[row] + variance);
    for (cells, gain) in p.iter_mut().zip(own.map(|cell| cell * scale)) {
        cells.iter_mut().zip(&own).for_each(|(cell, other)| *cell -= gain * other);
    }
    change.iter_mut().zip(&own).for_each(|(change, cell)| *change += cell * scale * residual);
}

fn square(v: Vector) -> f64 {
    v.iter().map(|cell| cell * cell).sum()
}

fn quadratic(matrix: &Matrix, v: Vector) -> f64 {
    (0..3)
        .map(|row| (0..3).map(|column| v[row] * matrix[row][column] * v[column]).sum::<f64>())
        .sum::<f64>()
        .max(0.0)
}
