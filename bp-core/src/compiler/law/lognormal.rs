//! Lognormal law: ln X is normal with mean m and standard deviation s.
//!
//! f(x) = N(ln x; m, s) / x for x > 0,  E = exp(m + s²/2),  Var = (exp(s²) − 1) exp(2m + s²).

use super::{Arithmetic, Constraint, Refusal, Sample, Support, fit::NOT_POSITIVE, normal};
use crate::operators::Binary;
use rand::Rng;

pub(super) const NAME: &str = "lognormal";
pub(super) const PARAMETERS: [(&str, Constraint); 2] = [
    ("mean of the logarithm", Constraint::Real),
    ("standard deviation of the logarithm", Constraint::Positive),
];
pub(super) const SUPPORT: Support = Support::Positive;

pub(super) fn ln_density<A: Arithmetic>(by: &mut A, x: A::Number, parameters: [A::Number; 2]) -> A::Number {
    let (zero, ln_x) = (by.constant(0.0), by.ln(x));
    let normal = normal::ln_density(by, ln_x, parameters);
    let value = by.subtract(normal, ln_x);
    let inside = by.greater(x, zero);
    by.within(inside, value)
}

pub(super) fn mass<A: Arithmetic>(
    by: &mut A,
    low: A::Number,
    high: A::Number,
    parameters: [A::Number; 2],
) -> Option<A::Number> {
    // The density is 0 below 0, so a bound there equals one at the smallest positive number.
    let least = by.constant(f64::MIN_POSITIVE);
    let [low, high] = [low, high].map(|x| by.binary(Binary::Maximum, x, least));
    let length = ln_ratio(by, low, high);
    let length = by.divide(length, parameters[1]);
    let ends = [low, high].map(|x| {
        let ln = by.ln(x);
        normal::standard(by, ln, parameters)
    });
    Some(normal::standard_mass(by, ends, length))
}

/// ln(high/low); of close numbers ln(1 + u) = u ln w / (w − 1) with u = (high − low)/low and w = 1 + u, where the rounding
/// of w cancels (Kahan).
fn ln_ratio<A: Arithmetic>(by: &mut A, low: A::Number, high: A::Number) -> A::Number {
    let (one, half, difference) = (by.constant(1.0), by.constant(0.5), by.subtract(high, low));
    let u = by.divide(difference, low);
    let w = by.add(one, u);
    let (rest, ln_w) = (by.subtract(w, one), by.ln(w));
    let product = by.multiply(u, ln_w);
    let near = by.divide(product, rest);
    let near = by.select(rest, near, u);
    let [ln_low, ln_high] = [low, high].map(|x| by.ln(x));
    let far = by.subtract(ln_high, ln_low);
    let is_near = by.binary(Binary::Less, u, half);
    by.select(is_near, near, far)
}

pub(super) fn tails(x: f64, parameters: [f64; 2]) -> (f64, f64) {
    if x > 0.0 { normal::tails(x.ln(), parameters) } else { (0.0, 1.0) }
}

pub(super) fn mean([m, s]: [f64; 2]) -> f64 {
    (m + 0.5 * s * s).exp()
}

pub(super) fn variance([m, s]: [f64; 2]) -> f64 {
    (s * s).exp_m1() * (2.0 * m + s * s).exp()
}

/// The normal law of the logarithms.
pub(super) fn fit(sample: &Sample, known: &[f64]) -> Result<[f64; 2], Refusal> {
    match sample.ends().0 > 0.0 {
        true => normal::fit(&sample.map(f64::ln), known),
        false => Err(NOT_POSITIVE),
    }
}

pub(super) fn draw(by: &mut impl Rng, parameters: [f64; 2]) -> f64 {
    normal::draw(by, parameters).exp()
}

/// m + ½ ln 2πe + ln s
pub(super) fn entropy([mean, deviation]: [f64; 2]) -> f64 {
    mean + super::normal::entropy([0.0, deviation])
}

/// exp(m − s²)
pub(super) fn mode([mean, deviation]: [f64; 2]) -> Option<f64> {
    Some((mean - deviation * deviation).exp())
}
