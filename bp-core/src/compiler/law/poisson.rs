//! Poisson law with rate r: the number of events in a unit of time.
//!
//! P(x) = rˣ exp(−r) / x! for x = 0, 1, 2, …,  F(x) = Q(⌊x⌋ + 1, r),  E = Var = r.

use super::{Arithmetic, Constraint, Refusal, Sample, Support, saddle};
use crate::operators::{Binary, Unary};
use rand::Rng;
use rand_distr::Distribution;

pub(super) const NAME: &str = "poisson";
pub(super) const PARAMETERS: [(&str, Constraint); 1] = [("rate", Constraint::Positive)];
pub(super) const SUPPORT: Support = Support::Counts;

/// Of a larger rate, the saddle-point form: with S(x) = ln x! − (x ln x − x) it is exp(−S(x) − D(x, λ)).
const FEW: f64 = 100.0;

pub(super) fn ln_density<A: Arithmetic>(by: &mut A, x: A::Number, [rate]: [A::Number; 1]) -> A::Number {
    let (zero, one) = (by.constant(0.0), by.constant(1.0));
    let positive = by.binary(Binary::Maximum, x, zero);
    let next = by.add(positive, one);
    let (ln_factorial, power) = (by.unary(Unary::LnGamma, next), by.times_ln(x, rate));
    let value = by.subtract(power, rate);
    let mut value = by.subtract(value, ln_factorial);
    if !saddle::is_known_below(by, rate, FEW) {
        let zero = by.constant(0.0);
        let positive = by.binary(Binary::Maximum, x, zero);
        let (rest, deviance) =
            (saddle::ln_factorial_rest(by, positive), saddle::deviance(by, positive, rate));
        let sum = by.add(rest, deviance);
        value = by.unary(Unary::Negate, sum);
    }
    let inside = by.is_count(x);
    by.within(inside, value)
}

pub(super) fn tails(x: f64, [rate]: [f64; 1]) -> (f64, f64) {
    if x < 0.0 {
        return (0.0, 1.0);
    }
    let (above, below) = crate::special::gamma(x.floor() + 1.0, rate);
    (below, above)
}

pub(super) fn mean([rate]: [f64; 1]) -> f64 {
    rate
}

pub(super) fn variance([rate]: [f64; 1]) -> f64 {
    rate
}

/// r = mean of x
pub(super) fn fit(sample: &Sample, _: &[f64]) -> Result<[f64; 1], Refusal> {
    let mean = sample.mean_of(|x| x);
    match sample.ends().0 >= 0.0 && mean > 0.0 {
        true => Ok([mean]),
        false => Err("needs counts that are not all 0"),
    }
}

pub(super) fn draw(by: &mut impl Rng, [rate]: [f64; 1]) -> f64 {
    // Of a larger rate the skewness, 1/√λ, is below 1e-8: the law is normal within rounding.
    const NORMAL: f64 = 1e16;
    if rate > NORMAL {
        return super::normal::draw(by, [rate, rate.sqrt()]).round();
    }
    rand_distr::Poisson::new(rate).map_or(f64::NAN, |law| law.sample(by))
}

pub(super) fn entropy(parameters: [f64; 1]) -> f64 {
    super::counts::entropy(super::Law::Poisson, &parameters)
}

/// The whole number below λ
pub(super) fn mode([rate]: [f64; 1]) -> Option<f64> {
    Some(rate.floor())
}
