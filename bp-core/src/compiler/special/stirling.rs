//! Terms of densities, computed without cancellation.
//!
//! In: positive numbers. Out: the remainder of Stirling's formula for ln Γ, and the deviance of a count from its mean.
//! Source: C. Loader, *Fast and accurate computation of binomial probabilities*, 2000.

use super::ln_gamma;
use std::f64::consts::TAU;

/// δ(x) = ln Γ(x) − ((x − ½) ln x − x + ½ ln 2π); from x = 16 on by its series (Abramowitz and Stegun 6.1.41).
pub fn stirling_rest(x: f64) -> f64 {
    if x < 16.0 {
        return ln_gamma(x) - ((x - 0.5) * pxfm::f_log(x) - x + 0.5 * pxfm::f_log(TAU));
    }
    let square = 1.0 / (x * x);
    let series = [-691.0 / 360_360.0, 1.0 / 1188.0, -1.0 / 1680.0, 1.0 / 1260.0, -1.0 / 360.0, 1.0 / 12.0];
    series.iter().fold(0.0, |sum, coefficient| sum * square + coefficient) / x
}

/// ln (Γ(a + s) / Γ(a)), for a > 0 and s ≥ 0: without the difference of two large logarithms where a is large.
pub fn ln_rising(a: f64, s: f64) -> f64 {
    if s == 0.0 {
        return 0.0;
    }
    if a < 16.0 {
        return ln_gamma(a + s) - ln_gamma(a);
    }
    let rests = stirling_rest(a + s) - stirling_rest(a);
    (a - 0.5) * pxfm::f_log1p(s / a) + s * (pxfm::f_log(a + s) - 1.0) + rests
}

/// ln k! − (k ln k − k) for a count k, 0 at 0.
pub fn ln_factorial_rest(k: f64) -> f64 {
    if k == 0.0 { 0.0 } else { 0.5 * pxfm::f_log(TAU * k) + stirling_rest(k) }
}

/// D₀(k, m) = k ln(k/m) + m − k, for k ≥ 0 and m > 0; by the series of artanh where k and m are close.
pub fn deviance(k: f64, m: f64) -> f64 {
    if k == 0.0 {
        return m;
    }
    if (k - m).abs() >= 0.1 * (k + m) {
        return k * pxfm::f_log(k / m) + m - k;
    }
    let v = (k - m) / (k + m);
    let mut sum = (k - m) * v;
    let mut term = 2.0 * k * v;
    for j in 1..1000 {
        term *= v * v;
        let next = sum + term / f64::from(2 * j + 1);
        if next == sum {
            break;
        }
        sum = next;
    }
    sum
}

/// A continued fraction b₀ + a₁/(b₁ + a₂/(b₂ + …)) whose first term is 1, by Lentz's method (Thompson and Barnett,
/// *Journal of Computational Physics* 64:490, 1986). `part` gives aⱼ and bⱼ.
pub(super) fn fraction(part: impl Fn(f64) -> (f64, f64)) -> f64 {
    const LEAST: f64 = 1e-300;
    const MOST_STEPS: u32 = 200_000;
    let kept = |value: f64| if value.abs() < LEAST { LEAST } else { value };
    let (mut c, mut d, mut value) = (1.0, 0.0, 1.0);
    for step in 1..=MOST_STEPS {
        let (a, b) = part(f64::from(step));
        d = 1.0 / kept(b + a * d);
        c = kept(b + a / c);
        let change = c * d;
        value *= change;
        if (change - 1.0).abs() <= f64::EPSILON && step > 1 {
            break;
        }
    }
    value
}
