//! `bernoulli(p)`: true with probability p.
//!
//! In: p, and 1 − p where it has digits of its own. Out: P(true) = p, P(false) = 1 − p. Invariant: p lies in [0, 1];
//! rounding errors of a computed p beyond it are clamped.

use super::between;
use crate::law::Arithmetic;
use crate::operators::Binary;

/// The probability of a truth value.
pub(crate) fn probability<A: Arithmetic>(
    by: &mut A,
    truth: A::Number,
    p: A::Number,
    complement: Option<A::Number>,
) -> A::Number {
    let complement = complement.unwrap_or_else(|| {
        let one = by.constant(1.0);
        by.subtract(one, p)
    });
    by.select(truth, p, complement)
}

/// Whether p lies in [0, 1], within this tolerance.
pub(crate) fn holds<A: Arithmetic>(by: &mut A, p: A::Number, tolerance: f64) -> A::Number {
    let (low, high) = (by.constant(-tolerance), by.constant(1.0 + tolerance));
    between(by, p, low, high)
}

/// p, clamped to [0, 1] if it lies outside by no more than the tolerance.
pub(crate) fn rounded<A: Arithmetic>(by: &mut A, p: A::Number, tolerance: f64) -> A::Number {
    if tolerance == 0.0 {
        return p;
    }
    let (holds, nearest) = (holds(by, p, tolerance), nearest(by, p));
    by.select(holds, nearest, p)
}

/// p, clamped to [0, 1].
pub(crate) fn nearest<A: Arithmetic>(by: &mut A, p: A::Number) -> A::Number {
    let (zero, one) = (by.constant(0.0), by.constant(1.0));
    let p = by.binary(Binary::Maximum, p, zero);
    by.binary(Binary::Minimum, p, one)
}
