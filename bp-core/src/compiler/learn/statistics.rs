//! Statistics of distributions.
//!
//! In: observations with weights. Out: counts, samples, rows of a regression. Invariant: with integer weights the
//! result does not depend on the order.

use super::distribution::{Kind, Learnable, Seen};
use crate::law::Sample;
use std::collections::BTreeMap;

/// The statistic of one distribution.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Statistic {
    /// The count of each value.
    Counts(Vec<f64>),
    Sample(Sample),
    /// Rows of numbers, by their bits, and the count of each.
    Rows(BTreeMap<Vec<u64>, f64>),
}

impl Statistic {
    pub(super) fn of(kind: &Kind) -> Self {
        match kind {
            Kind::Row(row) => Statistic::Counts(vec![0.0; row.len()]),
            Kind::Law(..) => Statistic::Sample(Sample::default()),
            Kind::Regression(_) => Statistic::Rows(BTreeMap::new()),
        }
    }

    pub(super) fn add(&mut self, seen: &Seen, weight: f64) {
        match (self, seen) {
            (Statistic::Counts(counts), Seen::Value(value)) => counts[*value] += weight,
            (Statistic::Sample(sample), Seen::Number(number)) => sample.add(*number, weight),
            (Statistic::Rows(rows), Seen::Numbers(numbers)) => {
                let bits = numbers.iter().map(|number| (number + 0.0).to_bits()).collect();
                *rows.entry(bits).or_default() += weight;
            }
            _ => unreachable!("internal: observations are of the kind of their distribution"),
        }
    }

    /// The rows as numbers.
    pub(super) fn rows(&self) -> Vec<(Vec<f64>, f64)> {
        match self {
            Statistic::Rows(rows) => (rows.iter())
                .map(|(bits, weight)| (bits.iter().map(|bits| f64::from_bits(*bits)).collect(), *weight))
                .collect(),
            _ => Vec::new(),
        }
    }
}

/// Distributions may be found while cases are processed: each gets an empty statistic.
pub(super) fn grow(learnable: &Learnable, statistics: &mut Vec<Statistic>) {
    let new = learnable.distributions().iter().skip(statistics.len());
    statistics.extend(new.map(|it| Statistic::of(&it.kind)));
}
