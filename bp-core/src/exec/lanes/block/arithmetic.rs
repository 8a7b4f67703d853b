//! Operators on blocks of lanes.
//!
//! In: operands, each one number for all lanes or one for each. Out: lanes. Invariant: each lane gets what
//! [`Scalar`] makes of its own operands.

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
}

pub(super) fn apply_fold<T: Scalar>(fold: Fold, folded: T, value: T) -> T {
    match fold {
        Fold::Sum => folded + value,
        Fold::Product => folded * value,
        Fold::Maximum => folded.maximum(value),
    }
}

fn map<T: Scalar>(out: &mut [T], operand: Lane<'_, T>, f: impl Fn(T) -> T) {
    match operand {
        Lane::One(x) => out.fill(f(x)),
        Lane::Many(x) => out.iter_mut().zip(x).for_each(|(out, x)| *out = f(*x)),
    }
}

pub(super) fn unary<T: Scalar>(operator: Unary, out: &mut [T], operand: Lane<'_, T>) {
    match operator {
        Unary::Negate => map(out, operand, |x| -x),
        Unary::Not => map(out, operand, |x| T::ONE - x),
        Unary::Absolute => map(out, operand, T::absolute),
        Unary::Exponential => map(out, operand, T::exponential),
        Unary::NaturalLogarithm => map(out, operand, T::natural_logarithm),
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

fn zip<T: Scalar>(out: &mut [T], left: Lane<'_, T>, right: Lane<'_, T>, f: impl Fn(T, T) -> T) {
    match (left, right) {
        (Lane::One(x), Lane::One(y)) => out.fill(f(x, y)),
        (Lane::One(x), Lane::Many(y)) => out.iter_mut().zip(y).for_each(|(out, y)| *out = f(x, *y)),
        (Lane::Many(x), Lane::One(y)) => out.iter_mut().zip(x).for_each(|(out, x)| *out = f(*x, y)),
        (Lane::Many(x), Lane::Many(y)) => {
            out.iter_mut().zip(x.iter().zip(y)).for_each(|(out, (x, y))| *out = f(*x, *y));
        }
    }
}

pub(super) fn binary<T: Scalar>(operator: Binary, out: &mut [T], left: Lane<'_, T>, right: Lane<'_, T>) {
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
