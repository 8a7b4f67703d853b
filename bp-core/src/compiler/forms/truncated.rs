//! `truncated(f, low, high)`: a form restricted to an interval, both bounds included.
//!
//! In: the density f(x), and the bounds. Out: f(x) inside and 0 outside, to be divided by the mass of f inside. Over bins
//! the mass of the part of each bin that lies inside. Invariant: low < high.

use crate::law::Arithmetic;
use crate::operators::Binary;

/// f(x) inside the bounds, else 0.
pub(crate) fn density<A: Arithmetic>(
    by: &mut A,
    density: A::Number,
    x: A::Number,
    bounds: [A::Number; 2],
) -> A::Number {
    let zero = by.constant(0.0);
    let inside = by.lies_between(x, bounds);
    by.select(inside, density, zero)
}

/// The ends of the part of a bin that lies inside the bounds; equal ends if none does.
pub(crate) fn part<A: Arithmetic>(
    by: &mut A,
    [from, to]: [A::Number; 2],
    [low, high]: [A::Number; 2],
) -> [A::Number; 2] {
    let from = by.binary(Binary::Maximum, from, low);
    let to = by.binary(Binary::Minimum, to, high);
    [from, by.binary(Binary::Maximum, from, to)]
}

/// Whether low < high.
pub(crate) fn holds<A: Arithmetic>(by: &mut A, [low, high]: [A::Number; 2]) -> A::Number {
    by.binary(Binary::Less, low, high)
}
