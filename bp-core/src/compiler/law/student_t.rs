//! Student's law with ν degrees of freedom, location m and scale s: normal but for its tails, which are heavy where ν is small.
//!
//! f(x) = Γ((ν+1)/2) / (Γ(ν/2) √(νπ) s) (1 + t²/ν)^(−(ν+1)/2) with t = (x − m)/s,
//! E = m for ν > 1,  Var = s² ν/(ν − 2) for ν > 2.

use super::{
    Arithmetic, Constraint, Numbers, Refusal, Sample, Support,
    fit::{MOST_SHAPE, NO_CONVERGENCE, TOO_EQUAL, ln_less_digamma},
    normal::standard,
};
use crate::operators::{Mass, Unary};
use crate::special::ln_rising;
use rand::Rng;
use rand_distr::{ChiSquared, Distribution, StandardNormal};
use std::f64::consts::TAU;

pub(super) const NAME: &str = "student_t";
pub(super) const PARAMETERS: [(&str, Constraint); 3] = [
    ("degrees of freedom", Constraint::Positive),
    ("location", Constraint::Real),
    ("scale", Constraint::Positive),
];
pub(super) const SUPPORT: Support = Support::Reals;

/// The fewest degrees of freedom that are learned: those of a Cauchy law. Below, the likelihood has no bound.
const LEAST_FREEDOM: f64 = 1.0;

/// ν/2 from which Γ(ν/2 + ½)/Γ(ν/2) is computed by its series.
const FAR: f64 = 20.0;

pub(super) fn ln_density<A: Arithmetic>(
    by: &mut A,
    x: A::Number,
    [freedom, m, s]: [A::Number; 3],
) -> A::Number {
    let (t, half, one) = (standard(by, x, [m, s]), by.constant(0.5), by.constant(1.0));
    let ln_square = ln_one_plus_square(by, t, freedom);
    let next = by.add(freedom, one);
    let power = by.multiply(half, next);
    let decay = by.multiply(power, ln_square);
    let (ln_s, ln_root) = (by.ln(s), by.constant(0.5 * TAU.ln()));
    let a = by.multiply(half, freedom);
    let front = ln_gamma_ratio(by, a);
    let value = by.subtract(front, decay);
    let value = by.subtract(value, ln_s);
    by.subtract(value, ln_root)
}

/// ln(1 + t²/ν), where 1 + t²/ν has few digits of t²/ν by Kahan's u ln w / (w − 1) with w = 1 + u, and far out 2 ln|t| − ln ν.
pub(super) fn ln_one_plus_square<A: Arithmetic>(by: &mut A, t: A::Number, freedom: A::Number) -> A::Number {
    let (one, two, far) = (by.constant(1.0), by.constant(2.0), by.constant(1e15));
    let (square, size) = (by.multiply(t, t), by.unary(Unary::Absolute, t));
    let part = by.divide(square, freedom);
    let whole = by.add(one, part);
    let (rest, ln_whole) = (by.subtract(whole, one), by.ln(whole));
    let product = by.multiply(part, ln_whole);
    let exact = by.divide(product, rest);
    let near = by.select(rest, exact, part);
    let (ln_size, ln_freedom) = (by.ln(size), by.ln(freedom));
    let twice = by.multiply(two, ln_size);
    let beyond = by.subtract(twice, ln_freedom);
    let is_far = by.greater(part, far);
    by.select(is_far, beyond, near)
}

/// ln(Γ(a + ½) / (Γ(a) √a)): by logarithms, and for large a by its series −1/(8a) + 1/(192a³) − 1/(640a⁵) + 17/(14336a⁷) −
/// 31/(18432a⁹) (Tricomi and Erdélyi, *Pacific Journal of Mathematics* 1:133-142, 1951).
fn ln_gamma_ratio<A: Arithmetic>(by: &mut A, a: A::Number) -> A::Number {
    let (one, half, far) = (by.constant(1.0), by.constant(0.5), by.constant(FAR));
    let inverse = by.divide(one, a);
    let square = by.multiply(inverse, inverse);
    let mut series = by.constant(-31.0 / 18432.0);
    for coefficient in [17.0 / 14336.0, -1.0 / 640.0, 1.0 / 192.0, -0.125] {
        let coefficient = by.constant(coefficient);
        let product = by.multiply(series, square);
        series = by.add(product, coefficient);
    }
    let series = by.multiply(series, inverse);
    let next = by.add(a, half);
    let (above, below, ln_a) = (by.unary(Unary::LnGamma, next), by.unary(Unary::LnGamma, a), by.ln(a));
    let (difference, root) = (by.subtract(above, below), by.multiply(half, ln_a));
    let exact = by.subtract(difference, root);
    let is_far = by.greater(a, far);
    by.select(is_far, series, exact)
}

pub(super) fn mass<A: Arithmetic>(
    by: &mut A,
    low: A::Number,
    high: A::Number,
    [freedom, m, s]: [A::Number; 3],
) -> Option<A::Number> {
    Some(by.mass(Mass::StudentT, [low, high, freedom, m, s]))
}

pub(super) fn tails(x: f64, [freedom, m, s]: [f64; 3]) -> (f64, f64) {
    let t = (x - m) / s;
    let tail = Mass::StudentT.apply([t.abs(), f64::INFINITY, freedom, 0.0, 1.0]);
    if t > 0.0 { (1.0 - tail, tail) } else { (tail, 1.0 - tail) }
}

/// It has one for ν > 1.
pub(super) fn mean([freedom, m, _]: [f64; 3]) -> f64 {
    if freedom > 1.0 { m } else { f64::NAN }
}

/// Infinite for 1 < ν ≤ 2; undefined for smaller ν.
pub(super) fn variance([freedom, _, s]: [f64; 3]) -> f64 {
    match freedom {
        freedom if freedom > 2.0 => s * s * freedom / (freedom - 2.0),
        freedom if freedom > 1.0 => f64::INFINITY,
        _ => f64::NAN,
    }
}

/// ν, m and s of the largest likelihood, ν between [`LEAST_FREEDOM`] and [`MOST_SHAPE`].
///
/// # Errors
/// One value has half of the weight or more: then the likelihood may grow without bound as s goes to zero.
pub(super) fn fit(sample: &Sample, _: &[f64]) -> Result<[f64; 3], Refusal> {
    match has_half(sample) {
        true => Err(TOO_EQUAL),
        false => along(|freedom| located(sample, freedom).ok()).map(|point| point.1).ok_or(NO_CONVERGENCE),
    }
}

/// The same where s is at least `floor`, which bounds the likelihood: m at the heaviest value and s at the floor, or inside.
pub(super) fn fit_above(sample: &Sample, floor: f64) -> [f64; 3] {
    let value = heaviest(sample).0;
    let narrow = |freedom: f64| Some(with_likelihood(sample, [freedom, value, floor]));
    let inside = |freedom: f64| located(sample, freedom).ok().filter(|(_, [_, _, s])| *s >= floor);
    let held = narrow(LEAST_FREEDOM).into_iter().chain(narrow(MOST_SHAPE));
    let all = held.chain(along(narrow)).chain(along(inside));
    all.reduce(better).expect("internal: the floor has a likelihood").1
}

/// As [`fit_above`], where ν is known: m and s.
pub(super) fn location_and_scale_above(sample: &Sample, freedom: f64, floor: f64) -> [f64; 2] {
    let held = with_likelihood(sample, [freedom, heaviest(sample).0, floor]);
    let inside = located(sample, freedom).ok().filter(|(_, [_, _, s])| *s >= floor);
    let (_, [_, m, s]) = inside.map_or(held, |inside| better(held, inside));
    [m, s]
}

/// Parameters, with the mean of ln f.
type Point = (f64, [f64; 3]);

fn with_likelihood(sample: &Sample, parameters: [f64; 3]) -> Point {
    (sample.mean_of(|x| ln_density(&mut Numbers, x, parameters)), parameters)
}

fn located(sample: &Sample, freedom: f64) -> Result<Point, Refusal> {
    let [m, s] = location_and_scale(sample, freedom)?;
    Ok(with_likelihood(sample, [freedom, m, s]))
}

/// The more likely of two points; the second where they differ by rounding.
fn better(one: Point, other: Point) -> Point {
    if one.0 > other.0 + 1e-11 { one } else { other }
}

/// The most likely point along ν: over a grid in ln ν, then by the golden section around the best.
fn along(point: impl Fn(f64) -> Option<Point>) -> Option<Point> {
    let at = |ln_freedom: f64| {
        let point = point(ln_freedom.exp().clamp(LEAST_FREEDOM, MOST_SHAPE));
        point.unwrap_or((f64::NEG_INFINITY, [0.0; 3]))
    };
    const STEPS: usize = 28;
    let (least, most) = (LEAST_FREEDOM.ln(), MOST_SHAPE.ln());
    let step = (most - least) / STEPS as f64;
    let mut best = (0, at(least));
    for place in 1..=STEPS {
        let found = at(least + step * place as f64);
        if found.0 > best.1.0 {
            best = (place, found);
        }
    }
    let (mut low, mut high) =
        ((least + step * (best.0 as f64 - 1.0)).max(least), (least + step * (best.0 as f64 + 1.0)).min(most));
    // Near its maximum the likelihood is flat: ln ν is found to the root of the rounding.
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    let (mut first, mut second) = (high - golden * (high - low), low + golden * (high - low));
    let (mut one, mut other) = (at(first), at(second));
    while high - low > 1e-9 {
        if one.0 >= other.0 {
            (high, second, other) = (second, first, one);
            first = high - golden * (high - low);
            one = at(first);
        } else {
            (low, first, one) = (first, second, other);
            second = low + golden * (high - low);
            other = at(second);
        }
        let better = if one.0 >= other.0 { one } else { other };
        if better.0 > best.1.0 {
            best.1 = better;
        }
    }
    Some(best.1).filter(|point| point.0 > f64::NEG_INFINITY)
}

/// The value with the largest weight, and its weight.
fn heaviest(sample: &Sample) -> (f64, f64) {
    let heavier = |one: (f64, f64), other: (f64, f64)| if other.1 > one.1 { other } else { one };
    sample.iter().reduce(heavier).unwrap_or((f64::NAN, 0.0))
}

/// Whether one value has half of the weight or more.
pub(super) fn has_half(sample: &Sample) -> bool {
    2.0 * heaviest(sample).1 >= sample.total()
}

/// m and s of maximum likelihood where ν is known, by expectation–maximisation with an extended parameter (Kent, Tyler and Vardi,
/// *Communications in Statistics – Simulation and Computation* 23:441-453, 1994): w = (ν+1)/(ν+t²), m = Σwx/Σw, s² =
/// Σw(x−m)²/Σw. The maximum is single if no value has the weight ν/(1+ν) or more; above that weight the likelihood has no
/// bound as s goes to zero.
pub(super) fn location_and_scale(sample: &Sample, freedom: f64) -> Result<[f64; 2], Refusal> {
    if heaviest(sample).1 * (1.0 + freedom) > sample.total() * freedom {
        return Err(TOO_EQUAL);
    }
    let median = sample.median();
    let unit = sample.map(|x| (x - median).abs()).median();
    let unit = if unit > 0.0 { unit } else { sample.mean_of(|x| (x - median).abs()) };
    if !(unit > 0.0 && unit.is_finite()) {
        return Err(TOO_EQUAL);
    }
    // Relative to the median and its deviation.
    let scaled = sample.map(|x| (x - median) / unit);
    let (mut m, mut s) = (0.0, 1.0);
    for _ in 0..10_000 {
        let weight = |x: f64| {
            let t = (x - m) / s;
            (freedom + 1.0) / (freedom + t * t)
        };
        let total = scaled.mean_of(weight);
        let next = scaled.mean_of(|x| weight(x) * x) / total;
        let scale = (scaled.mean_of(|x| weight(x) * (x - next) * (x - next)) / total).sqrt();
        if !(scale > 0.0 && scale.is_finite()) {
            return Err(NO_CONVERGENCE);
        }
        let moved = ((next - m) / s).abs().max((scale / s - 1.0).abs());
        (m, s) = (next, scale);
        if moved <= 1e-13 {
            break;
        }
    }
    Ok([median + unit * m, unit * s])
}

pub(super) fn draw(by: &mut impl Rng, [freedom, m, s]: [f64; 3]) -> f64 {
    let standard: f64 = StandardNormal.sample(by);
    let square = ChiSquared::new(freedom).map_or(f64::NAN, |law| law.sample(by));
    m + s * standard / (square / freedom).sqrt()
}

/// (ν + 1)/2 (ψ((ν + 1)/2) − ψ(ν/2)) + ½ ln ν + ln B(ν/2, ½) + ln s
pub(super) fn entropy([freedom, _, scale]: [f64; 3]) -> f64 {
    let half = 0.5 * freedom;
    let digammas = (1.0 / freedom).ln_1p() + ln_less_digamma(half).0 - ln_less_digamma(half + 0.5).0;
    let ln_beta = 0.5 * std::f64::consts::PI.ln() - ln_rising(half, 0.5);
    (half + 0.5) * digammas + 0.5 * freedom.ln() + ln_beta + scale.ln()
}

pub(super) fn mode([_, location, _]: [f64; 3]) -> Option<f64> {
    Some(location)
}
