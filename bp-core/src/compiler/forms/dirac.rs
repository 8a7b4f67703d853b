//! `dirac(v)`: probability 1 at v.
//!
//! In: v. Out: P(x) = 1 where x = v, else 0. Invariant: v is a finite number; a v outside the domain has probability 0.

use crate::law::{Arithmetic, Constraint};
use crate::operators::Binary;

/// The probability of x.
pub(crate) fn probability<A: Arithmetic>(by: &mut A, x: A::Number, v: A::Number) -> A::Number {
    by.binary(Binary::Equal, x, v)
}

/// The constraint on v.
pub(crate) const VALUE: Constraint = Constraint::Real;
