//! `normal(m, s)` over integers, relative to the integer nearest to the mean.
//!
//! In: mean, deviation, an integer. Out: f(k) / f(k₀). Invariant: k₀ has weight 1, so that the weights do not all
//! underflow where the mean is far outside the domain.

use crate::law::{Arithmetic, normal};
use crate::operators::{Binary, Unary};

/// The integer between low and high that is nearest to the mean.
pub(crate) fn nearest<A: Arithmetic>(by: &mut A, mean: A::Number, [low, high]: [A::Number; 2]) -> A::Number {
    let half = by.constant(0.5);
    let rounded = by.add(mean, half);
    let rounded = by.unary(Unary::Floor, rounded);
    let nearest = by.binary(Binary::Maximum, rounded, low);
    by.binary(Binary::Minimum, nearest, high)
}

/// f(x) / f(x₀), given the standardised x₀.
pub(crate) fn weight<A: Arithmetic>(
    by: &mut A,
    x: A::Number,
    from: A::Number,
    parameters: [A::Number; 2],
) -> A::Number {
    let standard = normal::standard(by, x, parameters);
    normal::bell(by, standard, from)
}
