//! The regularised incomplete beta function.
//!
//! In: a and b > 0, x, and y = 1 − x. Out: I_x(a, b), and 1 − I_x(a, b). Invariant: the smaller of the two is computed,
//! and the other is 1 less it.
//!
//! I_x(a, b) = D/a · 1/(1 + d₁/(1 + d₂/(1 + …))) for x below the mean, with D = xᵃ yᵇ / B(a, b),
//! d₂ₘ₊₁ = −(a + m)(a + b + m) x / ((a + 2m)(a + 2m + 1)), d₂ₘ = m (b − m) x / ((a + 2m − 1)(a + 2m))
//! (Abramowitz and Stegun 26.5.8). D after Loader (*Fast and accurate computation of binomial probabilities*, 2000):
//! √(ab / 2πn) exp(δ(n) − δ(a) − δ(b) − D₀(a, nx) − D₀(b, ny)), n = a + b, δ the remainder of Stirling's formula and
//! D₀(k, m) = k ln(k/m) + m − k: no large terms cancel.

use super::Mass;
use super::stirling::{self, deviance, stirling_rest};
use std::f64::consts::TAU;

/// a and b above which the density is integrated: the fraction would need more steps than its limit.
const FAR: f64 = 1e7;

/// The largest a and b that are distinguished: a law with larger ones has all its probability at one f64.
const LARGEST: f64 = 1e300;

/// I_x(a, b) and 1 − I_x(a, b).
pub fn beta(a: f64, b: f64, x: f64, y: f64) -> (f64, f64) {
    if x <= 0.0 {
        return (0.0, 1.0);
    }
    if y <= 0.0 {
        return (1.0, 0.0);
    }
    let scale = (LARGEST / a.max(b)).min(1.0);
    let (a, b) = (a * scale, b * scale);
    if a.max(b) > FAR {
        // Of x and y, the smaller one has all its digits.
        let mass = |[low, high, a, b]: [f64; 4]| Mass::Beta.apply([low, high, a, b, 0.0]).min(1.0);
        return match x <= y {
            true => (mass([0.0, x, a, b]), mass([x, 1.0, a, b])),
            false => (mass([y, 1.0, b, a]), mass([0.0, y, b, a])),
        };
    }
    // Below the mean the fraction converges in about √max(a, b) steps.
    if x * (a + b + 2.0) < a + 1.0 {
        let lower = (front(a, b, x, y) * fraction(a, b, x) / a).min(1.0);
        (lower, 1.0 - lower)
    } else {
        let upper = (front(b, a, y, x) * fraction(b, a, y) / b).min(1.0);
        (1.0 - upper, upper)
    }
}

/// xᵃ yᵇ / B(a, b)
fn front(a: f64, b: f64, x: f64, y: f64) -> f64 {
    let (factor, exponent) = ln_front(a, b, x, y);
    factor * pxfm::f_exp(exponent)
}

/// xᵃ yᵇ / B(a, b), as a factor and an exponent.
pub(super) fn ln_front(a: f64, b: f64, x: f64, y: f64) -> (f64, f64) {
    let n = a + b;
    let exponent =
        stirling_rest(n) - stirling_rest(a) - stirling_rest(b) - deviance(a, n * x) - deviance(b, n * y);
    (((a / n) * (b / TAU)).sqrt(), exponent)
}

/// The reciprocal of 1 + d₁/(1 + d₂/(1 + …)).
fn fraction(a: f64, b: f64, x: f64) -> f64 {
    1.0 / stirling::fraction(|j| {
        let m = (0.5 * j).floor();
        let coefficient = match j % 2.0 == 0.0 {
            true => m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m)),
            false => -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0)),
        };
        (coefficient, 1.0)
    })
}
