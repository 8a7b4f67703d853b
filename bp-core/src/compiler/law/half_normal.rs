//! Half-normal law with scale s: the absolute value of a normal variable around 0.
//!
//! f(x) = 2 N(x; 0, s) for x ≥ 0,  F(x) = 2 Φ(x/s) − 1,  E = s √(2/π),  Var = s² (1 − 2/π).

use super::{Arithmetic, Constraint, Refusal, Sample, Support, fit::NOT_NEGATIVE, half, normal};
use rand::Rng;
use std::f64::consts::FRAC_2_PI;

pub(super) const NAME: &str = "half_normal";
pub(super) const PARAMETERS: [(&str, Constraint); 1] = [("scale", Constraint::Positive)];
pub(super) const SUPPORT: Support = Support::Positive;

pub(super) fn ln_density<A: Arithmetic>(by: &mut A, x: A::Number, [s]: [A::Number; 1]) -> A::Number {
    half::ln_density(by, x, normal::ln_density, s)
}

pub(super) fn mass<A: Arithmetic>(
    by: &mut A,
    low: A::Number,
    high: A::Number,
    [s]: [A::Number; 1],
) -> Option<A::Number> {
    half::mass(by, [low, high], normal::mass, s)
}

/// 1 − 2 (1 − Φ(z)) = P(½, z²/2), which has digits near 0.
pub(super) fn tails(x: f64, [s]: [f64; 1]) -> (f64, f64) {
    if x <= 0.0 {
        return (0.0, 1.0);
    }
    let z = x / s;
    (crate::special::gamma(0.5, 0.5 * z * z).0, 2.0 * normal::tails(z, [0.0, 1.0]).1)
}

pub(super) fn mean([s]: [f64; 1]) -> f64 {
    s * FRAC_2_PI.sqrt()
}

pub(super) fn variance([s]: [f64; 1]) -> f64 {
    s * s * (1.0 - FRAC_2_PI)
}

/// s² = mean of x²
pub(super) fn fit(sample: &Sample, _: &[f64]) -> Result<[f64; 1], Refusal> {
    let scale = sample.distance(0.0);
    if sample.ends().0 >= 0.0 && scale > 0.0 { Ok([scale]) } else { Err(NOT_NEGATIVE) }
}

pub(super) fn draw(by: &mut impl Rng, [s]: [f64; 1]) -> f64 {
    normal::draw(by, [0.0, s]).abs()
}

/// ½ ln (πe/2) + ln s
pub(super) fn entropy([scale]: [f64; 1]) -> f64 {
    super::normal::entropy([0.0, scale]) - std::f64::consts::LN_2
}

pub(super) fn mode(_: [f64; 1]) -> Option<f64> {
    Some(0.0)
}
