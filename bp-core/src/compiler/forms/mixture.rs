//! `mixture(w₁, f₁, w₂, f₂, …)`: a mixture of forms.
//!
//! In: weights and the density of each form at a value. Out: Σ wᵢ fᵢ(x). Invariant: the weights are those of a row:
//! they sum to one.

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
