//! Terms of densities in which large numbers do not cancel.
//!
//! In: parameters, a number. Out: terms of ln f. Source: C. Loader, *Fast and accurate computation of binomial
//! probabilities*, 2000. The same terms in f64 are in `special/stirling.rs`.

use super::Arithmetic;
use crate::operators::{Binary, Unary};

/// From here on the remainder of Stirling's formula is computed by its series.
const LARGE: f64 = 16.0;

/// δ(x) = ln Γ(x) − ((x − ½) ln x − x + ½ ln 2π) for x > 0 (Abramowitz and Stegun 6.1.41).
pub(super) fn stirling_rest<A: Arithmetic>(by: &mut A, x: A::Number) -> A::Number {
    let (half, ln_root) = (by.constant(0.5), by.constant(0.5 * std::f64::consts::TAU.ln()));
    let (ln_gamma, ln_x, power) = (by.unary(Unary::LnGamma, x), by.ln(x), by.subtract(x, half));
    let product = by.multiply(power, ln_x);
    let exact = by.subtract(ln_gamma, product);
    let exact = by.add(exact, x);
    let exact = by.subtract(exact, ln_root);
    let series = series(by, x);
    let large = by.constant(LARGE);
    let is_small = by.binary(Binary::Less, x, large);
    by.select(is_small, exact, series)
}

/// ln Γ(x) − (x ln x − x) for x > 0.
pub(super) fn ln_gamma_rest<A: Arithmetic>(by: &mut A, x: A::Number) -> A::Number {
    let (half, turn) = (by.constant(0.5), by.constant(std::f64::consts::TAU));
    let (share, rest) = (by.divide(turn, x), stirling_rest(by, x));
    let ln_share = by.ln(share);
    let root = by.multiply(half, ln_share);
    by.add(root, rest)
}

/// ln(1 − p) for p in [0, 1], with the digits of a small p: with u = 1 − p it is p ln u / (1 − u), where the rounding of u
/// cancels (Kahan).
pub(super) fn ln_complement<A: Arithmetic>(by: &mut A, p: A::Number) -> A::Number {
    let one = by.constant(1.0);
    let u = by.subtract(one, p);
    let (ln_u, rest, none) = (by.ln(u), by.subtract(one, u), by.unary(Unary::Negate, p));
    let product = by.multiply(p, ln_u);
    let (exact, is_lost) = (by.divide(product, rest), by.binary(Binary::Equal, u, one));
    by.select(is_lost, none, exact)
}

/// x ln y, which is 0 where x is 0, given ln y.
pub(super) fn times<A: Arithmetic>(by: &mut A, x: A::Number, ln_y: A::Number) -> A::Number {
    let (product, zero) = (by.multiply(x, ln_y), by.constant(0.0));
    by.select(x, product, zero)
}

fn series<A: Arithmetic>(by: &mut A, x: A::Number) -> A::Number {
    let one = by.constant(1.0);
    let inverse = by.divide(one, x);
    let square = by.multiply(inverse, inverse);
    let mut sum = by.constant(-691.0 / 360_360.0);
    for coefficient in [1.0 / 1188.0, -1.0 / 1680.0, 1.0 / 1260.0, -1.0 / 360.0, 1.0 / 12.0] {
        let (product, coefficient) = (by.multiply(sum, square), by.constant(coefficient));
        sum = by.add(product, coefficient);
    }
    by.multiply(sum, inverse)
}

/// ln k! − (k ln k − k) for a count k, 0 at 0.
pub(super) fn ln_factorial_rest<A: Arithmetic>(by: &mut A, k: A::Number) -> A::Number {
    let (one, large) = (by.constant(1.0), by.constant(LARGE));
    let next = by.add(k, one);
    let (ln_factorial, power) = (by.unary(Unary::LnGamma, next), by.times_ln(k, k));
    let exact = by.subtract(ln_factorial, power);
    let exact = by.add(exact, k);
    // Its ends are those of positive numbers.
    let positive = by.binary(Binary::Maximum, k, one);
    let (turn, half, rest) = (by.constant(std::f64::consts::TAU), by.constant(0.5), series(by, positive));
    let area = by.multiply(turn, positive);
    let ln_area = by.ln(area);
    let root = by.multiply(half, ln_area);
    let far = by.add(root, rest);
    let is_small = by.binary(Binary::Less, k, large);
    by.select(is_small, exact, far)
}

/// D(k, m) = k ln(k/m) + m − k; by the series of artanh where k and m are close.
pub(super) fn deviance<A: Arithmetic>(by: &mut A, k: A::Number, m: A::Number) -> A::Number {
    let (difference, sum, ratio) = (by.subtract(k, m), by.add(k, m), by.divide(k, m));
    let far = by.times_ln(k, ratio);
    let far = by.subtract(far, difference);
    let v = by.divide(difference, sum);
    let (square, two) = (by.multiply(v, v), by.constant(2.0));
    let mut series = by.constant(1.0 / 17.0);
    for odd in [15.0, 13.0, 11.0, 9.0, 7.0, 5.0, 3.0] {
        let (product, coefficient) = (by.multiply(series, square), by.constant(1.0 / odd));
        series = by.add(product, coefficient);
    }
    let (first, twice) = (by.multiply(difference, v), by.multiply(two, k));
    let cube = by.multiply(square, v);
    let rest = by.multiply(cube, series);
    let rest = by.multiply(twice, rest);
    let near = by.add(first, rest);
    let (size, most) = (by.unary(Unary::Absolute, v), by.constant(0.1));
    let is_near = by.binary(Binary::Less, size, most);
    by.select(is_near, near, far)
}

/// Whether a number is known, and at most `most`: then logarithms of Γ are small, and cancel little.
pub(super) fn is_known_below<A: Arithmetic>(by: &A, x: A::Number, most: f64) -> bool {
    by.known(x).is_some_and(|x| x <= most)
}
