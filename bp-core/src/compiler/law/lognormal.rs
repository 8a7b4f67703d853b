//! Lognormal law: ln X is normal with mean m and standard deviation s.
//!
//! f(x) = N(ln x; m, s) / x for x > 0,  E = exp(m + s²/2),  Var = (exp(s²) − 1) exp(2m + s²).

use super::{Arithmetic, Constraint, Refusal, Sample, Support, fit::NOT_POSITIVE, normal};
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
    let end = |by: &mut A, x| {
        let inside = by.greater(x, least);
        let x = by.select(inside, x, least);
        by.ln(x)
    };
    let (low, high) = (end(by, low), end(by, high));
    normal::mass(by, low, high, parameters)
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
