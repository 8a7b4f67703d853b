//! `uniform`: all values equally probable.
//!
//! In: the number of values. Out: P(x) = 1 / count. Invariant: for several variables together, the count is that of
//! their combinations.

use crate::law::Arithmetic;

/// The probability of each value.
pub(crate) fn probability<A: Arithmetic>(by: &mut A, count: A::Number) -> A::Number {
    let one = by.constant(1.0);
    by.divide(one, count)
}
