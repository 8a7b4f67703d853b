//! The numbers of `models/inertial.bp` that a user may know better.
//!
//! In: the program's defaults. Out: [`Noise`]. Invariant: densities are per √Hz; the deviation of a reading is its density over √dt.

use crate::programs::{inertial, self_motion};

/// The numbers of the program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Density of the gyroscope's noise, rad/s/√Hz.
    pub gyroscope: f64,
    /// Density of the accelerometer's noise, m/s²/√Hz.
    pub accelerometer: f64,
    /// The part of the noise that grows with the rate, and with the acceleration.
    pub stray: [f64; 2],
    /// Random walk of the bias, rad/s/√s.
    pub drift: f64,
    /// Deviation of the velocity times √s: velocities are small, and come to nothing over time.
    pub speed: f64,
    /// Deviation of the bias at first, rad/s.
    pub bias: f64,
    /// Deviation of the mean rate over a time when it was not measured, rad/s: the prior of `models/self_motion.bp`.
    pub omega: f64,
    /// Deviation between the axes of the sensor and those of its case, m/s² of gravity.
    pub level: f64,
}

impl Default for Noise {
    fn default() -> Self {
        Self {
            gyroscope: inertial::DEFAULT_GYROSCOPE,
            accelerometer: inertial::DEFAULT_ACCELEROMETER,
            stray: [inertial::DEFAULT_STRAY_OMEGA, inertial::DEFAULT_STRAY_A],
            drift: inertial::DEFAULT_DRIFT,
            speed: inertial::DEFAULT_SPEED,
            bias: inertial::DEFAULT_SIGMA_B,
            omega: self_motion::DEFAULT_SIGMA_OMEGA,
            level: inertial::DEFAULT_LEVEL,
        }
    }
}
