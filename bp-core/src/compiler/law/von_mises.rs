//! Von Mises law with mean m (rad) and concentration κ: an angle around a mean, the normal law of the circle.
//!
//! f(x) = exp(κ cos(x − m)) / (2π I₀(κ)) on any turn;  E = m, and the circular variance is 1 − I₁(κ)/I₀(κ) (Mardia and
//! Jupp, *Directional Statistics*, 2000). F counts from m − π.

use super::{
    Arithmetic, Constraint, Refusal, Sample, Support,
    fit::{MOST_SHAPE, TOO_EQUAL, positive_root},
};
use crate::operators::{Unary, ln_bessel};
use rand::{Rng, RngExt};
use std::f64::consts::{PI, TAU};

pub(super) const NAME: &str = "von_mises";
pub(super) const PARAMETERS: [(&str, Constraint); 2] =
    [("mean", Constraint::Real), ("concentration", Constraint::Positive)];
pub(super) const SUPPORT: Support = Support::Reals;

pub(super) fn ln_density<A: Arithmetic>(by: &mut A, x: A::Number, [m, k]: [A::Number; 2]) -> A::Number {
    let centred = by.subtract(x, m);
    let cosine = by.unary(Unary::Cosine, centred);
    let (value, ln_bessel) = (by.multiply(k, cosine), by.unary(Unary::LnBessel, k));
    let ln_turn = by.constant(TAU.ln());
    let value = by.subtract(value, ln_bessel);
    by.subtract(value, ln_turn)
}

pub(super) fn tails(x: f64, [m, k]: [f64; 2]) -> (f64, f64) {
    let t = (x - m).clamp(-PI, PI);
    let tail = lower_tail(-t.abs(), k).min(0.5);
    if t > 0.0 { (1.0 - tail, tail) } else { (tail, 1.0 - tail) }
}

/// ∫ exp(κ (cos u − 1)) du from −π to t ≤ 0, over 2π exp(−κ) I₀(κ). The integrand rises up to t: intervals that halve
/// towards t, each by Gauss–Legendre rules on halves until these agree.
fn lower_tail(t: f64, k: f64) -> f64 {
    let density = |u: f64| pxfm::f_exp(-2.0 * k * pxfm::f_sin(0.5 * u).powi(2));
    let (mut sum, mut from) = (0.0, -PI);
    for _ in 0..40 {
        let to = 0.5 * (from + t);
        sum += adaptive(&density, from, to, 12);
        from = to;
    }
    (sum + gauss_legendre(&density, from, t)) / (TAU * pxfm::f_i0e(k))
}

/// ∫ f from a to b, bisected until the halves agree with the whole to 10⁻¹¹: their own error is 2²⁰ times smaller.
fn adaptive(f: &impl Fn(f64) -> f64, a: f64, b: f64, depth: u32) -> f64 {
    let (middle, whole) = (0.5 * (a + b), gauss_legendre(f, a, b));
    let halves = gauss_legendre(f, a, middle) + gauss_legendre(f, middle, b);
    if depth == 0 || (halves - whole).abs() <= 1e-11 * halves.abs() {
        return halves;
    }
    adaptive(f, a, middle, depth - 1) + adaptive(f, middle, b, depth - 1)
}

/// Nodes and weights of the Gauss–Legendre rule of ten points (Abramowitz and Stegun, table 25.4).
const RULE: [(f64, f64); 5] = [
    (0.148_874_338_981_631_2, 0.295_524_224_714_752_87),
    (0.433_395_394_129_247_2, 0.269_266_719_309_996_35),
    (0.679_409_568_299_024_4, 0.219_086_362_515_982_04),
    (0.865_063_366_688_984_5, 0.149_451_349_150_580_6),
    (0.973_906_528_517_171_7, 0.066_671_344_308_688_14),
];

/// ∫ f from a to b, by ten points.
pub(super) fn gauss_legendre(f: &impl Fn(f64) -> f64, a: f64, b: f64) -> f64 {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    let both = |(node, weight): &(f64, f64)| weight * (f(middle - half * node) + f(middle + half * node));
    half * RULE.iter().map(both).sum::<f64>()
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
    let tau = 1.0 + (1.0 + 4.0 * k * k).sqrt();
    let rho = (tau - (2.0 * tau).sqrt()) / (2.0 * k);
    // For a large κ, ρ tends to 1 − 1/√κ, and so r to 1 + 1/(2κ).
    let r = if rho > 0.0 { (1.0 + rho * rho) / (2.0 * rho) } else { 1.0 + 0.5 / k };
    loop {
        let z = (PI * by.random::<f64>()).cos();
        let f = (1.0 + r * z) / (r + z);
        let c = k * (r - f);
        let u: f64 = 1.0 - by.random::<f64>();
        if c * (2.0 - c) > u || (c / u).ln() + 1.0 >= c {
            let angle = f.clamp(-1.0, 1.0).acos();
            return if by.random::<f64>() < 0.5 { m - angle } else { m + angle };
        }
    }
}
