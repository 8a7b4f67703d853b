//! Negative binomial law with r successes and probability p: the number of failures before the r-th success; r need not be whole.
//! It is a Poisson law whose rate has the law gamma(r, p/(1 − p)).
//!
//! P(x) = Γ(x+r) / (x! Γ(r)) pʳ (1 − p)ˣ for x = 0, 1, 2, …,  F(x) = I_p(r, ⌊x⌋+1),  E = r (1 − p)/p,  Var = r (1 − p)/p².

use super::{
    Arithmetic, Constraint, Refusal, Sample, Support,
    fit::{MOST_SHAPE, ln_less_digamma},
};
use crate::operators::{Binary, Unary};
use rand::Rng;
use rand_distr::Distribution;

pub(super) const NAME: &str = "negative_binomial";
pub(super) const PARAMETERS: [(&str, Constraint); 2] =
    [("number of successes", Constraint::Positive), ("probability", Constraint::PositiveProbability)];
pub(super) const SUPPORT: Support = Support::Counts;

pub(super) fn ln_density<A: Arithmetic>(by: &mut A, x: A::Number, [r, p]: [A::Number; 2]) -> A::Number {
    let (zero, one) = (by.constant(0.0), by.constant(1.0));
    let positive = by.binary(Binary::Maximum, x, zero);
    let (next, all) = (by.add(positive, one), by.add(positive, r));
    let [ln_all, ln_factorial, ln_r] = [all, next, r].map(|number| by.unary(Unary::LnGamma, number));
    let value = by.subtract(ln_all, ln_r);
    let value = by.subtract(value, ln_factorial);
    let failure = by.subtract(one, p);
    let (successes, failures) = (by.times_ln(r, p), by.times_ln(x, failure));
    let value = by.add(value, successes);
    let value = by.add(value, failures);
    let inside = by.is_count(x);
    by.within(inside, value)
}

pub(super) fn tails(x: f64, [r, p]: [f64; 2]) -> (f64, f64) {
    match x.floor() {
        x if x < 0.0 => (0.0, 1.0),
        x => crate::special::beta(r, x + 1.0, p, 1.0 - p),
    }
}

pub(super) fn mean([r, p]: [f64; 2]) -> f64 {
    r * (1.0 - p) / p
}

pub(super) fn variance([r, p]: [f64; 2]) -> f64 {
    r * (1.0 - p) / (p * p)
}

/// mean of ψ(x + r) − ψ(r) = ln(1 + x̄/r), by halving intervals of ln r (there is one root if the variance is larger than the mean:
/// Simonsen, *Scandinavian Actuarial Journal*, 1976), then p = r / (r + x̄). r is [`MOST_SHAPE`] at most: nearly a Poisson law.
pub(super) fn fit(sample: &Sample, _: &[f64]) -> Result<[f64; 2], Refusal> {
    let mean = sample.mean_of(|x| x);
    if sample.ends().0 < 0.0 || mean <= 0.0 {
        return Err("needs counts that are not all 0");
    }
    // ψ(x + r) − ψ(r) = ln(1 + x/r) + (ln r − ψ(r)) − (ln(x + r) − ψ(x + r))
    let slope = |r: f64| {
        let (own, _) = ln_less_digamma(r);
        sample.mean_of(|x| (x / r).ln_1p() + own - ln_less_digamma(x + r).0) - (mean / r).ln_1p()
    };
    let spread = sample.mean_of(|x| (x - mean) * (x - mean));
    let shape = if spread <= mean || slope(MOST_SHAPE) > 0.0 {
        MOST_SHAPE
    } else {
        let (mut low, mut high) = (1e-12_f64, MOST_SHAPE);
        while high > low * (1.0 + 1e-14) {
            let middle = low.sqrt() * high.sqrt();
            if middle <= low || middle >= high {
                break;
            }
            (low, high) = if slope(middle) > 0.0 { (middle, high) } else { (low, middle) };
        }
        high
    };
    Ok([shape, shape / (shape + mean)])
}

/// A Poisson law whose rate is drawn.
pub(super) fn draw(by: &mut impl Rng, [r, p]: [f64; 2]) -> f64 {
    let rate = rand_distr::Gamma::new(r, (1.0 - p) / p).map_or(0.0, |law| law.sample(by));
    rand_distr::Poisson::new(rate).map_or(0.0, |law| law.sample(by))
}
