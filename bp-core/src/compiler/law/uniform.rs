//! Uniform law between two bounds a < b.
//!
//! f(x) = 1/(b − a) for a ≤ x ≤ b,  F(x) = (x − a)/(b − a),  E = (a + b)/2,  Var = (b − a)²/12.

use super::{Arithmetic, Constraint, Refusal, Sample, Support, fit::TOO_EQUAL};
use crate::operators::{Binary, Unary};
use rand::{Rng, RngExt};

pub(super) const NAME: &str = "uniform";
pub(super) const PARAMETERS: [(&str, Constraint); 2] =
    [("lower bound", Constraint::Real), ("upper bound", Constraint::Real)];
pub(super) const SUPPORT: Support = Support::Reals;

pub(super) fn ln_density<A: Arithmetic>(by: &mut A, x: A::Number, [low, high]: [A::Number; 2]) -> A::Number {
    let above = by.binary(Binary::GreaterOrEqual, x, low);
    let below = by.binary(Binary::LessOrEqual, x, high);
    let inside = by.binary(Binary::And, above, below);
    let width = by.subtract(high, low);
    let ln_width = by.ln(width);
    let value = by.unary(Unary::Negate, ln_width);
    by.within(inside, value)
}

pub(super) fn mass<A: Arithmetic>(
    by: &mut A,
    from: A::Number,
    to: A::Number,
    [low, high]: [A::Number; 2],
) -> Option<A::Number> {
    let clamp = |by: &mut A, x| {
        let x = by.binary(Binary::Maximum, x, low);
        by.binary(Binary::Minimum, x, high)
    };
    let (from, to) = (clamp(by, from), clamp(by, to));
    let (part, whole) = (by.subtract(to, from), by.subtract(high, low));
    Some(by.divide(part, whole))
}

pub(super) fn tails(x: f64, [low, high]: [f64; 2]) -> (f64, f64) {
    let part = |part: f64| (part / (high - low)).clamp(0.0, 1.0);
    (part(x - low), part(high - x))
}

pub(super) fn mean([low, high]: [f64; 2]) -> f64 {
    0.5 * (low + high)
}

pub(super) fn variance([low, high]: [f64; 2]) -> f64 {
    (high - low) * (high - low) / 12.0
}

/// The smallest and the largest value: any narrower interval has likelihood 0, any wider one less.
pub(super) fn fit(sample: &Sample, _: &[f64]) -> Result<[f64; 2], Refusal> {
    let (low, high) = sample.ends();
    if low < high { Ok([low, high]) } else { Err(TOO_EQUAL) }
}

pub(super) fn draw(by: &mut impl Rng, [low, high]: [f64; 2]) -> f64 {
    low + (high - low) * by.random::<f64>()
}

/// ln (b − a)
pub(super) fn entropy([low, high]: [f64; 2]) -> f64 {
    (high - low).ln()
}

/// Each value has the same density.
pub(super) fn mode(_: [f64; 2]) -> Option<f64> {
    None
}
