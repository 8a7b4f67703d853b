//! Exponential law with rate r: the waiting time for an event that occurs at rate r.
//!
//! f(x) = r exp(−r x) for x ≥ 0,  F(x) = 1 − exp(−r x),  E = 1/r,  Var = 1/r².

use super::{Arithmetic, Constraint, Refusal, Sample, Support, fit::NOT_NEGATIVE, weibull};
use crate::operators::{Binary, Unary};
use rand::Rng;
use rand_distr::{Distribution, Exp1};

pub(super) const NAME: &str = "exponential";
pub(super) const PARAMETERS: [(&str, Constraint); 1] = [("rate", Constraint::Positive)];
pub(super) const SUPPORT: Support = Support::Positive;

pub(super) fn ln_density<A: Arithmetic>(by: &mut A, x: A::Number, [rate]: [A::Number; 1]) -> A::Number {
    let (zero, ln_rate) = (by.constant(0.0), by.ln(rate));
    let product = by.multiply(rate, x);
    let value = by.subtract(ln_rate, product);
    let inside = by.binary(Binary::GreaterOrEqual, x, zero);
    by.within(inside, value)
}

pub(super) fn mass<A: Arithmetic>(
    by: &mut A,
    low: A::Number,
    high: A::Number,
    [rate]: [A::Number; 1],
) -> Option<A::Number> {
    // exp(−r l) − exp(−r h) = exp(−r l) (1 − exp(−r (h − l)))
    let zero = by.constant(0.0);
    let [low, high] = [low, high].map(|x| by.binary(Binary::Maximum, x, zero));
    let length = by.subtract(high, low);
    let [start, length] = [low, length].map(|x| by.multiply(rate, x));
    let minus = by.unary(Unary::Negate, start);
    let (left, share) = (by.exp(minus), by.complement_of_exp(length));
    Some(by.multiply(left, share))
}

pub(super) fn tails(x: f64, [rate]: [f64; 1]) -> (f64, f64) {
    weibull::tails(x, [1.0, 1.0 / rate])
}

pub(super) fn mean([rate]: [f64; 1]) -> f64 {
    1.0 / rate
}

pub(super) fn variance([rate]: [f64; 1]) -> f64 {
    1.0 / (rate * rate)
}

/// r = 1 / mean of x
pub(super) fn fit(sample: &Sample, _: &[f64]) -> Result<[f64; 1], Refusal> {
    let mean = sample.mean_of(|x| x);
    if sample.ends().0 >= 0.0 && mean > 0.0 { Ok([1.0 / mean]) } else { Err(NOT_NEGATIVE) }
}

pub(super) fn draw(by: &mut impl Rng, [rate]: [f64; 1]) -> f64 {
    let standard: f64 = Exp1.sample(by);
    standard / rate
}

/// 1 − ln r
pub(super) fn entropy([rate]: [f64; 1]) -> f64 {
    1.0 - rate.ln()
}

pub(super) fn mode(_: [f64; 1]) -> Option<f64> {
    Some(0.0)
}
