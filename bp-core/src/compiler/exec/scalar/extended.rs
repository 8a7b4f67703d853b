//! Numbers of f64's precision whose exponent is an i128.
//!
//! In: numbers. Out: numbers m · 2ᵉ with 1 ≤ |m| < 2. Invariant: products of any number of probabilities and densities
//! neither underflow nor overflow; each operator rounds as f64 does. Zero, infinity and NaN have the exponent 0, so that
//! equal numbers have equal parts. Numbers below 2⁻ⁿ with n = 2¹²⁰ are not 0, but keep only their order
//! ([`Extended::is_beyond`]): of two different ones, the smaller is nothing beside the larger.
//!
//! Φ(x) for x < −36 is φ(x) / |x| · (1 − 1/x² + 1·3/x⁴ − …) (Abramowitz and Stegun 26.2.12).

use super::{Number, Scalar};
use crate::operators::{Binary, Mass, OPERANDS, Unary};
use std::borrow::Cow;
use std::cmp::Ordering;
use std::iter::Sum;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number m · 2ᵉ: f64's digits, and an exponent large enough for any product of probabilities.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Extended {
    mantissa: f64,
    exponent: i128,
}

/// The bits of f64's exponent.
const EXPONENT: u64 = 0x7FF0_0000_0000_0000;

/// The largest exponent of a number: an i128 can hold the sums of a few of them.
const MOST_EXPONENT: i128 = 1 << 120;

/// The difference of the exponents of two numbers with neighbouring ranks below all exponents.
const RANK_APART: i128 = 1 << 40;

/// An argument of this size is reduced once more.
const LARGE_REST: f64 = 300.0;

/// Below this, x² has no digits after the point.
const NO_DIGITS: f64 = -1e16;

/// Below this, Φ is computed in the extended range.
const FAR_TAIL: f64 = -36.0;

impl Extended {
    /// m · 2ᵉ, for an m that is 0, not finite, or not subnormal.
    #[inline]
    fn scaled(mantissa: f64, exponent: i128) -> Self {
        let bits = mantissa.to_bits();
        match bits & EXPONENT {
            EXPONENT | 0 => Self { mantissa, exponent: 0 },
            own => Self {
                mantissa: f64::from_bits(bits & !EXPONENT | 1.0f64.to_bits()),
                exponent: exponent.saturating_add((own >> 52) as i128 - 1023),
            },
        }
    }

    /// 2ᵉ for −1022 ≤ e ≤ 1023.
    #[inline]
    fn power_of_two(exponent: i128) -> f64 {
        f64::from_bits(((exponent + 1023) as u64) << 52)
    }

    /// log₂ |x|, rounded down; `None` where x is 0 or not finite.
    pub fn binary_exponent(self) -> Option<i128> {
        (self.mantissa != 0.0 && self.mantissa.is_finite()).then_some(self.exponent)
    }

    /// x · 2ⁿ
    pub fn times_power_of_two(self, exponent: impl Into<i128>) -> Self {
        match self.binary_exponent() {
            Some(own) => Self { exponent: own.saturating_add(exponent.into()), ..self },
            None => self,
        }
    }

    /// Whether it is nonzero but below the smallest exponent, where numbers keep only their order.
    pub fn is_beyond(self) -> bool {
        self.binary_exponent().is_some_and(|exponent| exponent < -MOST_EXPONENT)
    }

    /// eˣ for an x < 0 whose eˣ is below the smallest exponent: the exponent follows the rank of x among numbers, so that a
    /// larger x has the larger result, and the smaller one is nothing beside it.
    fn below_all(self) -> Self {
        const MOST_OF_RANK: i128 = 1 << 24;
        let digits = i128::from(self.mantissa.to_bits() & ((1 << 52) - 1));
        let rank = (self.exponent.min(MOST_OF_RANK) << 52) | digits;
        Self { mantissa: 1.0, exponent: -2 * MOST_EXPONENT - rank * RANK_APART }
    }

    /// Whether it is neither infinite nor NaN.
    pub fn is_finite(self) -> bool {
        self.mantissa.is_finite()
    }

    /// Whether f64 represents it without loss of digits.
    #[inline]
    fn is_ordinary(self) -> bool {
        (-1022..=1023).contains(&self.exponent)
    }
}

impl From<f32> for Extended {
    fn from(number: f32) -> Self {
        Self::from_f64(f64::from(number))
    }
}

impl Add for Extended {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        let finite = self.is_finite() && other.is_finite();
        if !finite {
            return Self::scaled(self.mantissa + other.mantissa, 0);
        }
        match (self.mantissa == 0.0, other.mantissa == 0.0) {
            // The sign of a zero matters: 0 − 0 is 0, which `atan2` distinguishes from −0.
            (true, true) => return Self::scaled(self.mantissa + other.mantissa, 0),
            (true, false) => return other,
            (false, true) => return self,
            (false, false) => {}
        }
        let (large, small) = if self.exponent >= other.exponent { (self, other) } else { (other, self) };
        match large.exponent.saturating_sub(small.exponent) {
            apart @ 0..64 => {
                Self::scaled(large.mantissa + small.mantissa * Self::power_of_two(-apart), large.exponent)
            }
            _ => large,
        }
    }
}

impl Neg for Extended {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self { mantissa: -self.mantissa, exponent: self.exponent }
    }
}

impl Sub for Extended {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Extended {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        Self::scaled(self.mantissa * other.mantissa, self.exponent.saturating_add(other.exponent))
    }
}

impl Div for Extended {
    type Output = Self;
    #[inline]
    fn div(self, other: Self) -> Self {
        let mut exponent = self.exponent.saturating_sub(other.exponent);
        if exponent.abs() > RANK_APART / 2 && self.is_beyond() && other.is_beyond() {
            // Their ranks say which one is larger, and not by how much.
            exponent = 2 * exponent.signum() * MOST_EXPONENT;
        }
        Self::scaled(self.mantissa / other.mantissa, exponent)
    }
}

impl Sum for Extended {
    fn sum<I: Iterator<Item = Self>>(numbers: I) -> Self {
        numbers.fold(Self::ZERO, |sum, number| sum + number)
    }
}

impl PartialOrd for Extended {
    #[inline]
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        let same_sign = self.mantissa * other.mantissa > 0.0 && self.is_finite() && other.is_finite();
        if !same_sign || self.exponent == other.exponent {
            return self.mantissa.partial_cmp(&other.mantissa);
        }
        let by_exponent = self.exponent.cmp(&other.exponent);
        Some(if self.mantissa > 0.0 { by_exponent } else { by_exponent.reverse() })
    }
}

impl Scalar for Extended {
    type Number = Self;
    const ZERO: Self = Self { mantissa: 0.0, exponent: 0 };
    const ONE: Self = Self { mantissa: 1.0, exponent: 0 };
    const LEAST_TOTAL: Self = Self::ZERO;
    #[inline]
    fn is_below(self, count: usize) -> bool {
        self.to_f64().is_below(count)
    }
    #[inline]
    fn from_f64(number: f64) -> Self {
        match number.is_subnormal() {
            true => Self::scaled(number * Self::power_of_two(54), -54),
            false => Self::scaled(number, 0),
        }
    }
    #[inline]
    fn to_f64(self) -> f64 {
        match self.exponent {
            -1022..=1023 => self.mantissa * Self::power_of_two(self.exponent),
            1024.. => self.mantissa * f64::INFINITY,
            // Rounded once if the result is subnormal.
            -1080..=-1023 => {
                self.mantissa * Self::power_of_two(self.exponent + 512) * Self::power_of_two(-512)
            }
            _ => self.mantissa * 0.0,
        }
    }
    fn widen(numbers: &[Self]) -> Cow<'_, [f64]> {
        numbers.iter().map(|number| number.to_f64()).collect()
    }
    #[inline]
    fn to_number(self) -> Self {
        self
    }
    #[inline]
    fn from_number(number: Self) -> Self {
        number
    }
    #[inline]
    fn absolute(self) -> Self {
        Self { mantissa: self.mantissa.abs(), exponent: self.exponent }
    }
    fn square_root(self) -> Self {
        let odd = self.exponent.rem_euclid(2);
        let mantissa = if odd == 1 { 2.0 * self.mantissa } else { self.mantissa };
        Self::scaled(mantissa.sqrt(), (self.exponent - odd) / 2)
    }
    fn round_down(self) -> Self {
        match self.exponent {
            ..-1 if self.mantissa < 0.0 => -Self::ONE,
            ..-1 => Self::ZERO,
            52.. => self,
            _ => self.in_f64(f64::floor),
        }
    }
    fn round(self) -> Self {
        if self.exponent >= 52 { self } else { self.in_f64(f64::round) }
    }
    fn exponential(self) -> Self {
        if self.exponent < -60 {
            return Self::ONE;
        }
        let x = self.to_f64();
        if self.exponent >= 120 && self.is_finite() {
            return if self.mantissa < 0.0 { self.below_all() } else { Self::scaled(f64::INFINITY, 0) };
        }
        if !x.is_finite() {
            return Self::scaled(if x < 0.0 { 0.0 } else { x }, 0);
        }
        let n = (x * std::f64::consts::LOG2_E).round();
        let rest = n.mul_add(-super::double::LN_2_LOW, n.mul_add(-super::double::LN_2_HIGH, x));
        match rest.abs() < LARGE_REST {
            true => Self::scaled(Scalar::exponential(rest), n as i128),
            false => Self::from_f64(rest).exponential().times_power_of_two(n as i128),
        }
    }
    fn natural_logarithm(self) -> Self {
        let ln = match self.is_ordinary() {
            true => Scalar::natural_logarithm(self.to_f64()),
            false => (self.exponent as f64)
                .mul_add(std::f64::consts::LN_2, Scalar::natural_logarithm(self.mantissa)),
        };
        Self::from_f64(ln)
    }
    fn binary_logarithm(self) -> Self {
        Self::from_f64(match self.is_ordinary() {
            true => self.to_f64().log2(),
            false => self.exponent as f64 + self.mantissa.log2(),
        })
    }
    fn normal_cumulative(self) -> Self {
        let x = self.to_f64();
        if x.is_nan() || x >= FAR_TAIL {
            return Self::from_f64(crate::operators::normal_cumulative(x));
        }
        if !x.is_finite() {
            return Self::ZERO;
        }
        // −x²/2 as −h²/2 − (x − h)(x + h)/2, h being x to 26 bits: the first square is exact. Where the square has no digits
        // after the point, one factor keeps the order.
        let h = if x > NO_DIGITS { f64::from_bits(x.to_bits() & !0x7FF_FFFF) } else { x };
        let exp = |x: f64, y: f64| (Self::from_f64(-0.5 * x) * Self::from_f64(y)).exponential();
        let bell = exp(h, h) * exp(x - h, x + h);
        let (mut term, mut series) = (1.0, 1.0);
        for k in 1..12 {
            term *= -f64::from(2 * k - 1) / (x * x);
            series += term;
        }
        bell * Self::from_f64(series / (-x * std::f64::consts::TAU.sqrt()))
    }
    fn mass(law: Mass, operands: [Self; OPERANDS]) -> Self {
        let (factor, exponent) = law.scaled(operands.map(Self::to_f64));
        Self::from_f64(factor) * Self::from_f64(exponent).exponential()
    }
    fn entropy_term(self) -> Self {
        let none = self <= Self::ZERO || self >= Self::from_f64(1.0);
        if none { Self::ZERO } else { -self * self.natural_logarithm() }
    }
    fn power(self, exponent: Self) -> Self {
        let power = self.to_f64().powf(exponent.to_f64());
        // Results in the range of f64, and powers of zero, negative or infinite numbers.
        if power.is_normal() && self.is_ordinary() || self.mantissa == 0.0 || !self.is_finite() {
            return Self::from_f64(power);
        }
        let size = (exponent * self.absolute().natural_logarithm()).exponential();
        let exponent = exponent.to_f64();
        match (self.mantissa > 0.0, exponent.fract() == 0.0, exponent.rem_euclid(2.0) == 1.0) {
            (true, ..) | (_, true, false) => size,
            (_, true, true) => -size,
            (_, false, _) => Self::from_f64(f64::NAN),
        }
    }
}

impl Number for Extended {
    #[inline]
    fn known(number: f64) -> Self {
        Self::from_f64(number)
    }
    #[inline]
    fn rounded(self) -> f64 {
        self.to_f64()
    }
    #[inline]
    fn is_zero(self) -> bool {
        self.mantissa == 0.0
    }
    fn unary(operator: Unary, x: Self) -> Self {
        super::unary(operator, x)
    }
    fn binary(operator: Binary, x: Self, y: Self) -> Self {
        super::binary(operator, x, y)
    }
    fn mass(law: Mass, operands: [Self; OPERANDS]) -> Self {
        <Self as Scalar>::mass(law, operands)
    }
}

#[cfg(test)]
mod tests;
