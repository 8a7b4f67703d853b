//! Distributions of forms at known values of their parents.
//!
//! In: a model with numbers for its parameters ([`Setting`]), one factor for one left-hand variable ([`Instance`]), and
//! the values of the variables. Out: a [`Distribution`]: the logarithm of its density at a value, or a draw. Invariant:
//! the equations are those of `forms/`, evaluated as numbers; with separate exponents where f64 would underflow.
//!
//! A value is the ordinal of a finite domain's value, or a real. An assignment is one number for each slot: a variable
//! has a slot, a family one for each element, a vector one for each component.

mod affine;
mod check;
mod compared;
mod compiled;
mod contexts;
mod dual;
mod form;
mod invalid;
mod law;
mod least;
pub(crate) mod ln_terms;
mod number;
mod order;
mod reads;
mod setting;
mod tape;
mod vector;
mod written_out;
mod zero;

pub(crate) use affine::{LinearMean, has_square, no_square};
pub(crate) use compiled::{Assigned, Densities, scale_of};
pub(crate) use contexts::Contexts;
pub use least::Least;
pub(crate) use ln_terms::{LnTerms, exact_sum, weights as ln_weights};
pub use setting::{Instance, Setting};
pub(crate) use tape::Cells;
pub(crate) use written_out::{WrittenOut, uses_elements};

use crate::exec::scalar::{Extended, Scalar};
use crate::forms::dirac;
pub(crate) use crate::law::ROUNDING;
use crate::law::{Arithmetic as _, Law, Numbers, Parameters, Share};
use rand::Rng;
use rand::RngExt;

/// A distribution of one left-hand side.
#[derive(Clone, PartialEq, Debug)]
pub enum Distribution {
    /// One probability for each value; of several variables together, the last one fastest. All are 0 where no value is
    /// possible.
    Finite(Vec<f64>),
    /// The same with separate exponents, where a positive probability would be 0 in f64.
    Wide(Vec<Extended>),
    /// A law of a real.
    Law(Law, Parameters),
    /// A law between two bounds, and the mass that it has there.
    Truncated {
        /// The law.
        law: Law,
        /// Its parameters.
        parameters: Parameters,
        /// The bounds.
        bounds: [f64; 2],
        /// P(low ≤ X ≤ high).
        mass: Extended,
    },
    /// A point mass at a real.
    Point(f64),
    /// One of several proportions, given the earlier ones.
    Share(Share),
    /// One of several sorted draws, given the earlier ones.
    Least(Least),
    /// A mixture, with the weights of its components.
    Mixture(Vec<(f64, Distribution)>),
}

/// Upper limit on the rejections of a truncated law before its quantile function is used.
const MOST_REJECTIONS: usize = 16;

impl Distribution {
    /// ln of the probability of a value, or of the density at a real. A point mass has no density: 0 at its value, else
    /// −∞.
    pub fn ln_density(&self, value: f64) -> f64 {
        match self {
            Distribution::Finite(_) | Distribution::Wide(_) if value < 0.0 || value.fract() != 0.0 => {
                f64::NEG_INFINITY
            }
            Distribution::Finite(probabilities) => {
                probabilities.get(value as usize).map_or(f64::NEG_INFINITY, |p| p.ln())
            }
            Distribution::Wide(probabilities) => {
                let ln = |p: &Extended| p.natural_logarithm().to_f64();
                probabilities.get(value as usize).map_or(f64::NEG_INFINITY, ln)
            }
            Distribution::Law(law, parameters) => law::ln_density(*law, value, parameters),
            Distribution::Truncated { law, parameters, bounds: [low, high], mass } => {
                let inside = Numbers.lies_between(value, [*low, *high]) != 0.0 && *mass > Extended::ZERO;
                let ln_mass = || mass.natural_logarithm().to_f64();
                if inside { law::ln_density(*law, value, parameters) - ln_mass() } else { f64::NEG_INFINITY }
            }
            Distribution::Point(point) => dirac::probability_of_real(&mut Numbers, value, *point).ln(),
            Distribution::Share(share) => share.ln_density(value),
            Distribution::Least(least) => least.ln_density(value),
            Distribution::Mixture(parts) => {
                let terms: Vec<f64> =
                    parts.iter().map(|(weight, part)| weight.ln() + part.ln_density(value)).collect();
                ln_sum(&terms)
            }
        }
    }

    /// Probabilities of a finite left-hand side, in f64 where none underflows.
    fn finite(probabilities: Vec<Extended>) -> Self {
        let is_lost = |p: &Extended| *p > Extended::ZERO && p.to_f64() < f64::MIN_POSITIVE;
        match probabilities.iter().any(is_lost) {
            true => Distribution::Wide(probabilities),
            false => Distribution::Finite(probabilities.iter().map(|p| p.to_f64()).collect()),
        }
    }

    /// The probabilities of a finite left-hand side, with separate exponents.
    pub(crate) fn extended(self) -> Option<Vec<Extended>> {
        match self {
            Distribution::Finite(probabilities) => {
                Some(probabilities.into_iter().map(Extended::from_f64).collect())
            }
            Distribution::Wide(probabilities) => Some(probabilities),
            _ => None,
        }
    }

    /// A draw; `None` where no value is possible.
    pub fn draw(&self, by: &mut impl Rng) -> Option<f64> {
        match self {
            Distribution::Finite(probabilities) => {
                let total: f64 = probabilities.iter().sum();
                choose(probabilities, by.random::<f64>() * total).map(|ordinal| ordinal as f64)
            }
            Distribution::Wide(probabilities) => {
                Distribution::Finite(probabilities.iter().map(|p| p.to_f64()).collect()).draw(by)
            }
            Distribution::Law(law, parameters) => Some(law.draw(by, law::exactly(*law, parameters))),
            Distribution::Truncated { law, parameters, bounds, mass } => {
                let parameters = law::exactly(*law, parameters);
                if *mass <= Extended::ZERO {
                    return None;
                }
                for _ in 0..MOST_REJECTIONS {
                    let drawn = law.draw(by, parameters);
                    if bounds[0] <= drawn && drawn <= bounds[1] {
                        return Some(drawn);
                    }
                }
                let below = Extended::from_f64(by.random::<f64>()) * *mass;
                Some(law::inverse(*law, parameters, *bounds, below))
            }
            Distribution::Point(point) => Some(*point),
            Distribution::Share(share) => Some(share.draw(by)),
            Distribution::Least(least) => least.draw(by),
            Distribution::Mixture(parts) => {
                let weights: Vec<f64> = parts.iter().map(|(weight, _)| *weight).collect();
                let total: f64 = weights.iter().sum();
                parts[choose(&weights, by.random::<f64>() * total)?].1.draw(by)
            }
        }
    }

    /// The only value that a Dirac allows; `None` where its value is outside the domain.
    pub(crate) fn only_value(&self) -> Option<f64> {
        match self {
            Distribution::Point(value) => Some(*value),
            Distribution::Finite(probabilities) => {
                probabilities.iter().position(|probability| *probability > 0.0).map(|value| value as f64)
            }
            // The last of several proportions is one minus the others.
            Distribution::Share(share) => Some(share.of),
            _ => None,
        }
    }

    /// Whether it is a point mass or has one among its components.
    pub fn has_point(&self) -> bool {
        match self {
            Distribution::Point(_) => true,
            Distribution::Mixture(parts) => parts.iter().any(|(_, part)| part.has_point()),
            _ => false,
        }
    }
}

/// The first position at which the running sum of the weights exceeds a threshold; `None` where all are 0.
pub fn choose(weights: &[f64], threshold: f64) -> Option<usize> {
    let mut sum = 0.0;
    let mut last = None;
    for (position, weight) in weights.iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
        sum += weight;
        last = Some(position);
        if sum > threshold {
            break;
        }
    }
    last
}

/// Turns logarithms into numbers in proportion to their exponentials, the largest 1; all 0 if nothing is possible.
pub fn exponentiate(cells: &mut [f64]) {
    let most = cells.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    cells.iter_mut().for_each(|cell| *cell = if most.is_finite() { (*cell - most).exp() } else { 0.0 });
}

/// The same, divided by their sum: for large logarithms it is more exact than to subtract [`ln_sum`], which is rounded.
pub fn normalise(cells: &mut [f64]) {
    exponentiate(cells);
    let total: f64 = cells.iter().sum();
    if total > 0.0 {
        cells.iter_mut().for_each(|cell| *cell /= total);
    }
}

/// ln Σ exp(tᵢ), without overflow or underflow; −∞ for an empty sum.
pub fn ln_sum(terms: &[f64]) -> f64 {
    let most = terms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if !most.is_finite() {
        return most;
    }
    most + terms.iter().map(|term| (term - most).exp()).sum::<f64>().ln()
}
