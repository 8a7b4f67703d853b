//! Operators on blocks of lanes.
//!
//! In: operands, each one number for all lanes or one for each. Out: lanes. Invariant: each lane gets what
//! [`Scalar`] makes of its own operands, with whatever instructions the processor has: each operator is one tight loop,
//! compiled for each set of them.

use crate::exec::scalar::Scalar;
use crate::kernel::Fold;
use crate::operators::{Binary, Unary};
use pulp::{Arch, NullaryFnOnce};

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

/// What is done with a block of lanes.
pub(super) enum Work<'l, T> {
    Unary(Unary, Lane<'l, T>),
    Binary(Binary, Lane<'l, T>, Lane<'l, T>),
    Select(Lane<'l, T>, Lane<'l, T>, Lane<'l, T>),
    /// One more value of a fold.
    Fold(Fold, Lane<'l, T>),
    /// One more step of a recurrence: what is kept, what is added.
    Step(Lane<'l, T>, Lane<'l, T>),
}

struct Call<'c, 'l, T> {
    work: Work<'l, T>,
    out: &'c mut [T],
}

impl<T: Scalar> NullaryFnOnce for Call<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let out = self.out;
        match self.work {
            Work::Unary(operator, operand) => unary(operator, out, operand),
            Work::Binary(operator, left, right) => binary(operator, out, left, right),
            Work::Select(condition, then, otherwise) => select(out, condition, then, otherwise),
            Work::Fold(fold, value) => match fold {
                Fold::Sum => zip_with(out, value, |folded, value| folded + value),
                Fold::Product => zip_with(out, value, |folded, value| folded * value),
                Fold::Maximum => zip_with(out, value, T::maximum),
            },
            Work::Step(keep, value) => {
                zip_with(out, keep, |state, keep| keep * state);
                zip_with(out, value, |state, value| state + value);
            }
        }
    }
}

/// Does it, into `out`.
pub(super) fn run<T: Scalar>(instructions: Arch, out: &mut [T], work: Work<'_, T>) {
    instructions.dispatch(Call { work, out });
}

// Loops are written as loops: what iterators call inside would be compiled apart, without these instructions.
#[inline(always)]
fn zip_with<T: Scalar>(out: &mut [T], operand: Lane<'_, T>, f: impl Fn(T, T) -> T) {
    match operand {
        Lane::One(x) => {
            for out in out {
                *out = f(*out, x);
            }
        }
        Lane::Many(x) => {
            for (out, x) in out.iter_mut().zip(x) {
                *out = f(*out, *x);
            }
        }
    }
}

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
    let Lane::Many(condition) = condition else {
        let chosen = if condition.at(0) != T::ZERO { then } else { otherwise };
        return map(out, chosen, |x| x);
    };
    match (then, otherwise) {
        (Lane::One(then), Lane::One(otherwise)) => {
            map(out, Lane::Many(condition), |c| if c != T::ZERO { then } else { otherwise });
        }
        (Lane::Many(then), Lane::One(otherwise)) => {
            let both = Lane::Many(then);
            zip(out, Lane::Many(condition), both, |c, then| if c != T::ZERO { then } else { otherwise });
        }
        (Lane::One(then), Lane::Many(otherwise)) => {
            let both = Lane::Many(otherwise);
            zip(out, Lane::Many(condition), both, |c, otherwise| if c != T::ZERO { then } else { otherwise });
        }
        (Lane::Many(then), Lane::Many(otherwise)) => {
            let both = condition.iter().zip(then.iter().zip(otherwise));
            for (out, (condition, (then, otherwise))) in out.iter_mut().zip(both) {
                *out = if *condition != T::ZERO { *then } else { *otherwise };
            }
        }
    }
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
