//! Numbers with 32 digits: the unevaluated sum of two f64.
//!
//! In: numbers of f64. Out: sums, products and quotients. Invariant: the second part is at most half a unit of the
//! first.
//!
//! Dekker, *Numerische Mathematik* 18, 1971; the rounding error of a sum (Knuth) and of a product (fused) is itself an
//! f64.

use std::ops::{Add, Div, Mul, Sub};

#[derive(Clone, Copy)]
pub(crate) struct Twofold(f64, f64);

impl Twofold {
    pub(crate) const ZERO: Self = Self(0.0, 0.0);

    pub(crate) fn value(self) -> f64 {
        self.0
    }

    /// The exact sum of two numbers.
    fn sum(one: f64, other: f64) -> Self {
        let sum = one + other;
        let part = sum - one;
        Self(sum, (one - (sum - part)) + (other - part))
    }
}

impl From<f64> for Twofold {
    fn from(number: f64) -> Self {
        Self(number, 0.0)
    }
}

impl Add for Twofold {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let (sum, rest) = (Self::sum(self.0, other.0), Self::sum(self.1, other.1));
        let sum = Self::sum(sum.0, sum.1 + rest.0);
        Self::sum(sum.0, sum.1 + rest.1)
    }
}

impl Sub for Twofold {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + Self(-other.0, -other.1)
    }
}

impl Mul for Twofold {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let product = self.0 * other.0;
        let rest = self.0.mul_add(other.0, -product) + (self.0 * other.1 + self.1 * other.0);
        Self::sum(product, rest)
    }
}

impl Div for Twofold {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let first = self.0 / other.0;
        let rest = self - other * Self::from(first);
        let second = rest.0 / other.0;
        let rest = rest - other * Self::from(second);
        Self::sum(first, second) + Self::from(rest.0 / other.0)
    }
}
