//! A mixture of normal distributions of some slots.
//!
//! In: weights, means and covariances. Out: moments, cumulative probabilities, quantiles and densities. Invariant: the
//! weights sum to one; tails are sums of tails, never differences from one.

use super::Figure;
use super::quantile::not_rounding;
use crate::distribution::ROUNDING;
use crate::operators::normal_cumulative;
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// One component.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Component {
    /// Its weight.
    pub weight: f64,
    /// Means, slot by slot.
    pub mean: Vec<f64>,
    /// Covariances, row by row.
    pub covariance: Vec<f64>,
}

/// A mixture of normal distributions.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Mixture(pub Vec<Component>);

impl Component {
    /// Whether it has one value.
    pub(crate) fn is_point(&self) -> bool {
        (0..self.mean.len()).all(|place| self.deviation(place) == 0.0)
    }

    /// The standard deviation of a slot.
    pub(crate) fn deviation(&self, place: usize) -> f64 {
        self.covariance[place * self.mean.len() + place].max(0.0).sqrt()
    }
}

impl Component {
    /// The entropy in nats, ½ ln det(2πe Σ): −∞ where the distribution has no density.
    pub(crate) fn entropy(&self) -> f64 {
        let size = self.mean.len();
        match DMatrix::from_row_slice(size, size, &self.covariance).cholesky() {
            Some(root) => root.l().diagonal().map(f64::ln).sum() + 0.5 * size as f64 * (TAU.ln() + 1.0),
            None => f64::NEG_INFINITY,
        }
    }
}

impl Mixture {
    /// The distribution of the slots at some positions.
    pub fn marginal(&self, places: &[usize]) -> Self {
        let of = |own: &Component| Component {
            weight: own.weight,
            mean: places.iter().map(|place| own.mean[*place]).collect(),
            covariance: (places.iter())
                .flat_map(|row| places.iter().map(|column| own.covariance[*row * own.mean.len() + *column]))
                .collect(),
        };
        Self(self.0.iter().map(of).collect())
    }

    /// The mean of a slot.
    pub fn mean(&self, place: usize) -> f64 {
        self.0.iter().map(|own| own.weight * own.mean[place]).sum()
    }

    /// The covariance of two slots: the mean covariance, and the covariance of the means.
    pub fn covariance(&self, one: usize, other: usize) -> f64 {
        let (mean, means) = (self.mean(one), self.mean(other));
        let of = |own: &Component| {
            let inside = own.covariance[one * own.mean.len() + other];
            own.weight * (inside + (own.mean[one] - mean) * (own.mean[other] - means))
        };
        self.0.iter().map(of).sum()
    }

    /// The standard deviation of a slot.
    pub fn deviation(&self, place: usize) -> f64 {
        self.covariance(place, place).max(0.0).sqrt()
    }

    /// The smallest value of a slot that is not exceeded with this probability, by bisection to the last digits.
    pub fn quantile(&self, place: usize, level: f64) -> f64 {
        // The tail that is smaller: P(X ≤ x) < level, or P(X > x) > 1 − level.
        let low = level <= 0.5;
        let is_below = |x: f64| {
            let tail = |own: &Component| {
                let (away, deviation) = (x - own.mean[place], own.deviation(place));
                own.weight
                    * match (deviation > 0.0, low) {
                        (true, true) => normal_cumulative(away / deviation),
                        (true, false) => normal_cumulative(-away / deviation),
                        (false, true) => f64::from(u8::from(away >= 0.0)),
                        (false, false) => f64::from(u8::from(away < 0.0)),
                    }
            };
            let sum: f64 = self.0.iter().map(tail).sum();
            if low { sum < level } else { sum > 1.0 - level }
        };
        let reach = |own: &Component| 40.0 * own.deviation(place);
        let edge = |sign: f64| self.0.iter().map(move |own| own.mean[place] + sign * reach(own));
        let mut from = edge(-1.0).fold(f64::MAX, f64::min);
        let mut to = edge(1.0).fold(f64::MIN, f64::max);
        (from, to) = (from.max(f64::MIN), to.min(f64::MAX));
        loop {
            let middle = 0.5 * from + 0.5 * to;
            // Also where it is NaN.
            if !(from < middle && middle < to) {
                // A value of probability above 0 between the last two numbers is the quantile itself.
                let atoms =
                    self.0.iter().filter(|own| own.deviation(place) == 0.0).map(|own| own.mean[place]);
                let mut near = atoms.filter(|atom| from <= *atom && *atom <= to && !is_below(*atom));
                return not_rounding(near.next().unwrap_or(to), self.deviation(place));
            }
            if is_below(middle) { from = middle } else { to = middle }
        }
    }

    /// The probability of a point that some components are, up to rounding; else the density of the others there.
    pub(crate) fn figure(&self, at: &[f64]) -> Figure {
        let (points, others): (Vec<&Component>, Vec<&Component>) =
            self.0.iter().partition(|own| own.is_point());
        let agrees = |own: &&&Component| {
            let mut pairs = own.mean.iter().zip(at);
            pairs.all(|(mean, at)| (mean - at).abs() <= ROUNDING * mean.abs().max(at.abs()))
        };
        let p: f64 = points.iter().filter(agrees).map(|own| own.weight).sum();
        match p > 0.0 || others.is_empty() {
            true => Figure::Probability { p },
            false => {
                let density = others.iter().map(|own| own.weight * density(&own.mean, &own.covariance, at));
                Figure::Density { density: density.sum() }
            }
        }
    }

    /// The density at a point; infinite where a component without a density lies.
    pub fn density(&self, at: &[f64]) -> f64 {
        self.0.iter().map(|own| own.weight * density(&own.mean, &own.covariance, at)).sum()
    }
}

/// The density of a normal distribution at a point: infinite, or 0, if the distribution has no density.
pub(crate) fn density(mean: &[f64], covariance: &[f64], at: &[f64]) -> f64 {
    let size = mean.len();
    let away = DVector::from_iterator(size, at.iter().zip(mean).map(|(at, mean)| at - mean));
    match DMatrix::from_row_slice(size, size, covariance).cholesky() {
        Some(root) => {
            let ln_determinant: f64 = 2.0 * root.l().diagonal().map(f64::ln).sum();
            (-0.5 * (away.dot(&root.solve(&away)) + ln_determinant + size as f64 * TAU.ln())).exp()
        }
        None if away.amax() == 0.0 => f64::INFINITY,
        None => 0.0,
    }
}
