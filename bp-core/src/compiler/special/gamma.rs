//! The regularised incomplete gamma functions.
//!
//! In: a > 0 and x. Out: P(a, x) and Q(a, x) = 1 − P(a, x). Invariant: the smaller of the two is computed, and the
//! other is 1 less it.
//!
//! With D = xᵃ e⁻ˣ / Γ(a + 1) = exp(−D₀(a, x) − δ(a)) / √(2πa):
//! P = D (1 + x/(a + 1) + x²/((a + 1)(a + 2)) + …) below the mean (Abramowitz and Stegun 6.5.29),
//! Q = D a / (x + 1 − a − 1 (1 − a)/(x + 3 − a − 2 (2 − a)/(x + 5 − a − …))) above it (6.5.31).

use super::Mass;
use super::stirling::{deviance, fraction, stirling_rest};
use std::f64::consts::TAU;

/// a above which the density is integrated: the series would need more terms than √a.
const FAR: f64 = 1e7;

/// Limit of the terms of the series.
const MOST_TERMS: u32 = 200_000;

/// P(a, x) and Q(a, x).
pub fn gamma(a: f64, x: f64) -> (f64, f64) {
    if x <= 0.0 {
        return (0.0, 1.0);
    }
    if x == f64::INFINITY {
        return (1.0, 0.0);
    }
    if a > FAR {
        let mass = |low: f64, high: f64| Mass::Gamma.apply([low, high, a, 1.0, 0.0]).min(1.0);
        return (mass(0.0, x), mass(x, f64::INFINITY));
    }
    let front = pxfm::f_exp(-deviance(a, x) - stirling_rest(a)) / (TAU * a).sqrt();
    if x < a + 1.0 {
        let (mut term, mut sum) = (1.0, 1.0);
        for step in 1..=MOST_TERMS {
            term *= x / (a + f64::from(step));
            sum += term;
            if term <= f64::EPSILON * 0.1 * sum {
                break;
            }
        }
        let lower = (front * sum).min(1.0);
        (lower, 1.0 - lower)
    } else {
        let first = x + 1.0 - a;
        let rest = fraction(|j| (-j * (j - a) / if j == 1.0 { first } else { 1.0 }, x + 2.0 * j + 1.0 - a));
        let upper = (front * a / (first * rest)).min(1.0);
        (1.0 - upper, upper)
    }
}
