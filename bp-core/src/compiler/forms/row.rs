//! Rows of probabilities: `categorical(p₁, p₂, …)`, tables, and the weights of a mixture.
//!
//! In: p₁ … p_k. Out: whether they are a distribution. Invariant: each lies in [0, 1], where it is computed within
//! rounding, and they sum to one within rounding.

use super::{bernoulli, between};
use crate::law::Arithmetic;
use crate::model::row_tolerance;
use crate::operators::Binary;

/// Whether each entry lies in [0, 1], within its tolerance, and they sum to one. Entries without a tolerance are surely
/// probabilities.
pub(crate) fn holds<A: Arithmetic>(
    by: &mut A,
    row: &[A::Number],
    tolerance: impl Fn(usize) -> Option<f64>,
) -> A::Number {
    let (mut sum, mut holds) = (by.constant(0.0), by.constant(1.0));
    for (position, entry) in row.iter().enumerate() {
        sum = by.add(sum, *entry);
        if let Some(tolerance) = tolerance(position) {
            let inside = bernoulli::holds(by, *entry, tolerance);
            holds = by.binary(Binary::And, holds, inside);
        }
    }
    let tolerance = row_tolerance(row.len());
    let (low, high) = (by.constant(1.0 - tolerance), by.constant(1.0 + tolerance));
    let whole = between(by, sum, low, high);
    by.binary(Binary::And, holds, whole)
}
