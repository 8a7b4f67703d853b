//! `mixture(w₁, f₁, w₂, f₂, …)`: one of several forms, by chance.
//!
//! In: weights and what each form gives to a value. Out: Σ wᵢ fᵢ(x). Invariant: the weights are those of a row: they sum to
//! one.

use crate::law::Arithmetic;

/// Σ wᵢ fᵢ(x)
pub(crate) fn density<A: Arithmetic>(
    by: &mut A,
    parts: impl IntoIterator<Item = (A::Number, A::Number)>,
) -> A::Number {
    let zero = by.constant(0.0);
    parts.into_iter().fold(zero, |sum, (weight, density)| {
        let part = by.multiply(weight, density);
        by.add(sum, part)
    })
}
