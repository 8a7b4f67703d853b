//! Quantiles of one number.
//!
//! In: the distribution of a slot, levels. Out: quantiles, each with its standard error. Invariant: the quantile at p of a finite
//! variable is the smallest value whose cumulative probability reaches p; within a bin the probability is spread evenly.

use super::Figure;
use super::part::{Drawn, Part, PartLaw};
use crate::model::{Bins, Domain, Model, Statistic};
use crate::sample::error_of_quantile;
use statrs::distribution::{ContinuousCDF, Normal};

/// A cumulative probability that is below a level by at most this share of it is rounding; and so is a quantile that is at
/// most this share of a deviation.
const ROUNDING: f64 = 1e-12;

/// The figures of a statistic that consists of quantiles, which `at` gives with their standard errors, if they are estimated.
pub(crate) fn figures(
    statistic: &Statistic,
    at: impl FnOnce(&[f64]) -> Vec<(f64, Option<f64>)>,
) -> Option<Vec<Figure>> {
    let levels = statistic.levels()?;
    let found = at(&levels);
    Some(match statistic {
        Statistic::Interval(level) => {
            let errors = found[0].1.zip(found[1].1).map(|(low, high)| [low, high]);
            vec![Figure::Interval { level: *level, interval: [found[0].0, found[1].0], errors }]
        }
        _ => {
            let figure = |(level, (quantile, error)): (&f64, (f64, Option<f64>))| Figure::Quantile {
                level: *level,
                quantile,
                error,
            };
            levels.iter().zip(found).map(figure).collect()
        }
    })
}

/// The quantile of a normal law.
pub(crate) fn of_normal(mean: f64, deviation: f64, level: f64) -> f64 {
    not_rounding(mean + deviation * Normal::standard().inverse_cdf(level), deviation)
}

/// A quantile; 0 where it is rounding beside the deviation, such as the median of a symmetric distribution.
pub(super) fn not_rounding(quantile: f64, deviation: f64) -> f64 {
    if quantile.abs() <= ROUNDING * deviation { 0.0 } else { quantile }
}

/// The quantile of a finite variable: `p` has a probability for each of its values.
pub(crate) fn of_finite(domain: &Domain, p: &[f64], level: f64) -> f64 {
    let wanted = level * p.iter().sum::<f64>();
    let (mut reached, mut last) = (0.0, 0);
    for (value, p) in p.iter().enumerate().filter(|(_, p)| **p > 0.0) {
        last = value;
        if reached + p >= wanted * (1.0 - ROUNDING) {
            return match intervals(domain) {
                Some(bins) => {
                    let (low, high) = (bins.edges()[value], bins.edges()[value + 1]);
                    low + ((wanted - reached) / p).clamp(0.0, 1.0) * (high - low)
                }
                None => domain.number(value),
            };
        }
        reached += p;
    }
    intervals(domain).map_or_else(|| domain.number(last), |bins| bins.edges()[last + 1])
}

/// The bins, where values are intervals.
fn intervals(domain: &Domain) -> Option<&Bins> {
    domain.bins().filter(|bins| bins.points().is_none())
}

impl Part {
    /// The quantiles of a slot of a part with one context, and their standard errors, if they are estimated.
    pub(crate) fn quantiles(&self, model: &Model, place: usize, levels: &[f64]) -> Vec<(f64, Option<f64>)> {
        let own = self.marginal(&[place]);
        let slot = &own.of[0];
        let domain = &model.variables[slot.variable].domain;
        let exact =
            |quantile: &dyn Fn(f64) -> f64| levels.iter().map(|level| (quantile(*level), None)).collect();
        match &own.law {
            PartLaw::Normal { mean, covariance } => {
                exact(&|level| of_normal(mean[0], covariance[0].max(0.0).sqrt(), level))
            }
            PartLaw::Laws { laws, .. } => exact(&|level| laws[0].quantile(level)),
            PartLaw::Mixture(mixture) => exact(&|level| mixture.quantile(0, level)),
            PartLaw::NamedMixture(mixture) => exact(&|level| mixture.quantile(0, level)),
            PartLaw::Finite(numbers) => exact(&|level| of_finite(domain, numbers, level)),
            // A marginal of one slot is finite or a mixture.
            PartLaw::ConditionalGaussian(_) => exact(&|_| f64::NAN),
            PartLaw::Draws(draws, drawn) => {
                let estimated: Vec<[f64; 2]> = match (&drawn[0], own.probabilities()) {
                    (Drawn::Normals(normals), _) => normals.quantiles(levels),
                    (Drawn::At(position), None) => draws.quantiles(*position, levels),
                    (Drawn::At(position), Some(p)) => {
                        let at = |level: f64| of_finite(domain, &p, level);
                        let below = |quantile: f64| {
                            let last = domain.ordinal_among(quantile, Some(slot.count)).unwrap_or(0) as f64;
                            draws.mean(|draw| f64::from(u8::from(draws.value(draw, *position) <= last)))
                        };
                        levels.iter().map(|level| error_of_quantile(at, below, *level)).collect()
                    }
                };
                estimated.into_iter().map(|[quantile, error]| (quantile, Some(error))).collect()
            }
        }
    }
}
