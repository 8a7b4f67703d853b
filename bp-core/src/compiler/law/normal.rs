//! Normal law with mean m and standard deviation s.
//!
//! f(x) = exp(−½ ((x − m)/s)²) / (s √(2π)),  F(x) = Φ((x − m)/s),  E = m,  Var = s².

use super::{Arithmetic, Constraint, Refusal, Sample, Support, fit::TOO_EQUAL};
use crate::operators::{Binary, Unary, normal_cumulative};
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

pub(super) fn mass<A: Arithmetic>(
    by: &mut A,
    low: A::Number,
    high: A::Number,
    parameters: [A::Number; 2],
) -> Option<A::Number> {
    let length = by.subtract(high, low);
    let length = by.divide(length, parameters[1]);
    let ends = [low, high].map(|end| standard(by, end, parameters));
    Some(standard_mass(by, ends, length))
}

/// Φ(b) − Φ(a), b − a being known; above the mean Φ(−a) − Φ(−b), which keeps the digits of a far tail. Between close ends,
/// where the difference loses digits, Taylor's series around the middle m: with h = (b − a)/2 it is
/// 2h φ(m) (1 + (m² − 1) h²/6 + (m⁴ − 6m² + 3) h⁴/120), to 10⁻¹⁴ where h max(1, |m|) ≤ 0.01.
pub(super) fn standard_mass<A: Arithmetic>(
    by: &mut A,
    [low, high]: [A::Number; 2],
    length: A::Number,
) -> A::Number {
    let (zero, one, half) = (by.constant(0.0), by.constant(1.0), by.constant(0.5));
    let above = by.greater(low, zero);
    let (minus_low, minus_high) = (by.unary(Unary::Negate, low), by.unary(Unary::Negate, high));
    let (upper, lower) = (by.select(above, minus_low, high), by.select(above, minus_high, low));
    let (upper, lower) = (by.unary(Unary::NormalCumulative, upper), by.unary(Unary::NormalCumulative, lower));
    let apart = by.subtract(upper, lower);
    let h = by.multiply(half, length);
    let middle = by.add(low, h);
    let (square, small) = (by.multiply(middle, middle), by.multiply(h, h));
    let (six, three, sixth, twentieth) =
        (by.constant(6.0), by.constant(3.0), by.constant(1.0 / 6.0), by.constant(1.0 / 20.0));
    let second = by.subtract(square, one);
    let fourth = by.subtract(square, six);
    let fourth = by.multiply(fourth, square);
    let fourth = by.add(fourth, three);
    let fourth = by.multiply(fourth, small);
    let fourth = by.multiply(fourth, twentieth);
    let terms = by.add(second, fourth);
    let terms = by.multiply(terms, small);
    let terms = by.multiply(terms, sixth);
    let series = by.add(one, terms);
    let (bell, root) = (bell(by, middle, zero), by.constant(std::f64::consts::TAU.sqrt().recip()));
    let front = by.multiply(length, root);
    let front = by.multiply(front, bell);
    let together = by.multiply(front, series);
    let size = by.unary(Unary::Absolute, middle);
    let size = by.binary(Binary::Maximum, size, one);
    let (reach, most) = (by.multiply(h, size), by.constant(0.01));
    let is_close = by.binary(Binary::Less, reach, most);
    by.select(is_close, together, apart)
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

/// ½ ln 2πe + ln s
pub(super) fn entropy([_, deviation]: [f64; 2]) -> f64 {
    0.5 * (std::f64::consts::TAU.ln() + 1.0) + deviation.ln()
}

pub(super) fn mode([mean, _]: [f64; 2]) -> Option<f64> {
    Some(mean)
}
