//! `truncated(f, low, high)`: a form between two bounds, both of which are inside.
//!
//! In: what f gives to x, and the bounds. Out: f(x) inside and 0 outside, which is divided by what f gives to the inside.
//! Invariant: low < high.

use super::between;
use crate::law::Arithmetic;
use crate::operators::Binary;

/// f(x) inside the bounds, else 0.
pub(crate) fn density<A: Arithmetic>(
    by: &mut A,
    density: A::Number,
    x: A::Number,
    [low, high]: [A::Number; 2],
) -> A::Number {
    let zero = by.constant(0.0);
    let inside = between(by, x, low, high);
    by.select(inside, density, zero)
}

/// Whether low < high.
pub(crate) fn holds<A: Arithmetic>(by: &mut A, [low, high]: [A::Number; 2]) -> A::Number {
    by.binary(Binary::Less, low, high)
}
