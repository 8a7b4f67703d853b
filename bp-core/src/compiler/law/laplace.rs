//! Laplace law with location m and scale b: exponential on both sides of m.
//!
//! f(x) = exp(−|x − m|/b) / (2b),  F(x) = ½ exp((x − m)/b) below m, 1 − ½ exp((m − x)/b) above it,  E = m,  Var = 2b².

use super::{Arithmetic, Constraint, Refusal, Sample, Support, fit::TOO_EQUAL, normal::standard};
use crate::operators::{Binary, Unary};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, Exp1};
use std::f64::consts::LN_2;

pub(super) const NAME: &str = "laplace";
pub(super) const PARAMETERS: [(&str, Constraint); 2] =
    [("location", Constraint::Real), ("scale", Constraint::Positive)];
pub(super) const SUPPORT: Support = Support::Reals;

pub(super) fn ln_density<A: Arithmetic>(by: &mut A, x: A::Number, [m, b]: [A::Number; 2]) -> A::Number {
    let t = standard(by, x, [m, b]);
    let (size, ln_b, ln_2) = (by.unary(Unary::Absolute, t), by.ln(b), by.constant(LN_2));
    let ln_total = by.add(ln_b, ln_2);
    let value = by.add(size, ln_total);
    by.unary(Unary::Negate, value)
}

/// On one side of m: ½ e^(−a) (1 − e^(−d)), a the distance of the nearer end and d the length; around m: what lies on each
/// side.
pub(super) fn mass<A: Arithmetic>(
    by: &mut A,
    low: A::Number,
    high: A::Number,
    parameters: [A::Number; 2],
) -> Option<A::Number> {
    let (zero, half) = (by.constant(0.0), by.constant(0.5));
    let [u, v] = [low, high].map(|end| standard(by, end, parameters));
    let [below, above] = [u, v].map(|end| by.unary(Unary::Absolute, end));
    let nearer = by.binary(Binary::Minimum, below, above);
    let (minus, length) = (by.unary(Unary::Negate, nearer), by.subtract(high, low));
    let length = by.divide(length, parameters[1]);
    let (start, part) = (by.exp(minus), by.complement_of_exp(length));
    let beside = by.multiply(start, part);
    let (left, right) = (by.complement_of_exp(below), by.complement_of_exp(above));
    let around = by.add(left, right);
    let (starts_below, ends_above) = (by.greater(zero, u), by.greater(v, zero));
    let is_around = by.binary(Binary::And, starts_below, ends_above);
    let whole = by.select(is_around, around, beside);
    Some(by.multiply(half, whole))
}

pub(super) fn tails(x: f64, [m, b]: [f64; 2]) -> (f64, f64) {
    let t = (x - m) / b;
    let tail = 0.5 * pxfm::f_exp(-t.abs());
    if t > 0.0 { (1.0 - tail, tail) } else { (tail, 1.0 - tail) }
}

pub(super) fn mean([m, _]: [f64; 2]) -> f64 {
    m
}

pub(super) fn variance([_, b]: [f64; 2]) -> f64 {
    2.0 * b * b
}

/// m the median,  b = mean of |x − m|
pub(super) fn fit(sample: &Sample, _: &[f64]) -> Result<[f64; 2], Refusal> {
    let median = sample.median();
    let scale = sample.mean_of(|x| (x - median).abs());
    if scale > 0.0 { Ok([median, scale]) } else { Err(TOO_EQUAL) }
}

pub(super) fn draw(by: &mut impl Rng, [m, b]: [f64; 2]) -> f64 {
    let standard: f64 = Exp1.sample(by);
    if by.random::<bool>() { m + b * standard } else { m - b * standard }
}

/// 1 + ln 2s
pub(super) fn entropy([_, scale]: [f64; 2]) -> f64 {
    1.0 + (2.0 * scale).ln()
}

pub(super) fn mode([location, _]: [f64; 2]) -> Option<f64> {
    Some(location)
}
