//! Whether the sensor is at rest: `models/rest.bp`, by the kernel that the compiler emits for its question.
//!
//! In: readings. Out: the probability of rest, and the decision to take the gyroscope's reading for its bias. Invariant: the
//! probability is the program's; what is measured here are its inputs.

use super::rotation::Vector;
use crate::error::Error;
use crate::programs::rest;

/// Seconds of the mean that is taken off the accelerometer.
const MEAN_S: f64 = 0.3;

/// Rest is used once it was this probable for this many seconds: the noises of neighbouring readings are not independent, as the
/// program takes them to be.
const SURE: (f64, f64) = (0.99, 0.2);

/// The detector of rest.
#[derive(Clone, Debug)]
pub(super) struct Rest {
    /// P(not at rest), P(at rest).
    probability: [f64; 2],
    answer: rest::rest::Answer<f64>,
    mean: Option<Vector>,
    sure_s: f64,
}

impl Default for Rest {
    fn default() -> Self {
        Self { probability: [0.5; 2], answer: rest::rest::Answer::default(), mean: None, sure_s: 0.0 }
    }
}

impl Rest {
    /// One instant of `dt` seconds: the rate without its bias, rad/s, the force, m/s², the deviations of the bias, and the
    /// densities of the noises of gyroscope and accelerometer. Returns whether the sensor rests.
    ///
    /// # Errors
    /// Only the program's own checks, which finite readings pass.
    pub(super) fn feel(
        &mut self,
        rate: Vector,
        force: Vector,
        bias: Vector,
        densities: [f64; 2],
        dt: f64,
    ) -> Result<bool, Error> {
        let mean = self.mean.get_or_insert(force);
        for axis in 0..3 {
            mean[axis] += (dt / MEAN_S).min(1.0) * (force[axis] - mean[axis]);
        }
        let [gyroscope, accelerometer] = densities.map(|density| density / dt.sqrt());
        let noise = bias.map(|bias| bias.hypot(gyroscope));
        let swing: Vector = std::array::from_fn(|axis| force[axis] - mean[axis]);
        let question = rest::rest().dt(dt).rate(&rate).swing(&swing).noise(&noise).swings(accelerometer);
        question.previous_rest(&self.probability).run_into(&mut self.answer)?;
        self.probability.copy_from_slice(self.answer.distribution());
        self.sure_s = if self.probability[1] > SURE.0 { self.sure_s + dt } else { 0.0 };
        Ok(self.sure_s > SURE.1)
    }

    /// After a gap nothing is known.
    pub(super) fn forget(&mut self) {
        *self = Self { answer: std::mem::take(&mut self.answer), ..Self::default() };
    }
}
