//! Von Mises law with mean m (rad) and concentration κ: an angle around a mean, the normal law of the circle.
//!
//! f(x) = exp(κ cos(x − m)) / (2π I₀(κ)) on any turn;  E = m, and the circular variance is 1 − I₁(κ)/I₀(κ) (Mardia and
//! Jupp, *Directional Statistics*, 2000). F counts from m − π.

use super::{
    Arithmetic, Constraint, Refusal, Sample, Support,
    fit::{MOST_SHAPE, TOO_EQUAL, positive_root},
};
use crate::operators::{Mass, Unary, ln_bessel};
use rand::{Rng, RngExt};
use std::f64::consts::{PI, TAU};

pub(super) const NAME: &str = "von_mises";
pub(super) const PARAMETERS: [(&str, Constraint); 2] =
    [("mean", Constraint::Real), ("concentration", Constraint::Positive)];
pub(super) const SUPPORT: Support = Support::Reals;

/// κ above which ln I₀(κ) − κ is computed by its series.
const LARGE: f64 = 100.0;

/// The largest κ with which angles are drawn: they differ from the mean by 1e-150.
const MOST_CONCENTRATED: f64 = 1e300;

/// −2κ sin²(½ (x − m)) − (ln I₀(κ) − κ) − ln 2π; of a large κ, I₀(κ) e^(−κ) √(2πκ) = 1 + 1/(8κ) + 9/(128κ²) + … (Abramowitz and
/// Stegun 9.7.1).
pub(super) fn ln_density<A: Arithmetic>(by: &mut A, x: A::Number, [m, k]: [A::Number; 2]) -> A::Number {
    let (half, two, one) = (by.constant(0.5), by.constant(2.0), by.constant(1.0));
    let centred = by.subtract(x, m);
    let angle = by.multiply(half, centred);
    let sine = by.unary(Unary::Sine, angle);
    let (square, twice) = (by.multiply(sine, sine), by.multiply(two, k));
    let fall = by.multiply(twice, square);
    let ln_bessel = by.unary(Unary::LnBessel, k);
    let exact = by.subtract(ln_bessel, k);
    let inverse = by.divide(one, k);
    let mut series = by.constant(0.572_501_420_974_731_4);
    for coefficient in
        [0.227_108_001_708_984_38, 0.112_152_099_609_375, 0.073_242_187_5, 0.070_312_5, 0.125, 1.0]
    {
        let (product, coefficient) = (by.multiply(series, inverse), by.constant(coefficient));
        series = by.add(product, coefficient);
    }
    let (ln_series, turn) = (by.ln(series), by.constant(TAU));
    let area = by.multiply(turn, k);
    let ln_area = by.ln(area);
    let root = by.multiply(half, ln_area);
    let far = by.subtract(ln_series, root);
    let large = by.constant(LARGE);
    let is_large = by.greater(k, large);
    let (rest, ln_turn) = (by.select(is_large, far, exact), by.constant(TAU.ln()));
    let value = by.add(fall, rest);
    let value = by.add(value, ln_turn);
    by.unary(Unary::Negate, value)
}

pub(super) fn mass<A: Arithmetic>(
    by: &mut A,
    low: A::Number,
    high: A::Number,
    [m, k]: [A::Number; 2],
) -> Option<A::Number> {
    let zero = by.constant(0.0);
    Some(by.mass(Mass::VonMises, [low, high, m, k, zero]))
}

pub(super) fn tails(x: f64, [m, k]: [f64; 2]) -> (f64, f64) {
    let t = (x - m).clamp(-PI, PI);
    let tail = Mass::VonMises.apply([t.abs(), PI, 0.0, k, 0.0]);
    if t > 0.0 { (1.0 - tail, tail) } else { (tail, 1.0 - tail) }
}

pub(super) fn mean([m, _]: [f64; 2]) -> f64 {
    m
}

/// 1 − I₁(κ)/I₀(κ), by the integral of cos t exp(κ cos t).
pub(super) fn variance([_, k]: [f64; 2]) -> f64 {
    let steps = 4000;
    let angles = (0..steps).map(|step| (f64::from(step) + 0.5) * PI / f64::from(steps));
    let sum: f64 = angles.map(|t| (1.0 - t.cos()) * (k * t.cos() - ln_bessel(k)).exp()).sum();
    sum / f64::from(steps)
}

/// m is the direction of E[(cos x, sin x)], and I₁(κ)/I₀(κ) its length R, by Newton's method from the start of Banerjee
/// and others, *Journal of Machine Learning Research* 6:1345-1382, 2005. κ is [`MOST_SHAPE`] at most.
pub(super) fn fit(sample: &Sample, _: &[f64]) -> Result<[f64; 2], Refusal> {
    let (cosine, sine) = (sample.mean_of(f64::cos), sample.mean_of(f64::sin));
    let length = cosine.hypot(sine);
    if length <= 1e-9 {
        return Err("needs angles that prefer a direction");
    }
    let mean = sine.atan2(cosine);
    // 1 − R = E[1 − cos(x − m)]: R itself has no digits left where it is near 1.
    let rest = sample.mean_of(|x| 2.0 * (0.5 * (x - mean)).sin().powi(2));
    if rest <= 1e-28 {
        return Err(TOO_EQUAL);
    }
    if rest <= bessel_ratio(MOST_SHAPE).1 {
        return Ok([mean, MOST_SHAPE]);
    }
    let start = length * (2.0 - length * length) / (rest * (1.0 + length));
    let concentration = positive_root(start, |k| {
        let (ratio, less, slope) = bessel_ratio(k);
        (if rest < 0.5 { rest - less } else { ratio - length }, slope)
    })?;
    Ok([mean, concentration])
}

/// A = I₁(κ)/I₀(κ), 1 − A and A′ = 1 − A² − A/κ: by the continued fraction 1/(2/κ + 1/(4/κ + …)) (Abramowitz and Stegun
/// 9.1.73), for large κ by the series.
fn bessel_ratio(k: f64) -> (f64, f64, f64) {
    if k > 1e3 {
        let u = 1.0 / k;
        let less = u * (0.5 + u * (0.125 + u * (0.125 + u * (25.0 / 128.0 + u * 13.0 / 32.0))));
        let slope = u * u * (0.5 + u * (0.25 + u * (0.375 + u * (25.0 / 32.0 + u * 65.0 / 32.0))));
        return (1.0 - less, less, slope);
    }
    let ratio = (1..=(k as u32 + 60)).rev().fold(0.0, |rest, n| 1.0 / (f64::from(2 * n) / k + rest));
    (ratio, 1.0 - ratio, 1.0 - ratio * ratio - ratio / k)
}

/// Best and Fisher, *Applied Statistics* 28:152-157, 1979; the result lies in ]m − π, m + π].
pub(super) fn draw(by: &mut impl Rng, [m, k]: [f64; 2]) -> f64 {
    if k < 1e-6 {
        return m + PI * (2.0 * by.random::<f64>() - 1.0);
    }
    // r − 1 and what is computed from it, so that nothing cancels where κ is large: with ρ of Best and Fisher,
    // r − 1 = (1 − ρ)² / 2ρ, κ (r − f) = κ (r² − 1) / (r + z), and 1 − f = (r − 1) (1 − z) / (r + z).
    let k = k.min(MOST_CONCENTRATED);
    let root = 1f64.hypot(2.0 * k);
    let less = ((2.0 * (1.0 + root)).sqrt() - 1.0 - 1.0 / (root + 2.0 * k)) / (2.0 * k);
    let rest = 0.5 * less * less / (1.0 - less);
    loop {
        let (sine, cosine) = (0.5 * PI * by.random::<f64>()).sin_cos();
        let sum = 2.0 * cosine * cosine + rest;
        let c = k * rest * (2.0 + rest) / sum;
        let u: f64 = 1.0 - by.random::<f64>();
        if c * (2.0 - c) > u || (c / u).ln() + 1.0 >= c {
            let angle = 2.0 * ((rest / sum).sqrt() * sine).min(1.0).asin();
            return if by.random::<f64>() < 0.5 { m - angle } else { m + angle };
        }
    }
}

/// ln 2πI₀(κ) − κ I₁(κ)/I₀(κ) = κ (1 − I₁/I₀) − ln of the largest density.
pub(super) fn entropy([mean, k]: [f64; 2]) -> f64 {
    // E[1 − cos(x − m)] by quadrature over the part of the turn that has density; of a large κ it is 1/(2κ) + 1/(8κ²) + 1/(8κ³) + …
    let away = if k > 1e4 { (0.5 + (0.125 + 0.125 / k) / k) / k } else { variance([mean, k]) };
    k * away - ln_density(&mut super::Numbers, mean, [mean, k])
}

pub(super) fn mode([mean, _]: [f64; 2]) -> Option<f64> {
    Some(mean)
}
