//! The positive half of a law that is symmetric around 0: twice its density for x ≥ 0.

use super::Arithmetic;
use crate::operators::Binary;
use std::f64::consts::LN_2;

/// ln of the density at x, from ln of the density of the whole law.
pub(super) fn ln_density<A: Arithmetic>(
    by: &mut A,
    x: A::Number,
    whole: impl Fn(&mut A, A::Number, [A::Number; 2]) -> A::Number,
    scale: A::Number,
) -> A::Number {
    let (zero, ln_2) = (by.constant(0.0), by.constant(LN_2));
    let whole = whole(by, x, [zero, scale]);
    let value = by.add(whole, ln_2);
    let inside = by.binary(Binary::GreaterOrEqual, x, zero);
    by.within(inside, value)
}

/// The probability of an interval, from that of the whole law.
pub(super) fn mass<A: Arithmetic>(
    by: &mut A,
    ends: [A::Number; 2],
    whole: impl Fn(&mut A, A::Number, A::Number, [A::Number; 2]) -> Option<A::Number>,
    scale: A::Number,
) -> Option<A::Number> {
    let (zero, two) = (by.constant(0.0), by.constant(2.0));
    let [low, high] = ends.map(|end| by.binary(Binary::Maximum, end, zero));
    let whole = whole(by, low, high, [zero, scale])?;
    Some(by.multiply(two, whole))
}
