//! Von Mises law with mean m (rad) and concentration κ: an angle around a mean, the normal law of the circle.
//!
//! f(x) = exp(κ cos(x − m)) / (2π I₀(κ)) on any turn;  E = m, and the variance is 1 − I₁(κ)/I₀(κ), which on a circle
//! stands for it (Mardia and Jupp, *Directional Statistics*, 2000). F counts from m − π.

use super::{Arithmetic, Constraint, Support};
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

pub(super) fn mass<A: Arithmetic>(
    _: &mut A,
    _: A::Number,
    _: A::Number,
    _: [A::Number; 2],
) -> Option<A::Number> {
    None
}

/// By Simpson's rule on 2 000 steps.
pub(super) fn cumulative(x: f64, [m, k]: [f64; 2]) -> f64 {
    let to = (x - m).clamp(-PI, PI);
    let steps = 2000;
    let (width, total) = ((to + PI) / f64::from(steps), TAU.ln() + ln_bessel(k));
    let density = |t: f64| (k * t.cos() - total).exp();
    let sum: f64 = (0..=steps)
        .map(|step| {
            let weight = if step == 0 || step == steps { 1.0 } else { f64::from(2 + 2 * (step % 2)) };
            weight * density(-PI + width * f64::from(step))
        })
        .sum();
    (sum * width / 3.0).clamp(0.0, 1.0)
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
