//! `bernoulli(p)`: true with probability p.
//!
//! In: p. Out: P(true) = p, P(false) = 1 − p. Invariant: p lies in [0, 1]; of a computed p, what rounding put outside is the
//! nearer end.

use super::between;
use crate::law::Arithmetic;
use crate::operators::Binary;

/// The probability of a truth value.
pub(crate) fn probability<A: Arithmetic>(by: &mut A, truth: A::Number, p: A::Number) -> A::Number {
    let one = by.constant(1.0);
    let complement = by.subtract(one, p);
    by.select(truth, p, complement)
}

/// Whether p lies in [0, 1], but for this tolerance.
pub(crate) fn holds<A: Arithmetic>(by: &mut A, p: A::Number, tolerance: f64) -> A::Number {
    let (low, high) = (by.constant(-tolerance), by.constant(1.0 + tolerance));
    between(by, p, low, high)
}

/// The number of [0, 1] that is nearest to p.
pub(crate) fn nearest<A: Arithmetic>(by: &mut A, p: A::Number) -> A::Number {
    let (zero, one) = (by.constant(0.0), by.constant(1.0));
    let p = by.binary(Binary::Maximum, p, zero);
    by.binary(Binary::Minimum, p, one)
}
