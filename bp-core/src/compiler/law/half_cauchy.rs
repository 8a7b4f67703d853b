//! Half-Cauchy law with scale s: the absolute value of a Cauchy variable around 0.
//!
//! f(x) = 2 / (π s (1 + (x/s)²)) for x ≥ 0,  F(x) = 2 arctan(x/s)/π. Its mean is infinite.

use super::{
    Arithmetic, Constraint, Refusal, Sample, Support, cauchy,
    fit::{NOT_NEGATIVE, positive_root},
    half,
};
use rand::Rng;
use std::f64::consts::FRAC_2_PI;

pub(super) const NAME: &str = "half_cauchy";
pub(super) const PARAMETERS: [(&str, Constraint); 1] = [("scale", Constraint::Positive)];
pub(super) const SUPPORT: Support = Support::Positive;

pub(super) fn ln_density<A: Arithmetic>(by: &mut A, x: A::Number, [s]: [A::Number; 1]) -> A::Number {
    half::ln_density(by, x, cauchy::ln_density, s)
}

pub(super) fn mass<A: Arithmetic>(
    by: &mut A,
    low: A::Number,
    high: A::Number,
    [s]: [A::Number; 1],
) -> Option<A::Number> {
    half::mass(by, [low, high], cauchy::mass, s)
}

pub(super) fn tails(x: f64, [s]: [f64; 1]) -> (f64, f64) {
    if x <= 0.0 {
        return (0.0, 1.0);
    }
    let t = x / s;
    (FRAC_2_PI * pxfm::f_atan2(t, 1.0), FRAC_2_PI * pxfm::f_atan2(1.0, t))
}

pub(super) fn mean(_: [f64; 1]) -> f64 {
    f64::INFINITY
}

/// It is undefined: NaN.
pub(super) fn variance(_: [f64; 1]) -> f64 {
    f64::NAN
}

/// mean of s²/(s² + x²) = ½, whose left side rises with s. There is a maximum if less than half of the values are 0.
pub(super) fn fit(sample: &Sample, _: &[f64]) -> Result<[f64; 1], Refusal> {
    let (least, most) = sample.ends();
    if least < 0.0 || most <= 0.0 {
        return Err(NOT_NEGATIVE);
    }
    if sample.mean_of(|x| if x == 0.0 { 1.0 } else { 0.0 }) >= 0.5 {
        return Err("needs values more than half of which are greater than 0");
    }
    // Relative to the median of the positive values, which is of the order of the scale.
    let start = sample.map(|x| if x > 0.0 { x } else { f64::MIN_POSITIVE }).median();
    let share = |s: f64, x: f64| {
        let t = x / s;
        1.0 / (1.0 + t * t)
    };
    let scale = positive_root(1.0, |s| {
        let part = |x: f64| share(s, x / start);
        let slope = sample.mean_of(|x| 2.0 * part(x) * (1.0 - part(x)) / s);
        (sample.mean_of(part) - 0.5, slope)
    })?;
    Ok([scale * start])
}

pub(super) fn draw(by: &mut impl Rng, [s]: [f64; 1]) -> f64 {
    cauchy::draw(by, [0.0, s]).abs()
}

/// ln 2πs
pub(super) fn entropy([scale]: [f64; 1]) -> f64 {
    (std::f64::consts::TAU * scale).ln()
}

pub(super) fn mode(_: [f64; 1]) -> Option<f64> {
    Some(0.0)
}
