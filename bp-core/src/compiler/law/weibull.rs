//! Weibull law with shape k and scale c: the time to failure where the hazard grows as a power of time.
//!
//! f(x) = (k/c) (x/c)^(k−1) exp(−(x/c)^k) for x > 0,  F(x) = 1 − exp(−(x/c)^k),
//! E = c Γ(1 + 1/k),  Var = c² (Γ(1 + 2/k) − Γ(1 + 1/k)²).

use super::{
    Arithmetic, Constraint, Numbers, Refusal, Sample, Support,
    fit::{MOST_SHAPE, NOT_POSITIVE, TOO_EQUAL, positive_root},
};
use crate::operators::{Binary, Unary, ln_gamma};
use rand::Rng;
use rand_distr::{Distribution, Exp1};

pub(super) const NAME: &str = "weibull";
pub(super) const PARAMETERS: [(&str, Constraint); 2] =
    [("shape", Constraint::Positive), ("scale", Constraint::Positive)];
pub(super) const SUPPORT: Support = Support::Positive;

pub(super) fn ln_density<A: Arithmetic>(by: &mut A, x: A::Number, [k, c]: [A::Number; 2]) -> A::Number {
    let (zero, one) = (by.constant(0.0), by.constant(1.0));
    let (ln_ratio, power) = ratio(by, x, [k, c]);
    let hazard = by.divide(k, c);
    let (ln_hazard, less) = (by.ln(hazard), by.subtract(k, one));
    let ln_power = by.multiply(less, ln_ratio);
    let ln_power = by.select(less, ln_power, zero);
    let value = by.add(ln_hazard, ln_power);
    let value = by.subtract(value, power);
    let inside = by.greater(x, zero);
    by.within(inside, value)
}

/// ln(x/c) and (x/c)^k; from ln x − ln c where the ratio may leave the range of the number type.
fn ratio<A: Arithmetic>(by: &mut A, x: A::Number, [k, c]: [A::Number; 2]) -> (A::Number, A::Number) {
    let ratio = by.divide(x, c);
    let (low, high) = (by.constant(1e-30), by.constant(1e30));
    let (above, below) = (by.greater(ratio, low), by.greater(high, ratio));
    let near = by.binary(Binary::And, above, below);
    let (ln_x, ln_c, ln_near) = (by.ln(x), by.ln(c), by.ln(ratio));
    let ln_far = by.subtract(ln_x, ln_c);
    let ln_power = by.multiply(k, ln_far);
    let (power, power_far) = (by.binary(Binary::Power, ratio, k), by.exp(ln_power));
    (by.select(near, ln_near, ln_far), by.select(near, power, power_far))
}

pub(super) fn mass<A: Arithmetic>(
    by: &mut A,
    low: A::Number,
    high: A::Number,
    [k, c]: [A::Number; 2],
) -> Option<A::Number> {
    let zero = by.constant(0.0);
    let hazard = |by: &mut A, x| {
        let x = by.binary(Binary::Maximum, x, zero);
        ratio(by, x, [k, c]).1
    };
    // exp(−l) − exp(−h) = exp(−l) (1 − exp(l − h))
    let (low, high) = (hazard(by, low), hazard(by, high));
    let (difference, minus_low) = (by.subtract(high, low), by.unary(Unary::Negate, low));
    let (left, share) = (by.exp(minus_low), by.complement_of_exp(difference));
    Some(by.multiply(left, share))
}

pub(super) fn tails(x: f64, [k, c]: [f64; 2]) -> (f64, f64) {
    if x <= 0.0 {
        return (0.0, 1.0);
    }
    let (_, power) = ratio(&mut Numbers, x, [k, c]);
    (-pxfm::f_expm1(-power), pxfm::f_exp(-power))
}

pub(super) fn mean([k, c]: [f64; 2]) -> f64 {
    c * ln_gamma(1.0 + 1.0 / k).exp()
}

pub(super) fn variance([k, c]: [f64; 2]) -> f64 {
    let first = ln_gamma(1.0 + 1.0 / k).exp();
    c * c * (ln_gamma(1.0 + 2.0 / k).exp() - first * first)
}

/// Σ xᵏ ln x / Σ xᵏ − 1/k = E[ln x] by Newton's method, then cᵏ = E[xᵏ]. Numbers are taken relative to the largest, so that no
/// power overflows. k is [`MOST_SHAPE`] at most.
pub(super) fn fit(sample: &Sample, _: &[f64]) -> Result<[f64; 2], Refusal> {
    let (least, most) = sample.ends();
    if least <= 0.0 {
        return Err(NOT_POSITIVE);
    }
    let relative = |x: f64| {
        let off = (x - most) / most;
        if off > -0.5 { off.ln_1p() } else { x.ln() - most.ln() }
    };
    let mean = sample.mean_of(relative);
    let deviation = sample.mean_of(|x| (relative(x) - mean).powi(2)).sqrt();
    if deviation <= 0.0 || relative(least) > -1e-15 {
        return Err(TOO_EQUAL);
    }
    // ln X has the standard deviation π / (k √6).
    let start = (std::f64::consts::PI / (deviation * 6f64.sqrt())).min(MOST_SHAPE);
    let equation = |k: f64| {
        let power = |n: i32| sample.mean_of(|x| (k * relative(x)).exp() * relative(x).powi(n));
        let (zeroth, first, second) = (power(0), power(1), power(2));
        let centre = first / zeroth;
        (centre - 1.0 / k - mean, second / zeroth - centre * centre + 1.0 / (k * k))
    };
    // The function rises with k.
    let shape = if equation(MOST_SHAPE).0 < 0.0 { MOST_SHAPE } else { positive_root(start, equation)? };
    Ok([shape, most * (sample.mean_of(|x| (shape * relative(x)).exp()).ln() / shape).exp()])
}

pub(super) fn draw(by: &mut impl Rng, [k, c]: [f64; 2]) -> f64 {
    let standard: f64 = Exp1.sample(by);
    c * standard.powf(1.0 / k)
}

/// γ (1 − 1/k) + ln (c/k) + 1
pub(super) fn entropy([shape, scale]: [f64; 2]) -> f64 {
    std::f64::consts::EULER_GAMMA * (1.0 - 1.0 / shape) + scale.ln() - shape.ln() + 1.0
}

/// c ((k − 1) / k)^(1/k); 0 if k is at most 1
pub(super) fn mode([shape, scale]: [f64; 2]) -> Option<f64> {
    Some(scale * ((shape - 1.0).max(0.0) / shape).powf(1.0 / shape))
}
