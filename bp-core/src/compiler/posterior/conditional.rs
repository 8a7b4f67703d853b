//! Finite slots and reals together: given each combination of values, a mixture of normal distributions.
//!
//! In: a [`Mixture`] of the reals whose components each have values of the finite slots. Out: its parts: probabilities,
//! mixtures, moments. Invariant: the weights of all components sum to one; slots are in the order of the part.
//!
//! P(D = d, x) = Σ_c w_c [d_c = d] N(x; m_c, Σ_c)   (Lauritzen 1992)

use super::Figure;
use super::mixture::{Component, Mixture, density};
use super::one_real::{Peak, highest};
use super::part::{PartLaw, Slot, ordinals};
use crate::operators::entropy_term;
use crate::radix;
use rand::Rng;
use serde::{Deserialize, Serialize};

/// A distribution of finite slots and reals.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct ConditionalGaussian {
    /// The values of the finite slots in each component, as ordinals.
    pub values: Vec<Vec<usize>>,
    /// The components, of the real slots.
    pub mixture: Mixture,
}

/// The positions of the finite slots, and of the reals.
pub(crate) fn apart(of: &[Slot]) -> (Vec<usize>, Vec<usize>) {
    (0..of.len()).partition(|place| of[*place].count > 0)
}

impl ConditionalGaussian {
    /// The distribution of the slots at some positions, ascending.
    pub(crate) fn marginal(&self, of: &[Slot], places: &[usize]) -> PartLaw {
        let (finite, reals) = apart(of);
        let kept = |all: &[usize]| -> Vec<usize> {
            (0..all.len()).filter(|own| places.contains(&all[*own])).collect()
        };
        let (of_finite, of_reals) = (kept(&finite), kept(&reals));
        let values: Vec<Vec<usize>> =
            self.values.iter().map(|own| of_finite.iter().map(|at| own[*at]).collect()).collect();
        let mixture = self.mixture.marginal(&of_reals);
        match (of_finite.is_empty(), of_reals.is_empty()) {
            (true, _) => PartLaw::Mixture(mixture),
            (_, true) => {
                let slots: Vec<Slot> = of_finite.iter().map(|at| of[finite[*at]].clone()).collect();
                PartLaw::Finite(Self { values, mixture }.probabilities(&slots).into())
            }
            _ => PartLaw::ConditionalGaussian(Self { values, mixture }),
        }
    }

    /// The probability of each combination of values of the finite slots, the last one fastest.
    pub(crate) fn probabilities(&self, finite: &[Slot]) -> Vec<f64> {
        let mut all = vec![0.0; finite.iter().map(|slot| slot.count).product()];
        for (values, component) in self.values.iter().zip(&self.mixture.0) {
            let digits = values.iter().zip(finite).map(|(value, slot)| (*value, slot.count));
            all[radix::position(digits)] += component.weight;
        }
        all
    }

    /// The mixture of the reals at each combination of values that is possible, with its position.
    pub(crate) fn given_each(&self, finite: &[Slot]) -> Vec<(usize, Mixture)> {
        let probabilities = self.probabilities(finite);
        let given = |(at, p): (usize, &f64)| {
            let wanted = ordinals(finite, at);
            let own = self.values.iter().zip(&self.mixture.0).filter(|(values, _)| **values == wanted);
            let mut mixture = Mixture(own.map(|(_, component)| component.clone()).collect());
            mixture.0.iter_mut().for_each(|component| component.weight /= p);
            (*p > 0.0).then_some((at, mixture))
        };
        probabilities.iter().enumerate().filter_map(given).collect()
    }

    /// The probability of values of the finite slots, times the density of the reals at a point.
    pub(crate) fn density(&self, values: &[usize], at: &[f64]) -> f64 {
        let own = self.values.iter().zip(&self.mixture.0).filter(|(own, _)| *own == values);
        own.map(|(_, own)| own.weight * density(&own.mean, &own.covariance, at)).sum()
    }

    /// The probability of values of the finite slots together with a point of the reals, or their density there.
    pub(crate) fn figure(&self, values: &[usize], at: &[f64]) -> Figure {
        let own = self.values.iter().zip(&self.mixture.0).filter(|(own, _)| *own == values);
        let own = Mixture(own.map(|(_, own)| own.clone()).collect());
        // Where no component has these values, the others tell what a value of the reals has.
        match own.0.is_empty() && !self.mixture.0.iter().all(Component::is_point) {
            true => Figure::Density { density: 0.0 },
            false => own.figure(at),
        }
    }

    /// The entropy in nats: that of the finite slots, and the mean of that of the reals given them, of which there is one, or one
    /// component at each combination of values.
    pub(crate) fn entropy(&self, of: &[Slot]) -> f64 {
        let finite: Vec<Slot> = apart(of).0.into_iter().map(|place| of[place].clone()).collect();
        let probabilities = self.probabilities(&finite);
        let given = |(at, mixture): (usize, Mixture)| {
            let inside = match mixture.0.as_slice() {
                [only] => only.entropy(),
                _ => mixture.of_slot(0).entropy(),
            };
            entropy_term(probabilities[at]) + probabilities[at] * inside
        };
        self.given_each(&finite).into_iter().map(given).sum()
    }

    /// The values of the finite slots and of the reals at which probability times density is largest, all of several, and this
    /// product; of reals as in [`ConditionalGaussian::entropy`], or of points. Of reals that determine each other the density is that of the first
    /// in this order of them.
    pub(crate) fn modes(&self, of: &[Slot], order: &[usize]) -> Vec<(Vec<usize>, Peak)> {
        let finite: Vec<Slot> = apart(of).0.into_iter().map(|place| of[place].clone()).collect();
        let probabilities = self.probabilities(&finite);
        let (mut values, mut peaks) = (Vec::new(), Vec::new());
        for (at, mixture) in self.given_each(&finite) {
            let inside = match mixture.0.as_slice() {
                [only] => vec![only.peak(order)],
                _ if order.len() > 1 => mixture.points(),
                _ => mixture.of_slot(0).modes(),
            };
            values.extend(inside.iter().map(|_| ordinals(&finite, at)));
            peaks.extend(inside.into_iter().map(|own| Peak { size: own.size * probabilities[at], ..own }));
        }
        let best = highest(peaks.clone());
        let all = values.into_iter().zip(peaks);
        all.filter(|(_, own)| best.contains(own)).collect()
    }

    /// Values of the finite slots and of the reals drawn at random.
    pub(crate) fn draw(&self, by: &mut impl Rng) -> (Vec<usize>, Vec<f64>) {
        let place = self.mixture.choose(by);
        (self.values[place].clone(), self.mixture.0[place].draw(by))
    }

    /// The covariance of two slots; `numbers` has the number of each value of a finite one.
    pub(crate) fn covariance(&self, of: &[Slot], places: [usize; 2], numbers: &[Vec<f64>; 2]) -> f64 {
        let (finite, reals) = apart(of);
        let place = |all: &[usize], wanted: usize| all.iter().position(|own| *own == wanted);
        // The mean of a slot in each component.
        let means = |which: usize| -> Vec<f64> {
            let components = self.values.iter().zip(&self.mixture.0);
            match (place(&finite, places[which]), place(&reals, places[which])) {
                (Some(at), _) => components.map(|(values, _)| numbers[which][values[at]]).collect(),
                (_, Some(at)) => components.map(|(_, own)| own.mean[at]).collect(),
                _ => Vec::new(),
            }
        };
        let (one, other) = (means(0), means(1));
        let weights = || self.mixture.0.iter().map(|own| own.weight);
        let mean = |of: &[f64]| weights().zip(of).map(|(weight, mean)| weight * mean).sum::<f64>();
        let (mean_one, mean_other) = (mean(&one), mean(&other));
        let inside = |component: usize| match (place(&reals, places[0]), place(&reals, places[1])) {
            (Some(row), Some(column)) => self.mixture.0[component].covariance[row * reals.len() + column],
            _ => 0.0,
        };
        let term = |(at, weight): (usize, f64)| {
            weight * (inside(at) + (one[at] - mean_one) * (other[at] - mean_other))
        };
        weights().enumerate().map(term).sum()
    }
}
