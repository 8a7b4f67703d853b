//! Geometric law with probability p: the number of failures before the first success.
//!
//! P(x) = p (1 − p)ˣ for x = 0, 1, 2, …,  F(x) = 1 − (1 − p)^(⌊x⌋+1),  E = (1 − p)/p,  Var = (1 − p)/p².

use super::{Arithmetic, Constraint, Refusal, Sample, Support, fit::NOT_NEGATIVE, saddle};
use rand::Rng;
use rand_distr::{Distribution, Exp1};

pub(super) const NAME: &str = "geometric";
pub(super) const PARAMETERS: [(&str, Constraint); 1] = [("probability", Constraint::PositiveProbability)];
pub(super) const SUPPORT: Support = Support::Counts;

pub(super) fn ln_density<A: Arithmetic>(by: &mut A, x: A::Number, [p]: [A::Number; 1]) -> A::Number {
    let (ln_p, ln_failure) = (by.ln(p), saddle::ln_complement(by, p));
    let failures = saddle::times(by, x, ln_failure);
    let value = by.add(ln_p, failures);
    let inside = by.is_count(x);
    by.within(inside, value)
}

pub(super) fn tails(x: f64, [p]: [f64; 1]) -> (f64, f64) {
    if x < 0.0 {
        return (0.0, 1.0);
    }
    let exponent = (x.floor() + 1.0) * pxfm::f_log1p(-p);
    (-pxfm::f_expm1(exponent), pxfm::f_exp(exponent))
}

pub(super) fn mean([p]: [f64; 1]) -> f64 {
    (1.0 - p) / p
}

pub(super) fn variance([p]: [f64; 1]) -> f64 {
    (1.0 - p) / (p * p)
}

/// p = 1 / (1 + mean of x)
pub(super) fn fit(sample: &Sample, _: &[f64]) -> Result<[f64; 1], Refusal> {
    match sample.ends().0 >= 0.0 {
        true => Ok([1.0 / (1.0 + sample.mean_of(|x| x))]),
        false => Err(NOT_NEGATIVE),
    }
}

/// ⌊E / −ln(1 − p)⌋ where E is exponential with rate 1.
pub(super) fn draw(by: &mut impl Rng, [p]: [f64; 1]) -> f64 {
    let standard: f64 = Exp1.sample(by);
    (standard / -(-p).ln_1p()).floor()
}

pub(super) fn entropy(parameters: [f64; 1]) -> f64 {
    super::counts::entropy(super::Law::Geometric, &parameters)
}

pub(super) fn mode(_: [f64; 1]) -> Option<f64> {
    Some(0.0)
}
