//! Negative binomial law with r successes and probability p: the number of failures before the r-th success; r need not be whole.
//! It is a Poisson law whose rate has the law gamma(r, p/(1 − p)).
//!
//! P(x) = Γ(x+r) / (x! Γ(r)) pʳ (1 − p)ˣ for x = 0, 1, 2, …,  F(x) = I_p(r, ⌊x⌋+1),  E = r (1 − p)/p,  Var = r (1 − p)/p².

use super::{
    Arithmetic, Constraint, Refusal, Sample, Support,
    fit::{MOST_SHAPE, ln_less_digamma},
    saddle,
};
use crate::operators::Binary;
use rand::Rng;
use rand_distr::Distribution;

pub(super) const NAME: &str = "negative_binomial";
pub(super) const PARAMETERS: [(&str, Constraint); 2] =
    [("number of successes", Constraint::Positive), ("probability", Constraint::PositiveProbability)];
pub(super) const SUPPORT: Support = Support::Counts;

/// In saddle-point form, with ln Γ(y) = y ln y − y + T(y) and ln x! = x ln x − x + S(x): T(x + r) − T(r) − S(x) −
/// D(r, (x + r) p) − D(x, (x + r) (1 − p)).
pub(super) fn ln_density<A: Arithmetic>(by: &mut A, x: A::Number, [r, p]: [A::Number; 2]) -> A::Number {
    let (zero, one) = (by.constant(0.0), by.constant(1.0));
    let positive = by.binary(Binary::Maximum, x, zero);
    let (all, failure) = (by.add(positive, r), by.subtract(one, p));
    let [successes, failures] = [p, failure].map(|p| by.multiply(all, p));
    let terms = [
        saddle::ln_gamma_rest(by, r),
        saddle::ln_factorial_rest(by, positive),
        saddle::deviance(by, r, successes),
        saddle::deviance(by, positive, failures),
    ];
    let whole = saddle::ln_gamma_rest(by, all);
    let value = terms.into_iter().fold(whole, |value, term| by.subtract(value, term));
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
    if rate > 0.0 { super::poisson::draw(by, [rate]) } else { 0.0 }
}

pub(super) fn entropy(parameters: [f64; 2]) -> f64 {
    super::counts::entropy(super::Law::NegativeBinomial, &parameters)
}

/// The whole number below (r − 1) (1 − p) / p
pub(super) fn mode([successes, probability]: [f64; 2]) -> Option<f64> {
    Some(((successes - 1.0).max(0.0) * (1.0 - probability) / probability).floor())
}
