//! Special functions, in f64.
//!
//! In: numbers. Out: a number. Invariant: a small value is never computed as the difference of large ones: each tail
//! has its own formula. Functions that use only `pxfm` and the four operations give the same bits on every machine.
//! Errors are tested against 50 digits (`tests/laws/special_functions`).

mod beta;
mod gamma;
mod interval;
mod stirling;

pub use beta::beta;
pub use gamma::gamma;
pub use interval::{Mass, OPERANDS, gauss_legendre};
pub use stirling::{deviance, ln_factorial_rest, ln_rising, stirling_rest};

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_2_SQRT_PI};

/// 1/√2 less the nearest f64.
const FRAC_1_SQRT_2_REST: f64 = -4.833_646_656_726_457e-17;

/// Φ(x) = ½ erfc(−x/√2), the cumulative distribution of the standard normal law, accurate in both tails.
pub fn normal_cumulative(x: f64) -> f64 {
    let z = -x * FRAC_1_SQRT_2;
    let value = 0.5 * pxfm::f_erfc(z);
    if !(z > 1.0 && z < 27.5) {
        return value;
    }
    // In the far tail a change of z by one unit changes erfc by 2 z² units: this corrects the rounding error of z.
    // erfc′(z) = −2/√π e^(−z²).
    let rest = (-x).mul_add(FRAC_1_SQRT_2, -z) - x * FRAC_1_SQRT_2_REST;
    value - 0.5 * FRAC_2_SQRT_PI * pxfm::f_exp(-z * z) * rest
}

/// ln Γ(x), for x > 0; +∞ at 0.
pub fn ln_gamma(x: f64) -> f64 {
    if x == 0.0 { f64::INFINITY } else { pxfm::f_lgamma(x) }
}

/// ln I₀(x), the modified Bessel function of order 0: near 0 by I₀(x) − 1 = Σ (x/2)²ᵏ / (k!)² (Abramowitz and Stegun
/// 9.6.12), which keeps its digits there.
pub fn ln_bessel(x: f64) -> f64 {
    let x = x.abs();
    if x > 2.0 {
        return x + pxfm::f_log(pxfm::f_i0e(x));
    }
    let square = 0.25 * x * x;
    let (mut term, mut sum) = (1.0, 0.0);
    for k in 1..20 {
        term *= square / f64::from(k * k);
        sum += term;
    }
    pxfm::f_log1p(sum)
}
