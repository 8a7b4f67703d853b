//! `dirac(v)`: v, for sure.
//!
//! In: v. Out: P(x) = 1 where x = v, else 0. Invariant: v is a finite number; outside the domain it has probability 0.

use crate::law::{Arithmetic, Constraint};
use crate::operators::Binary;

/// The probability of x.
pub(crate) fn probability<A: Arithmetic>(by: &mut A, x: A::Number, v: A::Number) -> A::Number {
    by.binary(Binary::Equal, x, v)
}

/// What v must be.
pub(crate) const VALUE: Constraint = Constraint::Real;
