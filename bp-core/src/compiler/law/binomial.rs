//! Binomial law with n trials and probability p: the number of successes.
//!
//! P(x) = n! / (x! (n−x)!) pˣ (1−p)^(n−x) for x = 0..n,  E = n p,  Var = n p (1 − p).

use super::{Arithmetic, Constraint, Refusal, Sample, Support, saddle};
use crate::operators::{Binary, Unary};
use rand::Rng;
use rand_distr::Distribution;

pub(super) const NAME: &str = "binomial";
pub(super) const PARAMETERS: [(&str, Constraint); 2] =
    [("number of trials", Constraint::Count), ("probability", Constraint::Probability)];
pub(super) const SUPPORT: Support = Support::Counts;

/// Of more trials, the saddle-point form: with S(k) = ln k! − (k ln k − k) it is exp(S(n) − S(x) − S(n − x) − D(x, np) −
/// D(n − x, n (1 − p))).
const FEW: f64 = 100.0;

pub(super) fn ln_density<A: Arithmetic>(by: &mut A, x: A::Number, [n, p]: [A::Number; 2]) -> A::Number {
    let (zero, one) = (by.constant(0.0), by.constant(1.0));
    // Beyond n, n − x counts as 0, so that no term is undefined there.
    let rest = by.subtract(n, x);
    let rest = by.binary(Binary::Maximum, rest, zero);
    let ln_factorial = |by: &mut A, count| {
        let next = by.add(count, one);
        by.unary(Unary::LnGamma, next)
    };
    let (all, left) = (ln_factorial(by, n), ln_factorial(by, rest));
    let positive = by.binary(Binary::Maximum, x, zero);
    let chosen = ln_factorial(by, positive);
    let value = by.subtract(all, left);
    let value = by.subtract(value, chosen);
    let failure = by.subtract(one, p);
    let (successes, failures) = (by.times_ln(x, p), by.times_ln(rest, failure));
    let value = by.add(value, successes);
    let mut value = by.add(value, failures);
    if !saddle::is_known_below(by, n, FEW) {
        let parts = [positive, rest].map(|count| saddle::ln_factorial_rest(by, count));
        let means = [p, failure].map(|p| by.multiply(n, p));
        let deviances = [saddle::deviance(by, positive, means[0]), saddle::deviance(by, rest, means[1])];
        value = saddle::ln_factorial_rest(by, n);
        for term in parts.into_iter().chain(deviances) {
            value = by.subtract(value, term);
        }
    }
    let (count, below) = (by.is_count(x), by.binary(Binary::LessOrEqual, x, n));
    let inside = by.binary(Binary::And, count, below);
    by.within(inside, value)
}

/// I_{1−p}(n − x, x + 1)
pub(super) fn tails(x: f64, [n, p]: [f64; 2]) -> (f64, f64) {
    let x = x.floor();
    match x {
        x if x < 0.0 => (0.0, 1.0),
        x if x >= n => (1.0, 0.0),
        _ => crate::special::beta(n - x, x + 1.0, 1.0 - p, p),
    }
}

pub(super) fn mean([n, p]: [f64; 2]) -> f64 {
    n * p
}

pub(super) fn variance([n, p]: [f64; 2]) -> f64 {
    n * p * (1.0 - p)
}

/// p = mean of x / n, where n is known.
pub(super) fn fit(sample: &Sample, known: &[f64]) -> Result<[f64; 2], Refusal> {
    let [trials] = known else { return Err("needs the number of trials") };
    let (least, most) = sample.ends();
    match least >= 0.0 && most <= *trials && *trials > 0.0 {
        true => Ok([*trials, sample.mean_of(|x| x) / trials]),
        false => Err("needs values from 0 to the number of trials"),
    }
}

pub(super) fn draw(by: &mut impl Rng, [n, p]: [f64; 2]) -> f64 {
    rand_distr::Binomial::new(n as u64, p).map_or(f64::NAN, |law| law.sample(by) as f64)
}

pub(super) fn entropy(parameters: [f64; 2]) -> f64 {
    super::counts::entropy(super::Law::Binomial, &parameters)
}

/// The whole number below (n + 1) p, n at most
pub(super) fn mode([trials, probability]: [f64; 2]) -> Option<f64> {
    Some(((trials + 1.0) * probability).floor().min(trials))
}
