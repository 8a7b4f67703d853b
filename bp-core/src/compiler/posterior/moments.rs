//! Statistics of a distribution.
//!
//! In: the probabilities of one context. Out: moments, entropies, information and divergences, in nats. Invariant: 0 ln
//! 0 is 0, and non-negative quantities are not negative.

use crate::exec::scalar::{Extended, Scalar};

/// The expectation and the variance of values: Σ s p, Σ (s − expectation)² p.
pub(crate) fn of(numbers: &[f64], values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let weighted = numbers.iter().zip(values);
    let expectation: f64 = weighted.clone().map(|(p, value)| p * value).sum();
    (expectation, weighted.map(|(p, value)| p * (value - expectation).powi(2)).sum())
}

/// Mutual information: Σ p(x, y) ln (p(x, y) / (p(x) p(y))), with the `second` values of y contiguous for each x
/// (Shannon 1948).
pub(crate) fn information(numbers: &[f64], second: usize) -> f64 {
    let rows: Vec<f64> = numbers.chunks(second).map(|row| row.iter().sum()).collect();
    let mut columns = vec![0.0; second];
    for row in numbers.chunks(second) {
        columns.iter_mut().zip(row).for_each(|(sum, p)| *sum += p);
    }
    let term = |(at, p): (usize, &f64)| {
        let (row, column) = (rows[at / second], columns[at % second]);
        match (*p > 0.0, (row * column).is_normal()) {
            (false, _) => 0.0,
            (true, true) => p * (p / (row * column)).ln(),
            (true, false) => p * (p.ln() - row.ln() - column.ln()),
        }
    };
    numbers.iter().enumerate().map(term).fold(0.0, |sum, term| sum + term).max(0.0) + 0.0
}

/// Σ p ln (p / q): infinite where q is 0 and p is not (Kullback and Leibler 1951).
pub(crate) fn divergence(first: &[Extended], second: &[Extended]) -> f64 {
    let term = |(p, q): (&Extended, &Extended)| match (*p > Extended::ZERO, *q > Extended::ZERO) {
        (false, _) => 0.0,
        (true, false) => f64::INFINITY,
        (true, true) => (*p * (*p / *q).natural_logarithm()).to_f64(),
    };
    first.iter().zip(second).map(term).fold(0.0, |sum, term| sum + term).max(0.0) + 0.0
}
