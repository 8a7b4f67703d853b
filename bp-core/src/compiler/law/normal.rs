//! Normal law with mean m and standard deviation s.
//!
//! f(x) = exp(−½ ((x − m)/s)²) / (s √(2π)),  F(x) = Φ((x − m)/s),  E = m,  Var = s².

use super::{Arithmetic, Constraint, Refusal, Sample, Support, fit::TOO_EQUAL};
use crate::operators::{Unary, normal_cumulative};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

pub(super) const NAME: &str = "normal";
pub(super) const PARAMETERS: [(&str, Constraint); 2] =
    [("mean", Constraint::Real), ("standard deviation", Constraint::Positive)];
pub(super) const SUPPORT: Support = Support::Reals;

pub(super) fn ln_density<A: Arithmetic>(by: &mut A, x: A::Number, [m, s]: [A::Number; 2]) -> A::Number {
    let z = standard(by, x, [m, s]);
    let (square, minus_half) = (by.multiply(z, z), by.constant(-0.5));
    let exponent = by.multiply(minus_half, square);
    let (ln_s, ln_root) = (by.ln(s), by.constant(0.5 * std::f64::consts::TAU.ln()));
    let ln_total = by.add(ln_s, ln_root);
    by.subtract(exponent, ln_total)
}

pub(super) fn density<A: Arithmetic>(by: &mut A, x: A::Number, parameters: [A::Number; 2]) -> A::Number {
    let (standard, zero) = (standard(by, x, parameters), by.constant(0.0));
    let bell = bell(by, standard, zero);
    let root = by.constant(std::f64::consts::TAU.sqrt());
    let total = by.multiply(parameters[1], root);
    by.divide(bell, total)
}

/// z = (x − m) / s
pub(crate) fn standard<A: Arithmetic>(by: &mut A, x: A::Number, [m, s]: [A::Number; 2]) -> A::Number {
    let centred = by.subtract(x, m);
    by.divide(centred, s)
}

/// exp(−½ z²) / exp(−½ z₀²) = exp(½ (z₀ − z) (z₀ + z))
pub(crate) fn bell<A: Arithmetic>(by: &mut A, z: A::Number, from: A::Number) -> A::Number {
    let (difference, sum) = (by.subtract(from, z), by.add(from, z));
    let (product, half) = (by.multiply(difference, sum), by.constant(0.5));
    let exponent = by.multiply(half, product);
    by.exp(exponent)
}

/// Φ(b) − Φ(a); above the mean Φ(−a) − Φ(−b), which keeps the digits of a far tail.
pub(super) fn mass<A: Arithmetic>(
    by: &mut A,
    low: A::Number,
    high: A::Number,
    parameters: [A::Number; 2],
) -> Option<A::Number> {
    let (low, high) = (standard(by, low, parameters), standard(by, high, parameters));
    let zero = by.constant(0.0);
    let above = by.greater(low, zero);
    let (minus_low, minus_high) = (by.unary(Unary::Negate, low), by.unary(Unary::Negate, high));
    let (upper, lower) = (by.select(above, minus_low, high), by.select(above, minus_high, low));
    let (upper, lower) = (by.unary(Unary::NormalCumulative, upper), by.unary(Unary::NormalCumulative, lower));
    Some(by.subtract(upper, lower))
}

pub(super) fn tails(x: f64, [m, s]: [f64; 2]) -> (f64, f64) {
    let z = (x - m) / s;
    (normal_cumulative(z), normal_cumulative(-z))
}

pub(super) fn mean([m, _]: [f64; 2]) -> f64 {
    m
}

pub(super) fn variance([_, s]: [f64; 2]) -> f64 {
    s * s
}

/// m = mean of x,  s² = mean of (x − m)²: of maximum likelihood, which divides by N, not by N − 1.
pub(super) fn fit(sample: &Sample, _: &[f64]) -> Result<[f64; 2], Refusal> {
    let deviation = sample.deviation();
    if deviation > 0.0 { Ok([sample.mean(), deviation]) } else { Err(TOO_EQUAL) }
}

pub(super) fn draw(by: &mut impl Rng, [m, s]: [f64; 2]) -> f64 {
    let standard: f64 = StandardNormal.sample(by);
    m + s * standard
}
