//! Number types of kernels: f32, f64, and f64's digits with an unbounded exponent.
//!
//! In: a number. Out: a number. Invariant: exponential and logarithm of f32 and f64 have no branches and no calls, so that
//! loops over lanes of them become SIMD.

mod double;
mod extended;
mod single;

pub use extended::Extended;

use crate::operators::{Binary, Mass, OPERANDS, Unary};
use std::borrow::Cow;
use std::fmt::Debug;
use std::iter::Sum;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number type of kernels.
pub trait Scalar:
    Copy
    + Debug
    + Default
    + PartialOrd
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Sum
    + From<f32>
    + 'static
{
    /// The type of values that are the same in all lanes.
    type Number: Number;
    /// 0
    const ZERO: Self;
    /// 1
    const ONE: Self;
    /// A total below it may have lost terms: 2⁻⁵¹² in f64, 2⁻⁶⁴ in f32.
    const LEAST_TOTAL: Self;
    /// The nearest number.
    fn from_f64(number: f64) -> Self;
    /// The number.
    fn to_f64(self) -> f64;
    /// Numbers in f64; those that are need no copy.
    fn widen(numbers: &[Self]) -> Cow<'_, [f64]>;
    /// The number, for a value that is the same in all lanes.
    fn to_number(self) -> Self::Number;
    /// The nearest number to such a value.
    fn from_number(number: Self::Number) -> Self;
    /// Whether it is finite: then, and only then, x − x is 0.
    #[inline(always)]
    #[allow(clippy::eq_op, reason = "the difference detects infinities and NaN without a branch")]
    fn is_finite_number(self) -> bool {
        self - self == Self::ZERO
    }
    /// x < ∞. In f32 and f64 it is written x ≤ the largest number: the compiler would merge x ≥ 0 and x < ∞ into one
    /// test of the bits, which takes four times as many instructions as two comparisons.
    #[inline(always)]
    fn is_below_infinity(self) -> bool {
        self < Self::from_f64(f64::INFINITY)
    }
    /// |x|
    fn absolute(self) -> Self;
    /// √x
    fn square_root(self) -> Self;
    /// ⌊x⌋
    fn round_down(self) -> Self;
    /// eˣ
    fn exponential(self) -> Self;
    /// ln x; −∞ at 0.
    fn natural_logarithm(self) -> Self;
    /// Φ(x)
    fn normal_cumulative(self) -> Self;
    /// −x ln x, and 0 at 0 and below.
    fn entropy_term(self) -> Self;
    /// Whether it is one of the whole numbers 0, 1, … below `count`; counts beyond 2³¹ are taken for 2³¹.
    fn is_below(self, count: usize) -> bool;
    /// An operator without a version in this precision: it is computed in f64.
    #[inline]
    fn in_f64(self, f: impl Fn(f64) -> f64) -> Self {
        Self::from_f64(f(self.to_f64()))
    }
    /// ⌈x⌉
    #[inline(always)]
    fn round_up(self) -> Self {
        -(-self).round_down()
    }
    /// The nearest whole number, halves away from zero.
    #[inline]
    fn round(self) -> Self {
        self.in_f64(f64::round)
    }
    /// sin x
    #[inline]
    fn sine(self) -> Self {
        self.in_f64(f64::sin)
    }
    /// cos x
    #[inline]
    fn cosine(self) -> Self {
        self.in_f64(f64::cos)
    }
    /// log₂ x
    #[inline]
    fn binary_logarithm(self) -> Self {
        self.in_f64(f64::log2)
    }
    /// ln Γ(x)
    #[inline]
    fn ln_gamma(self) -> Self {
        self.in_f64(crate::operators::ln_gamma)
    }
    /// ln I₀(x)
    #[inline]
    fn ln_bessel(self) -> Self {
        self.in_f64(crate::operators::ln_bessel)
    }
    /// xʸ
    #[inline]
    fn power(self, exponent: Self) -> Self {
        self.in_f64(|x| x.powf(exponent.to_f64()))
    }
    /// The remainder of x modulo y, in [0, y).
    #[inline(always)]
    fn remainder(self, divisor: Self) -> Self {
        self - divisor * (self / divisor).round_down()
    }
    /// The angle of the point (self, x).
    #[inline]
    fn arc_tangent(self, x: Self) -> Self {
        self.in_f64(|y| y.atan2(x.to_f64()))
    }

    /// The probability of an interval.
    #[inline]
    fn mass(law: Mass, operands: [Self; OPERANDS]) -> Self {
        Self::from_f64(law.apply(operands.map(Self::to_f64)))
    }

    /// The smaller one.
    #[inline(always)]
    fn minimum(self, other: Self) -> Self {
        if self < other { self } else { other }
    }

    /// The larger one.
    #[inline(always)]
    fn maximum(self, other: Self) -> Self {
        if self > other { self } else { other }
    }

    /// 1 where the condition holds, else 0.
    #[inline(always)]
    fn truth(condition: bool) -> Self {
        if condition { Self::ONE } else { Self::ZERO }
    }
}

/// The type in which values common to all lanes are computed: at least as wide as the lanes.
pub trait Number: Copy + Debug + Default + Send + Sync + 'static {
    /// The nearest number.
    fn known(number: f64) -> Self;
    /// The nearest f64.
    fn rounded(self) -> f64;
    /// Whether it is 0: a false condition.
    fn is_zero(self) -> bool;
    /// The operator's value at `x`.
    fn unary(operator: Unary, x: Self) -> Self;
    /// The operator's value at `x`, `y`.
    fn binary(operator: Binary, x: Self, y: Self) -> Self;
    /// The probability of an interval.
    fn mass(law: Mass, operands: [Self; OPERANDS]) -> Self;
}

impl Number for f64 {
    #[inline(always)]
    fn known(number: f64) -> f64 {
        number
    }
    #[inline(always)]
    fn rounded(self) -> f64 {
        self
    }
    #[inline(always)]
    fn is_zero(self) -> bool {
        self == 0.0
    }
    #[inline(always)]
    fn unary(operator: Unary, x: f64) -> f64 {
        operator.apply(x)
    }
    #[inline(always)]
    fn binary(operator: Binary, x: f64, y: f64) -> f64 {
        operator.apply(x, y)
    }
    fn mass(law: Mass, operands: [f64; OPERANDS]) -> f64 {
        law.apply(operands)
    }
}

/// The operator's value at `x`.
pub(crate) fn unary<T: Scalar>(operator: Unary, x: T) -> T {
    match operator {
        Unary::Negate => -x,
        Unary::Not => T::ONE - x,
        Unary::Absolute => x.absolute(),
        Unary::Exponential => x.exponential(),
        Unary::NaturalLogarithm => x.natural_logarithm(),
        Unary::EntropyTerm => x.entropy_term(),
        Unary::SquareRoot => x.square_root(),
        Unary::Floor => x.round_down(),
        Unary::Ceiling => x.round_up(),
        Unary::Round => x.round(),
        Unary::Sine => x.sine(),
        Unary::Cosine => x.cosine(),
        Unary::BinaryLogarithm => x.binary_logarithm(),
        Unary::LnGamma => x.ln_gamma(),
        Unary::LnBessel => x.ln_bessel(),
        Unary::NormalCumulative => x.normal_cumulative(),
    }
}

/// The operator's value at `x`, `y`.
pub(crate) fn binary<T: Scalar>(operator: Binary, x: T, y: T) -> T {
    match operator {
        Binary::Add => x + y,
        Binary::Subtract => x - y,
        Binary::Multiply => x * y,
        Binary::Divide => x / y,
        Binary::Minimum => x.minimum(y),
        Binary::Maximum => x.maximum(y),
        Binary::Power => x.power(y),
        Binary::Remainder => x.remainder(y),
        Binary::ArcTangent => x.arc_tangent(y),
        Binary::Equal => T::truth(x == y),
        Binary::NotEqual => T::truth(x != y),
        Binary::Less => T::truth(x < y),
        Binary::LessOrEqual => T::truth(x <= y),
        Binary::Greater => T::truth(x > y),
        Binary::GreaterOrEqual => T::truth(x >= y),
        Binary::And => T::truth(x != T::ZERO && y != T::ZERO),
        Binary::Or => T::truth(x != T::ZERO || y != T::ZERO),
    }
}
