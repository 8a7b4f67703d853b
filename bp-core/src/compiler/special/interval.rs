//! The probability of an interval under laws whose cumulative distribution has no elementary form.
//!
//! In: the ends of an interval, and the parameters of a law. Out: its probability, as a factor and an exponent, so that it
//! neither underflows nor cancels. Invariant: the relative error is that of the ends, however narrow the interval is and
//! however far it lies in a tail.
//!
//! In a coordinate u in which the density is smooth, it is g(u) = g(u₀) exp(h(u)), u₀ the highest point of the interval:
//! gamma x = eᵘ, g = xᵏ e⁻ˣ / Γ(k); beta x = eᵘ/(1 + eᵘ), g = xᵃ (1 − x)ᵇ / B(a, b); Student's t = √ν sinh u,
//! g = √(ν/2π) Γ(½ν + ½)/(Γ(½ν) √(½ν)) cosh⁻ᵛ u; von Mises u = t. From u₀ outwards ∫ exp(h) is summed over panels of ten
//! Gauss–Legendre points (Abramowitz and Stegun, table 25.4), whose width follows the slope and the curvature of h, until
//! they add nothing.

use super::beta::ln_front;
use super::stirling::{deviance, stirling_rest};
use std::f64::consts::{PI, TAU};

/// A law whose intervals are integrated.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Mass {
    /// low, high, shape, rate
    Gamma,
    /// low, high, a, b
    Beta,
    /// low, high, degrees of freedom, location, scale
    StudentT,
    /// low, high, mean, concentration; on any number of turns
    VonMises,
}

/// The number of operands of a [`Mass`]; those that a law does not have are 0.
pub const OPERANDS: usize = 5;

impl Mass {
    /// The name of the law.
    pub fn name(self) -> &'static str {
        match self {
            Mass::Gamma => "gamma",
            Mass::Beta => "beta",
            Mass::StudentT => "student_t",
            Mass::VonMises => "von_mises",
        }
    }

    /// The probability of ]low, high]; NaN if an operand is NaN or a parameter invalid.
    pub fn apply(self, operands: [f64; OPERANDS]) -> f64 {
        let (factor, exponent) = self.scaled(operands);
        if factor == 0.0 { 0.0 } else { factor * pxfm::f_exp(exponent) }
    }

    /// The probability at known operands, unless it is outside the range of f64: then it is computed at run time, possibly in
    /// a wider range.
    pub fn folded(self, operands: [f64; OPERANDS]) -> Option<f64> {
        let (factor, value) = (self.scaled(operands).0, self.apply(operands));
        (value.is_normal() || factor == 0.0).then_some(value)
    }

    /// A factor f and an exponent e: the probability is f eᵉ.
    pub fn scaled(self, [low, high, p, q, r]: [f64; OPERANDS]) -> (f64, f64) {
        let is_positive = |x: f64| x > 0.0 && x.is_finite();
        let valid = match self {
            Mass::Gamma | Mass::Beta => is_positive(p) && is_positive(q),
            Mass::StudentT => is_positive(p) && q.is_finite() && is_positive(r),
            Mass::VonMises => p.is_finite() && is_positive(q) && (high - low).is_finite(),
        };
        if !valid || low.is_nan() || high.is_nan() {
            return (f64::NAN, 0.0);
        }
        if low >= high {
            return (0.0, 0.0);
        }
        match self {
            Mass::Gamma => gamma(low, high, p, q),
            Mass::Beta => beta(low, high, p, q),
            Mass::StudentT => student_t(low, high, [p, q, r]),
            Mass::VonMises => von_mises(low, high, p, q),
        }
    }
}

fn gamma(low: f64, high: f64, k: f64, rate: f64) -> (f64, f64) {
    let low = low.max(0.0);
    let (from, to) = (rate * low, rate * high);
    if to <= from {
        return (0.0, 0.0);
    }
    let x = k.clamp(from, to);
    let [below, above] = match (k <= from, k >= to) {
        (true, _) => [0.0, ln_ratio(high, low, high - low)],
        (_, true) => [ln_ratio(high, low, high - low), 0.0],
        _ => [ln_ratio(x, from, x - from), ln_ratio(to, x, to - x)],
    };
    // x eᵛ at a distance v.
    let curve = |v: f64| (k - x) * v - x * exp_rest(v);
    let local = |v: f64| {
        let at = x * pxfm::f_exp(v);
        (k - at, at)
    };
    let sum = integral(&curve, &local, -1.0, below) + integral(&curve, &local, 1.0, above);
    ((k / TAU).sqrt() * sum, -deviance(k, x) - stirling_rest(k))
}

fn beta(low: f64, high: f64, a: f64, b: f64) -> (f64, f64) {
    let (low, high) = (low.max(0.0), high.min(1.0));
    if low >= high {
        return (0.0, 0.0);
    }
    let n = a + b;
    let mode = a / n;
    let pair = |x: f64| (x, 1.0 - x);
    let (lower, upper) = (pair(low), pair(high));
    let length =
        |from: (f64, f64), to: (f64, f64), d: f64| ln_ratio(to.0, from.0, d) + ln_ratio(from.1, to.1, d);
    let (top, below, above) = match (mode <= low, mode >= high) {
        (true, _) => (lower, 0.0, length(lower, upper, high - low)),
        (_, true) => (upper, length(lower, upper, high - low), 0.0),
        _ => {
            let top = (mode, b / n);
            (top, length(lower, top, mode - low), length(top, upper, high - mode))
        }
    };
    let slope = if mode > low && mode < high { 0.0 } else { a * top.1 - b * top.0 };
    let (scale, exponent) = ln_front(a, b, top.0, top.1);
    // Seen from the nearer end, where x ≤ ½.
    let (x, y, a, b, slope, below, above) = match top.0 <= 0.5 {
        true => (top.0, top.1, a, b, slope, below, above),
        false => (top.1, top.0, b, a, -slope, above, below),
    };
    // x eᵛ / (x eᵛ + y) at a distance v.
    let curve = |v: f64| {
        let less = match v > 30.0 {
            true => v + pxfm::f_log(x + y * pxfm::f_exp(-v)) - x * v,
            // Farther out both rests are large, and nearly equal.
            false if v > 1.0 => pxfm::f_log1p(x * pxfm::f_expm1(v)) - x * v,
            false => x * exp_rest(v) - log_rest(x * pxfm::f_expm1(v)),
        };
        slope * v - n * less
    };
    let local = |v: f64| {
        let small = pxfm::f_exp(-v.abs());
        let (x, y) = if v > 0.0 { (x, y * small) } else { (x * small, y) };
        let (x, y) = (x / (x + y), y / (x + y));
        (a * y - b * x, n * x * y)
    };
    let sum = integral(&curve, &local, -1.0, below) + integral(&curve, &local, 1.0, above);
    (scale * sum, exponent)
}

fn student_t(low: f64, high: f64, [freedom, m, s]: [f64; 3]) -> (f64, f64) {
    let root = freedom.sqrt();
    let standard = |x: f64| (x - m) / s / root;
    let half = 0.5 * freedom;
    let rest = half * pxfm::f_log1p(0.5 / half) - 0.5 + stirling_rest(half + 0.5) - stirling_rest(half);
    // From sinh u₀ = p ≥ 0 over a distance in u.
    let side = |p: f64, length: f64| {
        let size = 1f64.hypot(p);
        let (tanh, square) = (p / size, 1.0 / size / size);
        let curve = |v: f64| {
            let ln = match v > 30.0 {
                true => v + pxfm::f_log(0.5 * (1.0 + tanh)),
                false => {
                    let sinh = pxfm::f_sinh(0.5 * v);
                    pxfm::f_log1p(2.0 * sinh * sinh + tanh * pxfm::f_sinh(v))
                }
            };
            -freedom * ln
        };
        let local = |v: f64| {
            let (t, c) = (pxfm::f_tanh(v), pxfm::f_cosh(v));
            let whole = 1.0 + tanh * t;
            (freedom * (tanh + t) / whole, freedom * square / (c * whole) / (c * whole))
        };
        integral(&curve, &local, 1.0, length)
    };
    let (p, q, length) = (standard(low), standard(high), (high - low) / s / root);
    let (p, sum) = match (p < 0.0, q > 0.0) {
        (true, true) => (0.0, side(0.0, asinh(-p)) + side(0.0, asinh(q))),
        (true, false) => (-q, side(-q, asinh_difference(-q, -p, length))),
        _ => (p, side(p, asinh_difference(p, q, length))),
    };
    let ln_cosh = if p > 1e8 { pxfm::f_log(p) } else { 0.5 * pxfm::f_log1p(p * p) };
    ((freedom / TAU).sqrt() * sum, rest - freedom * ln_cosh)
}

fn von_mises(low: f64, high: f64, m: f64, k: f64) -> (f64, f64) {
    let turns = ((high - low) / TAU).floor();
    let (centred, length) = (low - m, (high - low) - TAU * turns);
    let start = centred - TAU * (centred / TAU).round();
    // Intervals [t, t + length] of [0, π], by the symmetry of the density.
    let (mut pieces, mut from, mut left) = (Vec::with_capacity(4), start, length);
    while left > 0.0 && pieces.len() < 4 {
        let (end, falls) = match from {
            from if from < 0.0 => (0.0, false),
            from if from < PI => (PI, true),
            from => {
                from_below(&mut pieces, from - TAU, left);
                break;
            }
        };
        let part = left.min(end - from);
        pieces.push((if falls { from } else { (-from - part).max(0.0) }, part));
        (from, left) = (end, left - part);
    }
    let side = |&(t, length): &(f64, f64)| {
        let curve = |v: f64| -2.0 * k * pxfm::f_sin(t + 0.5 * v) * pxfm::f_sin(0.5 * v);
        let local = |v: f64| (k * pxfm::f_sin(t + v), k);
        (integral(&curve, &local, 1.0, length), -2.0 * k * pxfm::f_sin(0.5 * t).powi(2))
    };
    let parts: Vec<(f64, f64)> = pieces.iter().map(side).collect();
    let unit = TAU * pxfm::f_i0e(k);
    let most = parts.iter().fold(f64::NEG_INFINITY, |most: f64, (_, exponent)| most.max(*exponent));
    let most = if turns > 0.0 || parts.is_empty() { 0.0 } else { most };
    let sum: f64 = parts.iter().map(|(sum, exponent)| sum * pxfm::f_exp(exponent - most)).sum();
    (turns + sum / unit, most)
}

/// The intervals of [0, π] for what lies after a half turn.
fn from_below(pieces: &mut Vec<(f64, f64)>, from: f64, left: f64) {
    let before = left.min(-from);
    pieces.push(((-from - before).max(0.0), before));
    if left > before {
        pieces.push((0.0, left - before));
    }
}

/// ∫ exp(curve(v)) dv from 0 over a length in the direction of the sign; the curve, which is concave, falls from 0. `local`
/// gives its slope and the size of its curvature.
fn integral(curve: &impl Fn(f64) -> f64, local: &impl Fn(f64) -> (f64, f64), sign: f64, length: f64) -> f64 {
    const MOST_PANELS: u32 = 4000;
    let (mut at, mut sum) = (0.0, 0.0);
    for _ in 0..MOST_PANELS {
        let (slope, curvature) = local(sign * at);
        // Where the curve is nearly straight, the panels grow.
        let flat = (-0.25 * pxfm::f_log(curvature)).max(0.75);
        let step = (2.0 / curvature.sqrt()).min(3.0 / slope.abs()).min(flat);
        let step = step.min(length - at);
        let panel = gauss_legendre(&|v| pxfm::f_exp(curve(sign * v)), at, at + step);
        (sum, at) = (sum + panel, at + step);
        // NaN ends the sum.
        if !(at < length && panel > 1e-18 * sum) {
            break;
        }
    }
    sum
}

/// Nodes and weights of the rule of ten points.
const RULE: [(f64, f64); 5] = [
    (0.148_874_338_981_631_2, 0.295_524_224_714_752_87),
    (0.433_395_394_129_247_2, 0.269_266_719_309_996_35),
    (0.679_409_568_299_024_4, 0.219_086_362_515_982_04),
    (0.865_063_366_688_984_5, 0.149_451_349_150_580_6),
    (0.973_906_528_517_171_7, 0.066_671_344_308_688_14),
];

/// ∫ f from a to b, by ten points.
pub fn gauss_legendre(f: &impl Fn(f64) -> f64, a: f64, b: f64) -> f64 {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    let both = |(node, weight): &(f64, f64)| weight * (f(middle - half * node) + f(middle + half * node));
    half * RULE.iter().map(both).sum::<f64>()
}

/// ln(x/y) for x ≥ y ≥ 0, x − y being known.
fn ln_ratio(x: f64, y: f64, difference: f64) -> f64 {
    match () {
        () if y <= 0.0 || x == f64::INFINITY => f64::INFINITY,
        () if difference < y => pxfm::f_log1p(difference / y),
        () => pxfm::f_log(x) - pxfm::f_log(y),
    }
}

/// eᵛ − 1 − v
fn exp_rest(v: f64) -> f64 {
    if v.abs() > 0.5 {
        return pxfm::f_expm1(v) - v;
    }
    let mut factor = 1.0;
    for n in (3..=16).rev() {
        factor = 1.0 + factor * v / f64::from(n);
    }
    0.5 * v * v * factor
}

/// z − ln(1 + z), for z > −1: with s = z/(2 + z) it is s z − 2 (s³/3 + s⁵/5 + …).
fn log_rest(z: f64) -> f64 {
    if z.abs() > 0.5 {
        return z - pxfm::f_log1p(z);
    }
    let s = z / (2.0 + z);
    let square = s * s;
    let mut series = 0.0;
    for n in (1..=17).rev() {
        series = series * square + 1.0 / f64::from(2 * n + 1);
    }
    s * z - 2.0 * s * square * series
}

/// arsinh x for x ≥ 0.
fn asinh(x: f64) -> f64 {
    asinh_difference(0.0, x, x)
}

/// arsinh q − arsinh p for 0 ≤ p ≤ q, q − p being known.
fn asinh_difference(p: f64, q: f64, difference: f64) -> f64 {
    if q == f64::INFINITY {
        return f64::INFINITY;
    }
    if p > 1e8 {
        return ln_ratio(q, p, difference);
    }
    let whole = q * 1f64.hypot(p) + p * 1f64.hypot(q);
    if whole <= 0.0 {
        return 0.0;
    }
    let sinh = difference * ((p + q) / whole);
    match sinh > 1e8 {
        true => pxfm::f_log(sinh) + std::f64::consts::LN_2,
        false => pxfm::f_asinh(sinh),
    }
}
