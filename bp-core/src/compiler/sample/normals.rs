//! A weighted mixture of normal laws: what particles say of a variable that they did not draw.
//!
//! In: weights, means and deviations. Out: moments and quantiles, each with its standard error. Invariant: the weights sum to one.

use super::draws::{Moments, error_of_quantile, error_of_sum};
use crate::shared;
use crate::special::normal_cumulative;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// How often the interval in which a quantile lies is halved.
const HALVINGS: usize = 60;

/// Normal laws, one for each particle.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Normals {
    /// Its moments.
    pub moments: Moments,
    /// Weight, mean and deviation of each law.
    #[serde(with = "shared")]
    laws: Arc<Vec<[f64; 3]>>,
    /// The origin of each law, where laws of one origin are not independent.
    #[serde(with = "shared")]
    origins: Arc<Option<Vec<u32>>>,
}

impl Normals {
    /// From the weight, mean and deviation of each law, and its origin.
    pub(crate) fn of_origins(laws: Vec<[f64; 3]>, origins: Option<Vec<u32>>) -> Self {
        let own = origins.as_deref();
        let mean = about(&laws, own, &|m, _| m);
        let variance = about(&laws, own, &|m, s| s * s + (m - mean[0]).powi(2));
        let deviation = variance[0].sqrt();
        let error = if deviation > 0.0 { variance[1] / (2.0 * deviation) } else { 0.0 };
        let found = quantiles(&laws, own, &Moments::LEVELS);
        let quantiles = [found[0], found[1], found[2]];
        let moments = Moments { mean, deviation: [deviation, error], variance, quantiles };
        Self { moments, laws: Arc::new(laws), origins: Arc::new(origins) }
    }

    /// The quantiles at some levels, and their standard errors.
    pub fn quantiles(&self, levels: &[f64]) -> Vec<[f64; 2]> {
        quantiles(&self.laws, self.origins.as_deref(), levels)
    }
}

/// Σ w f, and its standard error.
fn about(laws: &[[f64; 3]], origins: Option<&[u32]>, f: &dyn Fn(f64, f64) -> f64) -> [f64; 2] {
    let mean: f64 = laws.iter().map(|[weight, m, s]| weight * f(*m, *s)).sum();
    let parts = laws.iter().map(|[weight, m, s]| weight * (f(*m, *s) - mean)).enumerate();
    [mean, error_of_sum(parts, origins)]
}

fn quantiles(laws: &[[f64; 3]], origins: Option<&[u32]>, levels: &[f64]) -> Vec<[f64; 2]> {
    let below = |x: f64| {
        about(laws, origins, &|m, s| {
            if s > 0.0 { normal_cumulative((x - m) / s) } else { f64::from(u8::from(m <= x)) }
        })
    };
    let (low, high) = laws
        .iter()
        .fold((f64::MAX, f64::MIN), |(low, high), [_, m, s]| (low.min(m - 10.0 * s), high.max(m + 10.0 * s)));
    let at = |level: f64| {
        let (mut from, mut to) = (low, high);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (from + to);
            if below(middle)[0] < level { from = middle } else { to = middle }
        }
        0.5 * (from + to)
    };
    levels.iter().map(|level| error_of_quantile(at, below, *level)).collect()
}
