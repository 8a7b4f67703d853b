//! Gamma law with shape k and rate r: the waiting time for the k-th event.
//!
//! f(x) = rᵏ x^(k−1) exp(−r x) / Γ(k) for x > 0,  F(x) = P(k, r x),  E = k/r,  Var = k/r².

use super::{
    Arithmetic, Constraint, Refusal, Sample, Support,
    fit::{MOST_SHAPE, NOT_POSITIVE, TOO_EQUAL, ln_less_digamma, positive_root},
    saddle,
};
use crate::operators::{Mass, Unary};
use crate::special::stirling_rest;
use rand::Rng;
use rand_distr::Distribution;

pub(super) const NAME: &str = "gamma";
pub(super) const PARAMETERS: [(&str, Constraint); 2] =
    [("shape", Constraint::Positive), ("rate", Constraint::Positive)];
pub(super) const SUPPORT: Support = Support::Positive;

/// Above, the saddle-point form √(k/2π) exp(−D(k, r x) − δ(k)) / x.
const FEW: f64 = 16.0;

pub(super) fn ln_density<A: Arithmetic>(by: &mut A, x: A::Number, [k, rate]: [A::Number; 2]) -> A::Number {
    let (zero, one) = (by.constant(0.0), by.constant(1.0));
    let (ln_rate, less, ln_gamma) = (by.ln(rate), by.subtract(k, one), by.unary(Unary::LnGamma, k));
    let constant = by.multiply(k, ln_rate);
    let constant = by.subtract(constant, ln_gamma);
    let (power, decay) = (by.times_ln(less, x), by.multiply(rate, x));
    let value = by.subtract(power, decay);
    let mut value = by.add(value, constant);
    if !saddle::is_known_below(by, k, FEW) {
        let (few, half, turn) = (by.constant(FEW), by.constant(0.5), by.constant(std::f64::consts::TAU));
        let share = by.divide(k, turn);
        let (ln_share, ln_x) = (by.ln(share), by.ln(x));
        let root = by.multiply(half, ln_share);
        let (rest, deviance) = (saddle::stirling_rest(by, k), saddle::deviance(by, k, decay));
        let large = by.subtract(root, deviance);
        let large = by.subtract(large, rest);
        let large = by.subtract(large, ln_x);
        let is_large = by.greater(k, few);
        value = by.select(is_large, large, value);
    }
    let inside = by.greater(x, zero);
    by.within(inside, value)
}

pub(super) fn mass<A: Arithmetic>(
    by: &mut A,
    low: A::Number,
    high: A::Number,
    [k, rate]: [A::Number; 2],
) -> Option<A::Number> {
    let zero = by.constant(0.0);
    Some(by.mass(Mass::Gamma, [low, high, k, rate, zero]))
}

pub(super) fn tails(x: f64, [k, rate]: [f64; 2]) -> (f64, f64) {
    crate::special::gamma(k, rate * x)
}

pub(super) fn mean([k, rate]: [f64; 2]) -> f64 {
    k / rate
}

pub(super) fn variance([k, rate]: [f64; 2]) -> f64 {
    k / rate / rate
}

/// ln k − ψ(k) = ln E[x] − E[ln x] by Newton's method, then r = k / E[x]; start of Minka, *Estimating a Gamma
/// distribution*, 2002. k is [`MOST_SHAPE`] at most.
pub(super) fn fit(sample: &Sample, _: &[f64]) -> Result<[f64; 2], Refusal> {
    let (least, most) = sample.ends();
    if least <= 0.0 {
        return Err(NOT_POSITIVE);
    }
    // Relative to the largest, so that no sum overflows.
    let mean = sample.mean_of(|x| x / most);
    // E of ln(x / E[x]), which is 0 only where all are equal (Jensen). ln(1 + d) − d, whose mean it is too, cancels less.
    let spread = -sample.mean_of(|x| {
        let off = (x / most - mean) / mean;
        if off.abs() < 0.5 { off.ln_1p() - off } else { x.ln() - most.ln() - mean.ln() - off }
    });
    if spread <= 1e-28 {
        return Err(TOO_EQUAL);
    }
    let start = (3.0 - spread + ((spread - 3.0).powi(2) + 24.0 * spread).sqrt()) / (12.0 * spread);
    let shape = match ln_less_digamma(MOST_SHAPE).0 < spread {
        true => positive_root(start, |k| {
            let (value, slope) = ln_less_digamma(k);
            (value - spread, slope)
        })?,
        false => MOST_SHAPE,
    };
    Ok([shape, shape / mean / most])
}

pub(super) fn draw(by: &mut impl Rng, [k, rate]: [f64; 2]) -> f64 {
    // A draw of a small shape may underflow; a rate or a scale of 0 would be no number that a form accepts.
    rand_distr::Gamma::new(k, 1.0 / rate).map_or(f64::NAN, |law| law.sample(by).max(f64::MIN_POSITIVE))
}

/// k − ln r + ln Γ(k) + (1 − k) ψ(k), with ln Γ and ψ as their leading terms and rests, whose large parts cancel:
/// ½ ln 2πk + δ(k) + (k − 1) (ln k − ψ(k)) − ln r.
pub(super) fn entropy([shape, rate]: [f64; 2]) -> f64 {
    0.5 * (std::f64::consts::TAU * shape).ln()
        + stirling_rest(shape)
        + (shape - 1.0) * ln_less_digamma(shape).0
        - rate.ln()
}

/// (k − 1) / r, 0 at least
pub(super) fn mode([shape, rate]: [f64; 2]) -> Option<f64> {
    Some((shape - 1.0).max(0.0) / rate)
}
