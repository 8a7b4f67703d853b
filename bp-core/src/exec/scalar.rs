//! Numbers that kernels compute with: f32 and f64.
//!
//! In: a number. Out: a number. Invariant: exponential and logarithm have no branches and no calls, so that loops over lanes
//! of them become SIMD.

mod double;
mod single;

use std::borrow::Cow;
use std::fmt::Debug;
use std::iter::Sum;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number that kernels compute with.
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
    /// 0
    const ZERO: Self;
    /// 1
    const ONE: Self;
    /// The nearest number.
    fn from_f64(number: f64) -> Self;
    /// The number.
    fn to_f64(self) -> f64;
    /// Numbers in f64; those that are need no copy.
    fn widen(numbers: &[Self]) -> Cow<'_, [f64]>;
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
    /// An operator that has no version of its own in this precision: it is computed in f64.
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
    /// What is left of x after whole multiples of y, in [0, y).
    #[inline(always)]
    fn remainder(self, divisor: Self) -> Self {
        self - divisor * (self / divisor).round_down()
    }
    /// The angle of the point (self, x).
    #[inline]
    fn arc_tangent(self, x: Self) -> Self {
        self.in_f64(|y| y.atan2(x.to_f64()))
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
