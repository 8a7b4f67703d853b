//! Operators on blocks of lanes.
//!
//! In: operands, each one number for all lanes or one for each. Out: lanes. Invariant: each lane is the result of
//! [`Scalar`] for its operands, with any instruction set: each operator is one tight loop, compiled for each of them.

use super::code::{Comparison, Computed, Operand};
use crate::exec::scalar::Scalar;
use crate::kernel::Fold;
use crate::operators::{Binary, Unary};

#[derive(Clone, Copy)]
pub(super) enum Lane<'l, T> {
    One(T),
    Many(&'l [T]),
}

impl<T: Copy> Lane<'_, T> {
    #[inline(always)]
    pub(super) fn at(&self, lane: usize) -> T {
        match self {
            Lane::One(value) => *value,
            Lane::Many(values) => values[lane],
        }
    }

    /// Copies lanes from `from` on.
    pub(super) fn copy(&self, from: usize, out: &mut [T]) {
        match self {
            Lane::One(value) => out.fill(*value),
            Lane::Many(values) => out.copy_from_slice(&values[from..][..out.len()]),
        }
    }
}

/// Maps lanes to lanes. Always inlined, so that it is compiled for each instruction set.
#[inline(always)]
pub(super) fn run<'l, T: Scalar>(
    out: &mut [T],
    computed: &Computed<Operand>,
    lanes: impl Fn(&Operand) -> Lane<'l, T>,
) {
    match computed {
        Computed::Unary(operator, a) => unary(*operator, out, lanes(a)),
        Computed::Binary(operator, a, b) => binary(*operator, out, lanes(a), lanes(b)),
        Computed::Select(a, b, c) => select(out, lanes(a), lanes(b), lanes(c)),
        Computed::Mass(law, operands) => {
            let operands = operands.map(|operand| lanes(&operand));
            for (lane, out) in out.iter_mut().enumerate() {
                *out = T::mass(*law, operands.map(|operand| operand.at(lane)));
            }
        }
        Computed::Choose(comparison, a, b, c, d) => {
            let operands = [lanes(a), lanes(b), lanes(c), lanes(d)];
            match comparison {
                Comparison::Greater => four(out, operands, |x, y, a, b| either(x > y, a, b)),
                Comparison::NotEqual => four(out, operands, |x, y, a, b| either(x != y, a, b)),
            }
        }
        Computed::Product(a, b, c) => three(out, lanes(a), lanes(b), lanes(c), |a, b, c| (a * b) * c),
        Computed::AddProduct(a, b, c) => three(out, lanes(a), lanes(b), lanes(c), |a, b, c| a + b * c),
        Computed::Mixture(a, b, c, d) => {
            four(out, [lanes(a), lanes(b), lanes(c), lanes(d)], |a, b, c, d| a * b + c * d);
        }
    }
}

/// Folds `width` lanes, one after the other.
pub(super) fn folded<T: Scalar>(fold: Fold, start: T, lanes: Lane<'_, T>, width: usize) -> T {
    let all = (0..width).map(|lane| lanes.at(lane));
    match fold {
        Fold::Sum => all.fold(start, |sum, x| sum + x),
        Fold::Product => all.fold(start, |product, x| product * x),
        Fold::Maximum => all.fold(start, T::maximum),
    }
}

// Explicit loops: functions called by iterators would be compiled separately, without these instructions. Operands are read
// before a function chooses between them: reads that depend on a condition are not SIMD.
#[inline(always)]
fn map<T: Scalar>(out: &mut [T], operand: Lane<'_, T>, f: impl Fn(T) -> T) {
    match operand {
        Lane::One(x) => out.fill(f(x)),
        Lane::Many(x) => {
            for (out, x) in out.iter_mut().zip(x) {
                *out = f(*x);
            }
        }
    }
}

#[inline(always)]
fn select<T: Scalar>(out: &mut [T], condition: Lane<'_, T>, then: Lane<'_, T>, otherwise: Lane<'_, T>) {
    match condition {
        Lane::One(condition) => map(out, either(condition != T::ZERO, then, otherwise), |x| x),
        _ => {
            three(out, condition, then, otherwise, |c, then, otherwise| either(c != T::ZERO, then, otherwise))
        }
    }
}

#[inline(always)]
fn either<A>(condition: bool, then: A, otherwise: A) -> A {
    if condition { then } else { otherwise }
}

#[inline(always)]
fn unary<T: Scalar>(operator: Unary, out: &mut [T], operand: Lane<'_, T>) {
    match operator {
        Unary::Negate => map(out, operand, |x| -x),
        Unary::Not => map(out, operand, |x| T::ONE - x),
        Unary::Absolute => map(out, operand, T::absolute),
        Unary::Exponential => map(out, operand, T::exponential),
        Unary::NaturalLogarithm => map(out, operand, T::natural_logarithm),
        Unary::EntropyTerm => map(out, operand, T::entropy_term),
        Unary::SquareRoot => map(out, operand, T::square_root),
        Unary::Floor => map(out, operand, T::round_down),
        Unary::Ceiling => map(out, operand, T::round_up),
        Unary::Round => map(out, operand, T::round),
        Unary::Sine => map(out, operand, T::sine),
        Unary::Cosine => map(out, operand, T::cosine),
        Unary::BinaryLogarithm => map(out, operand, T::binary_logarithm),
        Unary::LnGamma => map(out, operand, T::ln_gamma),
        Unary::LnBessel => map(out, operand, T::ln_bessel),
        Unary::NormalCumulative => map(out, operand, T::normal_cumulative),
    }
}

#[inline(always)]
fn zip<T: Scalar>(out: &mut [T], left: Lane<'_, T>, right: Lane<'_, T>, f: impl Fn(T, T) -> T) {
    match (left, right) {
        (Lane::One(x), Lane::One(y)) => out.fill(f(x, y)),
        (Lane::One(x), Lane::Many(y)) => {
            for (out, y) in out.iter_mut().zip(y) {
                *out = f(x, *y);
            }
        }
        (Lane::Many(x), Lane::One(y)) => {
            for (out, x) in out.iter_mut().zip(x) {
                *out = f(*x, y);
            }
        }
        (Lane::Many(x), Lane::Many(y)) => {
            for (out, (x, y)) in out.iter_mut().zip(x.iter().zip(y)) {
                *out = f(*x, *y);
            }
        }
    }
}

#[inline(always)]
fn three<T: Scalar>(out: &mut [T], a: Lane<'_, T>, b: Lane<'_, T>, c: Lane<'_, T>, f: impl Fn(T, T, T) -> T) {
    match (a, b, c) {
        (Lane::Many(a), Lane::Many(b), Lane::Many(c)) => {
            for (out, ((a, b), c)) in out.iter_mut().zip(a.iter().zip(b).zip(c)) {
                *out = f(*a, *b, *c);
            }
        }
        (Lane::Many(a), Lane::Many(b), Lane::One(c)) => {
            let both = Lane::Many(b);
            zip(out, Lane::Many(a), both, |a, b| f(a, b, c));
        }
        (Lane::Many(a), Lane::One(b), Lane::Many(c)) => {
            let both = Lane::Many(c);
            zip(out, Lane::Many(a), both, |a, c| f(a, b, c));
        }
        (Lane::One(a), b, c) => zip(out, b, c, |b, c| f(a, b, c)),
        (a, Lane::One(b), Lane::One(c)) => map(out, a, |a| f(a, b, c)),
    }
}

#[inline(always)]
fn four<T: Scalar>(out: &mut [T], operands: [Lane<'_, T>; 4], f: impl Fn(T, T, T, T) -> T) {
    match operands {
        [Lane::Many(a), Lane::One(b), Lane::Many(c), Lane::One(d)] => {
            zip(out, Lane::Many(a), Lane::Many(c), |a, c| f(a, b, c, d));
        }
        [Lane::Many(a), Lane::One(b), Lane::Many(c), Lane::Many(d)] => {
            for (out, (a, (c, d))) in out.iter_mut().zip(a.iter().zip(c.iter().zip(d))) {
                *out = f(*a, b, *c, *d);
            }
        }
        [Lane::Many(a), Lane::Many(b), Lane::Many(c), Lane::Many(d)] => {
            let (left, right) = (a.iter().zip(b), c.iter().zip(d));
            for (out, ((a, b), (c, d))) in out.iter_mut().zip(left.zip(right)) {
                *out = f(*a, *b, *c, *d);
            }
        }
        [a, b, c, d] => {
            for (lane, out) in out.iter_mut().enumerate() {
                *out = f(a.at(lane), b.at(lane), c.at(lane), d.at(lane));
            }
        }
    }
}

#[inline(always)]
fn binary<T: Scalar>(operator: Binary, out: &mut [T], left: Lane<'_, T>, right: Lane<'_, T>) {
    match operator {
        Binary::Add => zip(out, left, right, |x, y| x + y),
        Binary::Subtract => zip(out, left, right, |x, y| x - y),
        Binary::Multiply => zip(out, left, right, |x, y| x * y),
        Binary::Divide => zip(out, left, right, |x, y| x / y),
        Binary::Minimum => zip(out, left, right, T::minimum),
        Binary::Maximum => zip(out, left, right, T::maximum),
        Binary::Power => zip(out, left, right, T::power),
        Binary::Remainder => zip(out, left, right, T::remainder),
        Binary::ArcTangent => zip(out, left, right, T::arc_tangent),
        Binary::Equal => zip(out, left, right, |x, y| T::truth(x == y)),
        Binary::NotEqual => zip(out, left, right, |x, y| T::truth(x != y)),
        Binary::Less => zip(out, left, right, |x, y| T::truth(x < y)),
        Binary::LessOrEqual => zip(out, left, right, |x, y| T::truth(x <= y)),
        Binary::Greater => zip(out, left, right, |x, y| T::truth(x > y)),
        Binary::GreaterOrEqual => zip(out, left, right, |x, y| T::truth(x >= y)),
        Binary::And => zip(out, left, right, |x, y| T::truth(x != T::ZERO && y != T::ZERO)),
        Binary::Or => zip(out, left, right, |x, y| T::truth(x != T::ZERO || y != T::ZERO)),
    }
}
