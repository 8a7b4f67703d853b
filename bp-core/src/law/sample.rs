//! A sample: numbers with weights.
//!
//! In: numbers and weights. Out: weighted means. Invariant: equal numbers are one entry, and sums are computed in the
//! order of the entries, so that with integer weights the result does not depend on the order of observations.
//!
//! E\[g\] = Σ wᵢ g(xᵢ) / Σ wᵢ

use std::collections::BTreeMap;

/// Numbers and their weights.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Sample {
    /// By the bits of the number: any order that is always the same will do.
    weights: BTreeMap<u64, f64>,
}

impl Sample {
    /// Adds a number with a weight.
    pub fn add(&mut self, number: f64, weight: f64) {
        // −0 is 0.
        *self.weights.entry((number + 0.0).to_bits()).or_default() += weight;
    }

    /// Adds another sample.
    pub fn add_all(&mut self, other: &Sample) {
        other.iter().for_each(|(number, weight)| self.add(number, weight));
    }

    /// The numbers with their weights.
    pub fn iter(&self) -> impl Iterator<Item = (f64, f64)> {
        self.weights.iter().map(|(bits, weight)| (f64::from_bits(*bits), *weight))
    }

    /// Σ wᵢ
    pub fn total(&self) -> f64 {
        self.weights.values().sum()
    }

    /// Whether it is empty.
    pub fn is_empty(&self) -> bool {
        self.total() <= 0.0
    }

    /// Σ wᵢ g(xᵢ) / Σ wᵢ; numbers of weight 0 are skipped.
    pub fn mean_of(&self, g: impl Fn(f64) -> f64) -> f64 {
        let seen = self.iter().filter(|(_, weight)| *weight > 0.0);
        seen.map(|(number, weight)| weight * g(number)).sum::<f64>() / self.total()
    }

    /// The smallest and the largest number.
    pub fn ends(&self) -> (f64, f64) {
        let seen = self.iter().filter(|(_, weight)| *weight > 0.0);
        seen.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (number, _)| {
            (low.min(number), high.max(number))
        })
    }

    /// The same weights on other numbers.
    pub fn map(&self, g: impl Fn(f64) -> f64) -> Sample {
        let mut mapped = Sample::default();
        self.iter().for_each(|(number, weight)| mapped.add(g(number), weight));
        mapped
    }
}

impl FromIterator<f64> for Sample {
    fn from_iter<I: IntoIterator<Item = f64>>(numbers: I) -> Self {
        let mut sample = Sample::default();
        numbers.into_iter().for_each(|number| sample.add(number, 1.0));
        sample
    }
}
