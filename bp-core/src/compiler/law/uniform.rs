//! Uniform law between two bounds a < b.
//!
//! f(x) = 1/(b − a) for a ≤ x ≤ b,  F(x) = (x − a)/(b − a),  E = (a + b)/2,  Var = (b − a)²/12.

use super::{Arithmetic, Constraint, Numbers, Refusal, Sample, Support, fit::TOO_EQUAL};
use crate::operators::{Binary, Unary};
use rand::{Rng, RngExt};

pub(super) const NAME: &str = "uniform";
pub(super) const PARAMETERS: [(&str, Constraint); 2] =
    [("lower bound", Constraint::Real), ("upper bound", Constraint::Real)];
pub(super) const SUPPORT: Support = Support::Reals;

pub(super) fn ln_density<A: Arithmetic>(by: &mut A, x: A::Number, [low, high]: [A::Number; 2]) -> A::Number {
    let inside = by.lies_between(x, [low, high]);
    let unit = unit(by, [low, high]);
    let width = difference(by, high, low, unit);
    let ln_width = by.ln(width);
    let value = by.unary(Unary::Negate, ln_width);
    let value = match unit {
        Some(unit) => {
            let ln_unit = by.constant(unit.ln());
            by.add(value, ln_unit)
        }
        None => value,
    };
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
    let (from, to, unit) = (clamp(by, from), clamp(by, to), unit(by, [low, high]));
    let (part, whole) = (difference(by, to, from, unit), difference(by, high, low, unit));
    Some(by.divide(part, whole))
}

/// The factor by which known bounds are multiplied, where their difference is beyond the range of f64.
fn unit<A: Arithmetic>(by: &mut A, [low, high]: [A::Number; 2]) -> Option<f64> {
    let (low, high) = (by.known(low)?, by.known(high)?);
    (high - low).is_infinite().then_some(0.5)
}

/// x − y, multiplied by the unit.
fn difference<A: Arithmetic>(by: &mut A, x: A::Number, y: A::Number, unit: Option<f64>) -> A::Number {
    let Some(unit) = unit else { return by.subtract(x, y) };
    let unit = by.constant(unit);
    let [x, y] = [x, y].map(|number| by.multiply(number, unit));
    by.subtract(x, y)
}

pub(super) fn tails(x: f64, [low, high]: [f64; 2]) -> (f64, f64) {
    let x = x.clamp(low, high);
    let mass = |from, to| mass(&mut Numbers, from, to, [low, high]).unwrap_or(f64::NAN);
    (mass(low, x), mass(x, high))
}

pub(super) fn mean([low, high]: [f64; 2]) -> f64 {
    0.5 * (low + high)
}

pub(super) fn variance([low, high]: [f64; 2]) -> f64 {
    (high - low) * (high - low) / 12.0
}

/// (b − a)/√12
pub(super) fn deviation([low, high]: [f64; 2]) -> f64 {
    (0.5 * high - 0.5 * low) / 3f64.sqrt()
}

/// The smallest and the largest value: any narrower interval has likelihood 0, any wider one less.
pub(super) fn fit(sample: &Sample, _: &[f64]) -> Result<[f64; 2], Refusal> {
    let (low, high) = sample.ends();
    if low < high { Ok([low, high]) } else { Err(TOO_EQUAL) }
}

pub(super) fn draw(by: &mut impl Rng, [low, high]: [f64; 2]) -> f64 {
    let share = by.random::<f64>();
    match (high - low).is_finite() {
        true => low + (high - low) * share,
        false => low * (1.0 - share) + high * share,
    }
}

/// ln (b − a)
pub(super) fn entropy([low, high]: [f64; 2]) -> f64 {
    -ln_density(&mut Numbers, low, [low, high])
}

/// Each value has the same density.
pub(super) fn mode(_: [f64; 2]) -> Option<f64> {
    None
}
