//! Beta law with a and b: a proportion, after a − 1 successes and b − 1 failures.
//!
//! f(x) = x^(a−1) (1−x)^(b−1) Γ(a+b) / (Γ(a) Γ(b)) for 0 < x < 1,  F(x) = I_x(a, b),
//! E = a/(a+b),  Var = ab / ((a+b)² (a+b+1)).

use super::{
    Arithmetic, Constraint, Refusal, Sample, Support,
    fit::{MOST_SHAPE, NO_CONVERGENCE, TOO_EQUAL, ln_less_digamma, trigamma},
    saddle,
};
use crate::operators::{Binary, Mass, Unary};
use crate::special::stirling_rest;
use rand::Rng;
use rand_distr::Distribution;

pub(super) const NAME: &str = "beta";
pub(super) const PARAMETERS: [(&str, Constraint); 2] =
    [("a", Constraint::Positive), ("b", Constraint::Positive)];
pub(super) const SUPPORT: Support = Support::UnitInterval;

/// Where a + b is larger, the saddle-point form √(ab/2πn) exp(δ(n) − δ(a) − δ(b) − D(a, n x) − D(b, n (1 − x))) / (x (1 − x)).
const FEW: f64 = 16.0;

pub(super) fn ln_density<A: Arithmetic>(by: &mut A, x: A::Number, [a, b]: [A::Number; 2]) -> A::Number {
    let (zero, one) = (by.constant(0.0), by.constant(1.0));
    let (sum, rest) = (by.add(a, b), by.subtract(one, x));
    let (less_a, less_b) = (by.subtract(a, one), by.subtract(b, one));
    let (first, second) = (by.times_ln(less_a, x), by.times_ln(less_b, rest));
    let value = by.add(first, second);
    let ln_gamma = by.unary(Unary::LnGamma, sum);
    let value = by.add(value, ln_gamma);
    let (ln_a, ln_b) = (by.unary(Unary::LnGamma, a), by.unary(Unary::LnGamma, b));
    let value = by.subtract(value, ln_a);
    let mut value = by.subtract(value, ln_b);
    if !(saddle::is_known_below(by, a, FEW) && saddle::is_known_below(by, b, FEW)) {
        let (few, half, turn) = (by.constant(FEW), by.constant(0.5), by.constant(std::f64::consts::TAU));
        let (share, part) = (by.divide(a, sum), by.divide(b, turn));
        let [ln_share, ln_part, ln_x, ln_rest] = [share, part, x, rest].map(|number| by.ln(number));
        let ln_area = by.add(ln_share, ln_part);
        let mut large = by.multiply(half, ln_area);
        let of_sum = saddle::stirling_rest(by, sum);
        large = by.add(large, of_sum);
        for (parameter, number, ln) in [(a, x, ln_x), (b, rest, ln_rest)] {
            let (mean, own) = (by.multiply(sum, number), saddle::stirling_rest(by, parameter));
            let deviance = saddle::deviance(by, parameter, mean);
            for term in [own, deviance, ln] {
                large = by.subtract(large, term);
            }
        }
        let is_large = by.greater(sum, few);
        value = by.select(is_large, large, value);
    }
    let (above, below) = (by.greater(x, zero), by.greater(one, x));
    let inside = by.binary(Binary::And, above, below);
    by.within(inside, value)
}

pub(super) fn mass<A: Arithmetic>(
    by: &mut A,
    low: A::Number,
    high: A::Number,
    [a, b]: [A::Number; 2],
) -> Option<A::Number> {
    let zero = by.constant(0.0);
    Some(by.mass(Mass::Beta, [low, high, a, b, zero]))
}

pub(super) fn tails(x: f64, [a, b]: [f64; 2]) -> (f64, f64) {
    crate::special::beta(a, b, x, 1.0 - x)
}

/// a / (a + b), where a + b may overflow.
pub(super) fn mean([a, b]: [f64; 2]) -> f64 {
    if a > b { 1.0 / (1.0 + b / a) } else { a / b / (1.0 + a / b) }
}

/// a/n · b/n / (n + 1), n = a + b: no product overflows.
pub(super) fn variance([a, b]: [f64; 2]) -> f64 {
    0.5 * mean([a, b]) * mean([b, a]) / (0.5 * a + 0.5 * b + 0.5)
}

/// ψ(a) − ψ(a + b) = E[ln x] and ψ(b) − ψ(a + b) = E[ln(1 − x)], by Newton's method from the a and b that have the
/// sample's mean and variance. Both are taken relative to the mean, so that nothing cancels where a and b are large. Where
/// a + b would be more than [`MOST_SHAPE`], it is that, and a / (a + b) the mean.
pub(super) fn fit(sample: &Sample, _: &[f64]) -> Result<[f64; 2], Refusal> {
    let (least, most) = sample.ends();
    if least <= 0.0 || most >= 1.0 {
        return Err("needs values between 0 and 1, both left out");
    }
    let mean = sample.mean_of(|x| x);
    let variance = sample.mean_of(|x| (x - mean) * (x - mean));
    if variance <= 1e-28 {
        return Err(TOO_EQUAL);
    }
    // ln(x / mean), and ln((1 − x) / (1 − mean)).
    let of_mean = |x: f64| if x > 0.5 * mean { ((x - mean) / mean).ln_1p() } else { x.ln() - mean.ln() };
    let of_rest = |x: f64| match 1.0 - x > 0.5 * (1.0 - mean) {
        true => ((mean - x) / (1.0 - mean)).ln_1p(),
        false => (-x).ln_1p() - (-mean).ln_1p(),
    };
    let (first, second) = (sample.mean_of(of_mean), sample.mean_of(of_rest));
    let strength = (mean * (1.0 - mean) / variance - 1.0).max(1e-3);
    let held = [mean * MOST_SHAPE, (1.0 - mean) * MOST_SHAPE];
    if strength > 2.0 * MOST_SHAPE {
        return Ok(held);
    }
    let (mut a, mut b) = (mean * strength, (1.0 - mean) * strength);
    for step in 0..500 {
        let (whole, _) = ln_less_digamma(a + b);
        // ψ(x) − ψ(a + b) = ln(x / (a + b)) − (ln x − ψ(x)) + (ln(a + b) − ψ(a + b))
        let share = a / (a + b);
        let slope_a = first - of_mean(share) + ln_less_digamma(a).0 - whole;
        let slope_b = second - of_rest(share) + ln_less_digamma(b).0 - whole;
        // The Hessian is [z − ψ′(a), z; z, z − ψ′(b)] with z = ψ′(a + b); it is negative definite.
        let bend = trigamma(a + b);
        let (bend_a, bend_b) = (bend - trigamma(a), bend - trigamma(b));
        let determinant = bend_a * bend_b - bend * bend;
        let next_a = a - (bend_b * slope_a - bend * slope_b) / determinant;
        let next_b = b - (bend_a * slope_b - bend * slope_a) / determinant;
        let (next_a, next_b) = (next_a.clamp(0.5 * a, 2.0 * a), next_b.clamp(0.5 * b, 2.0 * b));
        let moved = ((next_a - a) / a).abs().max(((next_b - b) / b).abs());
        (a, b) = (next_a, next_b);
        // Rounding may make the last steps oscillate.
        if moved <= 1e-12 || (step > 50 && moved <= 1e-9) {
            return Ok(if a + b > MOST_SHAPE { held } else { [a, b] });
        }
    }
    Err(NO_CONVERGENCE)
}

pub(super) fn draw(by: &mut impl Rng, [a, b]: [f64; 2]) -> f64 {
    // No draw is 0 or 1, though rounding may make it so.
    let inside = |drawn: f64| drawn.clamp(f64::MIN_POSITIVE, 1.0 - f64::EPSILON / 2.0);
    rand_distr::Beta::new(a, b).map_or(f64::NAN, |law| inside(law.sample(by)))
}

/// ln B(a, b) − (a − 1) ψ(a) − (b − 1) ψ(b) + (n − 2) ψ(n), n = a + b, with ln Γ and ψ as their leading terms and rests:
/// ½ ln (2π ab/n³) + δ(a) + δ(b) − δ(n) + (a − 1) ρ(a) + (b − 1) ρ(b) − (n − 2) ρ(n), ρ(x) = ln x − ψ(x).
pub(super) fn entropy([a, b]: [f64; 2]) -> f64 {
    let n = (a + b).min(f64::MAX);
    let logarithms = std::f64::consts::TAU.ln() + mean([a, b]).ln() + mean([b, a]).ln() - n.ln();
    let rests = stirling_rest(a) + stirling_rest(b) - stirling_rest(n);
    0.5 * logarithms + rests + (a - 1.0) * ln_less_digamma(a).0 + (b - 1.0) * ln_less_digamma(b).0
        - (n - 2.0) * ln_less_digamma(n).0
}

/// (a − 1) / (a + b − 2); at an end if a or b is at most 1. None where both ends, or all values, have the largest density.
pub(super) fn mode([a, b]: [f64; 2]) -> Option<f64> {
    match (a > 1.0, b > 1.0) {
        (true, true) => Some(mean([a - 1.0, b - 1.0])),
        (false, false) if a < 1.0 && b < 1.0 || a == b => None,
        _ => Some(f64::from(u8::from(a > b))),
    }
}
