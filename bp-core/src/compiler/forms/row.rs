//! Rows of probabilities: `categorical(p₁, p₂, …)`, tables, and the weights of a mixture.
//!
//! In: p₁ … p_k. Out: whether they are a distribution. Invariant: within rounding each lies in [0, 1], and they sum to
//! one.

use super::between;
use crate::law::Arithmetic;
use crate::model::row_tolerance;
use crate::operators::Binary;

/// Whether no entry is negative and they sum to one. Entries that are `surely` probabilities are not checked.
pub(crate) fn holds<A: Arithmetic>(
    by: &mut A,
    row: &[A::Number],
    surely: impl Fn(usize) -> bool,
) -> A::Number {
    let tolerance = row_tolerance(row.len());
    let least = by.constant(-tolerance);
    let (mut sum, mut holds) = (by.constant(0.0), by.constant(1.0));
    for (position, entry) in row.iter().enumerate() {
        sum = by.add(sum, *entry);
        if !surely(position) {
            let positive = by.binary(Binary::GreaterOrEqual, *entry, least);
            holds = by.binary(Binary::And, holds, positive);
        }
    }
    let (low, high) = (by.constant(1.0 - tolerance), by.constant(1.0 + tolerance));
    let whole = between(by, sum, low, high);
    by.binary(Binary::And, holds, whole)
}
