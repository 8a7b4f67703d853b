//! `weights(w)`: proportional to w, over the values of the left-hand variable.
//!
//! In: w at each value. Out: w(x) / Σ w (see [`share`](super::share)). Invariant: weights are finite and not negative;
//! if all are 0, all probabilities are 0.

use crate::law::Arithmetic;
use crate::operators::Binary;

/// Whether w is finite and not negative.
pub(crate) fn holds<A: Arithmetic>(by: &mut A, w: A::Number) -> A::Number {
    let (zero, infinity) = (by.constant(0.0), by.constant(f64::INFINITY));
    let positive = by.binary(Binary::GreaterOrEqual, w, zero);
    let finite = by.binary(Binary::Less, w, infinity);
    by.binary(Binary::And, positive, finite)
}
