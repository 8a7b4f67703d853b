//! Cauchy law with location m and scale s: Student's law with one degree of freedom.
//!
//! f(x) = 1 / (π s (1 + t²)) with t = (x − m)/s,  F(x) = ½ + arctan(t)/π. It has neither a mean nor a variance.

use super::{
    Arithmetic, Constraint, Refusal, Sample, Support,
    fit::TOO_EQUAL,
    normal::standard,
    student_t::{has_half, ln_one_plus_square, location_and_scale},
};
use crate::operators::Binary;
use rand::Rng;
use rand_distr::Distribution;
use std::f64::consts::{FRAC_1_PI, PI};

pub(super) const NAME: &str = "cauchy";
pub(super) const PARAMETERS: [(&str, Constraint); 2] =
    [("location", Constraint::Real), ("scale", Constraint::Positive)];
pub(super) const SUPPORT: Support = Support::Reals;

pub(super) fn ln_density<A: Arithmetic>(by: &mut A, x: A::Number, [m, s]: [A::Number; 2]) -> A::Number {
    let (t, one) = (standard(by, x, [m, s]), by.constant(1.0));
    let ln_square = ln_one_plus_square(by, t, one);
    let (ln_s, ln_pi) = (by.ln(s), by.constant(PI.ln()));
    let ln_total = by.add(ln_s, ln_pi);
    let ln_total = by.add(ln_total, ln_square);
    by.unary(crate::operators::Unary::Negate, ln_total)
}

/// (arctan v − arctan u)/π, the angle of the point (1 + u v, v − u), so that nothing cancels; both coordinates are divided by
/// max(1, |u|), so that their product does not overflow.
pub(super) fn mass<A: Arithmetic>(
    by: &mut A,
    low: A::Number,
    high: A::Number,
    parameters: [A::Number; 2],
) -> Option<A::Number> {
    let (least, most, one) = (by.constant(-1e300), by.constant(1e300), by.constant(1.0));
    let [u, v] = [low, high].map(|end| {
        let t = standard(by, end, parameters);
        let t = by.binary(Binary::Maximum, t, least);
        by.binary(Binary::Minimum, t, most)
    });
    let size = by.unary(crate::operators::Unary::Absolute, u);
    let unit = by.binary(Binary::Maximum, size, one);
    let length = by.subtract(high, low);
    let (length, longest) = (by.divide(length, parameters[1]), by.constant(2e300));
    let length = by.binary(Binary::Minimum, length, longest);
    let [u, share, across] = [u, one, length].map(|part| by.divide(part, unit));
    let product = by.multiply(u, v);
    let along = by.add(share, product);
    let (angle, turn) = (by.binary(Binary::ArcTangent, across, along), by.constant(FRAC_1_PI));
    Some(by.multiply(angle, turn))
}

/// The tail beyond |t| is the angle of the point (|t|, 1), in half turns.
pub(super) fn tails(x: f64, [m, s]: [f64; 2]) -> (f64, f64) {
    let t = (x - m) / s;
    let tail = FRAC_1_PI * pxfm::f_atan2(1.0, t.abs());
    if t > 0.0 { (1.0 - tail, tail) } else { (tail, 1.0 - tail) }
}

/// It is undefined: NaN.
pub(super) fn mean(_: [f64; 2]) -> f64 {
    f64::NAN
}

/// It is undefined: NaN.
pub(super) fn variance(_: [f64; 2]) -> f64 {
    f64::NAN
}

/// As Student's law with one degree of freedom.
pub(super) fn fit(sample: &Sample, _: &[f64]) -> Result<[f64; 2], Refusal> {
    match has_half(sample) {
        true => Err(TOO_EQUAL),
        false => location_and_scale(sample, 1.0),
    }
}

pub(super) fn draw(by: &mut impl Rng, [m, s]: [f64; 2]) -> f64 {
    rand_distr::Cauchy::new(m, s).map_or(f64::NAN, |law| law.sample(by))
}

/// ln 4πs
pub(super) fn entropy([_, scale]: [f64; 2]) -> f64 {
    (2.0 * std::f64::consts::TAU * scale).ln()
}

pub(super) fn mode([location, _]: [f64; 2]) -> Option<f64> {
    Some(location)
}
