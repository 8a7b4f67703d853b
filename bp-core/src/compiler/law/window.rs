//! Weights of a law over a window of numbers.
//!
//! In: a law with valid parameters, a number, and the ends of the window. Out: ln w, where w is proportional to the
//! density over the window. Invariant: w is near 1 where it is largest in the window, and no large terms cancel,
//! however far away the mode is.
//!
//! r is the number of the window nearest to the mode. With ln k! = k ln k − k + S(k), the convex k ln k − k is replaced
//! by its distance D(k, r) from the tangent at r (`saddle.rs`); the tangents together make a slope, which is 0 if r is
//! the mode. The same is done with (k − 1) ln x of the gamma law. Constants are left out.

use super::{Arithmetic, Law, saddle};
use crate::operators::{Binary, Unary};

pub(super) fn ln_weight<A: Arithmetic>(
    law: Law,
    by: &mut A,
    x: A::Number,
    parameters: &[A::Number],
    ends: [A::Number; 2],
) -> A::Number {
    let (zero, one) = (by.constant(0.0), by.constant(1.0));
    match (law, parameters) {
        (Law::Binomial, &[n, p]) => binomial(by, x, [n, p], ends),
        (Law::Poisson, &[rate]) => {
            let window = Window::around(by, rate, ends);
            let odds = by.divide(rate, window.at);
            let (slope, rest) = (window.slope(by, x, odds), excess(by, x, window.at));
            let value = by.subtract(slope, rest);
            let inside = by.is_count(x);
            by.within(inside, value)
        }
        (Law::NegativeBinomial, &[r, p]) => negative_binomial(by, x, [r, p], ends),
        (Law::Geometric, &[p]) => {
            let (start, ln) = (by.binary(Binary::Maximum, ends[0], zero), saddle::ln_complement(by, p));
            let failures = by.subtract(x, start);
            let value = saddle::times(by, failures, ln);
            // p = 1 allows no failure.
            let (count, some, certain) =
                (by.is_count(x), by.greater(x, zero), by.binary(Binary::Equal, p, one));
            let excluded = by.binary(Binary::And, some, certain);
            let allowed = by.unary(Unary::Not, excluded);
            let inside = by.binary(Binary::And, count, allowed);
            by.within(inside, value)
        }
        (Law::Exponential, &[rate]) => {
            let start = by.binary(Binary::Maximum, ends[0], zero);
            let distance = by.subtract(start, x);
            let value = by.multiply(rate, distance);
            let inside = by.binary(Binary::GreaterOrEqual, x, zero);
            by.within(inside, value)
        }
        (Law::Gamma, &[k, rate]) => {
            let less = by.subtract(k, one);
            let mode = by.divide(less, rate);
            let Window { at, is_mode } = Window::around(by, mode, ends);
            let (inside, share) = (by.greater(x, zero), by.divide(less, at));
            let x = by.select(inside, x, at);
            let (slope, distance) = (by.subtract(share, rate), by.subtract(x, at));
            let slope = by.select(is_mode, zero, slope);
            let (tangent, deviance) = (by.multiply(slope, distance), saddle::deviance(by, at, x));
            let excess = by.multiply(share, deviance);
            let value = by.subtract(tangent, excess);
            by.within(inside, value)
        }
        (Law::Normal, &[m, s]) => {
            let nearest = clamped(by, m, ends);
            bell(by, [x, nearest], [m, s])
        }
        (Law::Lognormal, &[m, s]) => {
            // The law of ln x is normal, and the slope of the logarithm is 1/x.
            let start = by.binary(Binary::Maximum, ends[0], one);
            let positive = by.binary(Binary::Maximum, x, one);
            let [ln_x, low, high] = [positive, start, ends[1]].map(|x| by.ln(x));
            let nearest = clamped(by, m, [low, high]);
            let (value, slope) = (bell(by, [ln_x, nearest], [m, s]), by.subtract(nearest, ln_x));
            let value = by.add(value, slope);
            let inside = by.greater(x, zero);
            by.within(inside, value)
        }
        (Law::HalfNormal, &[s]) => {
            let nearest = by.binary(Binary::Maximum, ends[0], zero);
            let value = bell(by, [x, nearest], [zero, s]);
            let inside = by.binary(Binary::GreaterOrEqual, x, zero);
            by.within(inside, value)
        }
        (Law::Laplace, &[m, b]) => {
            let nearest = clamped(by, m, ends);
            let [here, there] = [x, nearest].map(|x| {
                let difference = by.subtract(x, m);
                by.unary(Unary::Absolute, difference)
            });
            let nearer = by.subtract(there, here);
            by.divide(nearer, b)
        }
        _ => law.ln_density(by, x, parameters),
    }
}

/// The number of a window at which tangents are taken.
struct Window<N> {
    at: N,
    /// Whether it is the mode of the law.
    is_mode: N,
}

impl<N: Copy> Window<N> {
    /// The number nearest to the mode, ½ at least.
    fn around<A: Arithmetic<Number = N>>(by: &mut A, mode: N, ends: [N; 2]) -> Self {
        let (half, nearest) = (by.constant(0.5), clamped(by, mode, ends));
        let at = by.binary(Binary::Maximum, nearest, half);
        Self { at, is_mode: by.binary(Binary::Equal, at, mode) }
    }

    /// (x − r) ln odds; 0 at the mode, where the odds are 1 but for rounding.
    fn slope<A: Arithmetic<Number = N>>(&self, by: &mut A, x: N, odds: N) -> N {
        let (one, distance) = (by.constant(1.0), by.subtract(x, self.at));
        let odds = by.select(self.is_mode, one, odds);
        let ln = by.ln(odds);
        by.multiply(distance, ln)
    }
}

fn clamped<A: Arithmetic>(by: &mut A, x: A::Number, [low, high]: [A::Number; 2]) -> A::Number {
    let x = by.binary(Binary::Maximum, x, low);
    by.binary(Binary::Minimum, x, high)
}

/// ln of N(x; m, s) / N(r; m, s): ½ (r − x) (r − m + x − m) / s².
fn bell<A: Arithmetic>(by: &mut A, [x, r]: [A::Number; 2], [m, s]: [A::Number; 2]) -> A::Number {
    let (half, difference) = (by.constant(0.5), by.subtract(r, x));
    let [here, there] = [x, r].map(|x| by.subtract(x, m));
    let sum = by.add(here, there);
    let [difference, sum] = [difference, sum].map(|distance| by.divide(distance, s));
    let product = by.multiply(difference, sum);
    by.multiply(half, product)
}

/// ln k! less its tangent at r, 0 there: D(k, r) + S(k) − S(r); k counts as 0 below.
fn excess<A: Arithmetic>(by: &mut A, k: A::Number, r: A::Number) -> A::Number {
    let zero = by.constant(0.0);
    let k = by.binary(Binary::Maximum, k, zero);
    let [rest, there] = [k, r].map(|k| saddle::ln_factorial_rest(by, k));
    let (deviance, rest) = (saddle::deviance(by, k, r), by.subtract(rest, there));
    by.add(deviance, rest)
}

/// With tangents at r of x and m of n − x: (x − r) ln(p m / ((1 − p) r)) less the excess of both.
fn binomial<A: Arithmetic>(
    by: &mut A,
    x: A::Number,
    [n, p]: [A::Number; 2],
    ends: [A::Number; 2],
) -> A::Number {
    let (zero, half, one) = (by.constant(0.0), by.constant(0.5), by.constant(1.0));
    let (q, mean) = (by.subtract(one, p), by.multiply(n, p));
    let window = Window::around(by, mean, ends);
    let (own, left) = (by.multiply(n, q), by.subtract(n, window.at));
    let left = by.binary(Binary::Maximum, left, half);
    let left = by.select(window.is_mode, own, left);
    let (never, always) = (by.binary(Binary::Equal, p, zero), by.binary(Binary::Equal, q, zero));
    let certain = by.binary(Binary::Or, never, always);
    let (above, below) = (by.multiply(p, left), by.multiply(q, window.at));
    let odds = by.divide(above, below);
    let odds = by.select(certain, one, odds);
    let (slope, rest) = (window.slope(by, x, odds), by.subtract(n, x));
    let (successes, failures) = (excess(by, x, window.at), excess(by, rest, left));
    let value = by.subtract(slope, successes);
    let value = by.subtract(value, failures);
    // p = 0 allows no success, and p = 1 no failure.
    let [successes, failures] = [(x, never), (rest, always)].map(|(count, none)| {
        let some = by.greater(count, zero);
        by.binary(Binary::And, some, none)
    });
    let (count, most) = (by.is_count(x), by.binary(Binary::LessOrEqual, x, n));
    let possible = by.binary(Binary::And, count, most);
    let excluded = by.binary(Binary::Or, successes, failures);
    let allowed = by.unary(Unary::Not, excluded);
    let inside = by.binary(Binary::And, possible, allowed);
    by.within(inside, value)
}

/// With ln Γ(y) = y ln y − y + T(y): (x − a) ln((1 − p) (a + r) / a) + D(x + r, a + r) − D(x, a) + T(x + r) − S(x), less
/// its value at a, where the tangents are.
fn negative_binomial<A: Arithmetic>(
    by: &mut A,
    x: A::Number,
    [r, p]: [A::Number; 2],
    ends: [A::Number; 2],
) -> A::Number {
    let (zero, one) = (by.constant(0.0), by.constant(1.0));
    let q = by.subtract(one, p);
    let mean = by.multiply(r, q);
    let mean = by.divide(mean, p);
    let window = Window::around(by, mean, ends);
    let positive = by.binary(Binary::Maximum, x, zero);
    let [all, all_there] = [positive, window.at].map(|x| by.add(x, r));
    let odds = by.multiply(q, all_there);
    let odds = by.divide(odds, window.at);
    let certain = by.binary(Binary::Equal, q, zero);
    let odds = by.select(certain, one, odds);
    let slope = window.slope(by, positive, odds);
    let [rest, there] = [all, all_there].map(|all| saddle::ln_gamma_rest(by, all));
    let (deviance, rest) = (saddle::deviance(by, all, all_there), by.subtract(rest, there));
    let (value, own) = (by.add(slope, deviance), excess(by, positive, window.at));
    let value = by.add(value, rest);
    let value = by.subtract(value, own);
    // p = 1 allows no failure.
    let (count, some) = (by.is_count(x), by.greater(x, zero));
    let excluded = by.binary(Binary::And, some, certain);
    let allowed = by.unary(Unary::Not, excluded);
    let inside = by.binary(Binary::And, count, allowed);
    by.within(inside, value)
}
