//! A gyroscope about the vertical (z, upwards), and the turns that it measures, positive to the left.
//!
//! In: an angle to turn by (radians) and a sampling time (seconds). Out: yaw rates (radians per second) along
//! a raised cosine, `rate(t) = (angle / T) (1 - cos(2 pi t / T))`, which starts and ends at rest; the
//! gyroscope adds white noise and a constant bias. Invariant: the rates of a turn times the sampling time add
//! up to the angle.

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;

/// Mean speed of a turn in radians per second; the peak is twice this.
const MEAN_RATE: f64 = 1.0;
/// Shortest turn in seconds.
const SHORTEST_S: f64 = 0.2;
/// Most samples in one turn; a smaller sampling time gives no turn.
const MOST_SAMPLES: f64 = 1e7;

/// The yaw rates in radians per second of a turn by `angle` radians, one for each `dt` seconds (0.01 for 100 Hz), each
/// at the middle of its interval. Empty at rest (an angle of 0), or where either argument is invalid.
pub fn turn_profile(angle: f64, dt: f64) -> Vec<f64> {
    if angle == 0.0 || !angle.is_finite() || !dt.is_finite() || dt <= 0.0 {
        return Vec::new();
    }
    let count = ((angle.abs() / MEAN_RATE).max(SHORTEST_S) / dt).ceil().max(2.0);
    if count > MOST_SAMPLES {
        return Vec::new();
    }
    let mean = angle / (count * dt);
    (0..count as usize).map(|i| mean * (1.0 - (TAU * (i as f64 + 0.5) / count).cos())).collect()
}

/// A yaw rate sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gyroscope {
    /// Standard deviation of each sample in radians per second.
    pub sigma: f64,
    /// Constant error in radians per second.
    pub bias: f64,
}

impl Default for Gyroscope {
    /// 0.01 rad/s of noise per sample and 0.0002 rad/s of bias: after a turn of a second, less than a tenth of a
    /// degree.
    fn default() -> Gyroscope {
        Gyroscope { sigma: 0.01, bias: 0.0002 }
    }
}

impl Gyroscope {
    /// The sample for a true yaw rate, both in radians per second.
    pub fn measure(&self, rate: f64, random: &mut impl Rng) -> f64 {
        let noise: f64 = StandardNormal.sample(random);
        rate + self.bias + self.sigma * noise
    }
}
