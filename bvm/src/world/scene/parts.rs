//! The head of a scene, and what fails.
//!
//! In: nothing. Out: numbers with their defaults. Invariant: defaults describe one robot head: two cameras 12 cm apart, an
//! inertial sensor of a telephone, a neck somewhat faster than a person's.

use serde::Serialize;

/// What the seed changes in a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Jitter {
    /// Of each thing: how far it moves along x and y at most, m.
    pub things: Vec<[f64; 2]>,
    /// Of each body: whether the seed chooses where on its way it starts.
    pub phases: Vec<bool>,
}

/// The pair of cameras.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Cameras {
    /// Width and height of a picture, pixels.
    pub size_px: [usize; 2],
    /// Horizontal field of view, degrees.
    pub field_degrees: f64,
    /// Distance between the cameras, m.
    pub baseline_m: f64,
    /// How far the cameras are ahead of the axis of the neck, m.
    pub ahead_m: f64,
    /// Deviation of a pixel's noise, grey levels of 256.
    pub noise: f64,
    /// The brightness of the right camera relative to the left.
    pub gain: f64,
}

impl Default for Cameras {
    fn default() -> Cameras {
        Cameras {
            size_px: [320, 240],
            field_degrees: 80.0,
            baseline_m: 0.12,
            ahead_m: 0.05,
            noise: 2.0,
            gain: 1.1,
        }
    }
}

impl Cameras {
    /// Focal length, pixels.
    pub fn focal_px(&self) -> f64 {
        0.5 * self.size_px[0] as f64 / (0.5 * self.field_degrees).to_radians().tan()
    }

    /// Horizontal and vertical field of view, degrees.
    pub fn fields_degrees(&self) -> [f64; 2] {
        let upwards = (0.5 * self.size_px[1] as f64 / self.focal_px()).atan();
        [self.field_degrees, 2.0 * upwards.to_degrees()]
    }
}

/// The neck.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Neck {
    /// Least and largest yaw, degrees; a whole turn or more: no limit.
    pub yaw_degrees: [f64; 2],
    /// Least and largest pitch, degrees upwards.
    pub pitch_degrees: [f64; 2],
    /// Largest speed, degrees per second.
    pub speed_degrees_s: f64,
    /// Largest acceleration, degrees per second squared.
    pub acceleration_degrees_s2: f64,
}

impl Default for Neck {
    fn default() -> Neck {
        Neck {
            yaw_degrees: [-150.0, 150.0],
            pitch_degrees: [-60.0, 60.0],
            speed_degrees_s: 200.0,
            acceleration_degrees_s2: 1000.0,
        }
    }
}

/// The inertial sensor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Imu {
    /// Samples per second.
    pub rate_hz: f64,
    /// Constant error of the gyroscope, rad/s.
    pub gyroscope_bias: [f64; 3],
    /// Constant error of the accelerometer, m/s².
    pub accelerometer_bias: [f64; 3],
    /// Deviation of a sample of the gyroscope, rad/s.
    pub gyroscope_sigma: f64,
    /// Deviation of a sample of the accelerometer, m/s².
    pub accelerometer_sigma: f64,
    /// How late a sample is, s.
    pub lag_s: f64,
}

impl Default for Imu {
    fn default() -> Imu {
        Imu {
            rate_hz: 200.0,
            gyroscope_bias: [0.004, -0.006, 0.005],
            accelerometer_bias: [0.02, -0.01, 0.03],
            gyroscope_sigma: 0.003,
            accelerometer_sigma: 0.05,
            lag_s: 0.005,
        }
    }
}

/// A part of the head that can fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Organ {
    /// The left camera.
    LeftCamera,
    /// The right camera.
    RightCamera,
    /// The left ear.
    LeftEar,
    /// The right ear.
    RightEar,
    /// The inertial sensor.
    Imu,
}

/// How it fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// It gives nothing: no picture, silence, no samples.
    Lost,
    /// It repeats what it gave last, as if it were new.
    Frozen,
}

/// A fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Fault {
    /// What fails.
    pub organ: Organ,
    /// How.
    pub kind: FaultKind,
    /// The first and the last look with the fault, counted from 1.
    pub looks: [usize; 2],
}
