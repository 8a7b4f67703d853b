//! `dirac(v)`: probability 1 at v.
//!
//! In: v. Out: P(x) = 1 where x = v, else 0. Invariant: v is a finite number; a v outside the domain has probability 0.
//! Reals are equal up to rounding, since 0.1 + 2·0.1 is not 0.3 in f64, and so are a whole number and a v that is not whole by
//! construction.

use crate::law::{Arithmetic, Constraint, ROUNDING};
use crate::operators::{Binary, Unary};

/// The probability of x.
pub(crate) fn probability<A: Arithmetic>(by: &mut A, x: A::Number, v: A::Number) -> A::Number {
    by.binary(Binary::Equal, x, v)
}

/// The probability of a real x.
pub(crate) fn probability_of_real<A: Arithmetic>(by: &mut A, x: A::Number, v: A::Number) -> A::Number {
    let difference = by.subtract(x, v);
    let [difference, x, v] = [difference, x, v].map(|number| by.unary(Unary::Absolute, number));
    let (larger, rounding) = (by.binary(Binary::Maximum, x, v), by.constant(ROUNDING));
    let most = by.multiply(rounding, larger);
    by.binary(Binary::LessOrEqual, difference, most)
}

/// The whole number that a number is up to rounding, else the number: 3 of 3 · 0.1 · 10.
pub(crate) fn whole<A: Arithmetic>(by: &mut A, v: A::Number) -> A::Number {
    let nearest = by.unary(Unary::Round, v);
    let is_whole = probability_of_real(by, v, nearest);
    by.select(is_whole, nearest, v)
}

/// x − y of reals, 0 where they are equal up to rounding.
pub(crate) fn difference<A: Arithmetic>(by: &mut A, x: A::Number, y: A::Number) -> A::Number {
    let (are_equal, difference) = (probability_of_real(by, x, y), by.subtract(x, y));
    let zero = by.constant(0.0);
    by.select(are_equal, zero, difference)
}

/// A comparison of reals, which are equal up to rounding.
pub(crate) fn compared<A: Arithmetic>(by: &mut A, operator: Binary, x: A::Number, y: A::Number) -> A::Number {
    let (difference, zero) = (difference(by, x, y), by.constant(0.0));
    by.binary(operator, difference, zero)
}

/// The constraint on v.
pub(crate) const VALUE: Constraint = Constraint::Real;
