//! Beta law with a and b: a proportion, after a − 1 successes and b − 1 failures.
//!
//! f(x) = x^(a−1) (1−x)^(b−1) Γ(a+b) / (Γ(a) Γ(b)) for 0 < x < 1,  F(x) = I_x(a, b),
//! E = a/(a+b),  Var = ab / ((a+b)² (a+b+1)).

use super::{Arithmetic, Constraint, Support};
use crate::operators::{Binary, Unary};
use rand::Rng;
use rand_distr::Distribution;

pub(super) const NAME: &str = "beta";
pub(super) const PARAMETERS: [(&str, Constraint); 2] =
    [("a", Constraint::Positive), ("b", Constraint::Positive)];
pub(super) const SUPPORT: Support = Support::UnitInterval;

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
    let value = by.subtract(value, ln_b);
    let (above, below) = (by.greater(x, zero), by.greater(one, x));
    let inside = by.binary(Binary::And, above, below);
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

pub(super) fn cumulative(x: f64, [a, b]: [f64; 2]) -> f64 {
    statrs::function::beta::beta_reg(a, b, x.clamp(0.0, 1.0))
}

pub(super) fn mean([a, b]: [f64; 2]) -> f64 {
    a / (a + b)
}

pub(super) fn variance([a, b]: [f64; 2]) -> f64 {
    a * b / ((a + b) * (a + b) * (a + b + 1.0))
}

pub(super) fn draw(by: &mut impl Rng, [a, b]: [f64; 2]) -> f64 {
    rand_distr::Beta::new(a, b).map_or(f64::NAN, |law| law.sample(by))
}
