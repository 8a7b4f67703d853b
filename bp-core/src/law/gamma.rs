//! Gamma law with shape k and rate r: the waiting time for the k-th event.
//!
//! f(x) = rᵏ x^(k−1) exp(−r x) / Γ(k) for x > 0,  F(x) = P(k, r x),  E = k/r,  Var = k/r².

use super::{Arithmetic, Constraint, Support};
use crate::operators::Unary;
use rand::Rng;
use rand_distr::Distribution;

pub(super) const NAME: &str = "gamma";
pub(super) const PARAMETERS: [(&str, Constraint); 2] =
    [("shape", Constraint::Positive), ("rate", Constraint::Positive)];
pub(super) const SUPPORT: Support = Support::Positive;

pub(super) fn ln_density<A: Arithmetic>(by: &mut A, x: A::Number, [k, rate]: [A::Number; 2]) -> A::Number {
    let (zero, one) = (by.constant(0.0), by.constant(1.0));
    let (ln_rate, less, ln_gamma) = (by.ln(rate), by.subtract(k, one), by.unary(Unary::LnGamma, k));
    let constant = by.multiply(k, ln_rate);
    let constant = by.subtract(constant, ln_gamma);
    let (power, decay) = (by.times_ln(less, x), by.multiply(rate, x));
    let value = by.subtract(power, decay);
    let value = by.add(value, constant);
    let inside = by.greater(x, zero);
    by.within(inside, value)
}

pub(super) fn mass<A: Arithmetic>(
    _: &mut A,
    _: A::Number,
    _: A::Number,
    _: [A::Number; 2],
) -> Option<A::Number> {
    None
}

pub(super) fn cumulative(x: f64, [k, rate]: [f64; 2]) -> f64 {
    if x > 0.0 { statrs::function::gamma::gamma_lr(k, rate * x) } else { 0.0 }
}

pub(super) fn mean([k, rate]: [f64; 2]) -> f64 {
    k / rate
}

pub(super) fn variance([k, rate]: [f64; 2]) -> f64 {
    k / (rate * rate)
}

pub(super) fn draw(by: &mut impl Rng, [k, rate]: [f64; 2]) -> f64 {
    rand_distr::Gamma::new(k, 1.0 / rate).map_or(f64::NAN, |law| law.sample(by))
}
