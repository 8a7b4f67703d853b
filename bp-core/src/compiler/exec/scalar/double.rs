//! The functions of f64.
//!
//! In: a number. Out: a number. Invariant: exponential and logarithm have no branches and no calls, and are within 1.5
//! units of the last place (tested against the C library). Polynomials are fused: one rounding for each multiplication
//! and addition, on every processor.
//!
//! Exponential: x = n ln 2 + r, |r| ≤ ½ ln 2, and the series of eʳ up to r¹³ / 13!, whose remainder is 4·10⁻¹⁸.
//! Logarithm: reduction to [√½, √2), and the series of artanh up to s²¹, whose remainder is 10⁻¹⁸ of the sum.

use super::Scalar;
use std::borrow::Cow;

/// ln 2, in two parts: the first has so few bits that a whole multiple of it is exact.
pub(super) const LN_2_HIGH: f64 = f64::from_bits(0x3FE6_2E42_FEE0_0000);
pub(super) const LN_2_LOW: f64 = f64::from_bits(0x3DEA_39EF_3579_3C76);

/// Adding and subtracting this, 1.5 · 2⁵², rounds to a whole number.
const ROUND: f64 = 6_755_399_441_055_744.0;

/// 2⁵⁴
const SCALE: f64 = 18_014_398_509_481_984.0;

/// The bits of the exponent, and the sign.
const EXPONENT: u64 = 0xFFF0_0000_0000_0000;

/// 1 / 13!, 1 / 12! … 1 / 2!
const EXPONENTIAL: [f64; 12] = {
    let (mut coefficients, mut number, mut factorial) = ([0.0; 12], 0, 1.0);
    while number < 12 {
        factorial *= (number + 2) as f64;
        coefficients[11 - number] = 1.0 / factorial;
        number += 1;
    }
    coefficients
};

/// 2 / 21, 2 / 19 … 2 / 3
const LOGARITHM: [f64; 10] = {
    let (mut coefficients, mut number) = ([0.0; 10], 0);
    while number < 10 {
        coefficients[9 - number] = 2.0 / (2 * number + 3) as f64;
        number += 1;
    }
    coefficients
};

#[inline(always)]
fn polynomial<const N: usize>(x: f64, coefficients: [f64; N]) -> f64 {
    let mut sum = coefficients[0];
    for coefficient in &coefficients[1..] {
        sum = sum.mul_add(x, *coefficient);
    }
    sum
}

impl Scalar for f64 {
    type Number = f64;
    const ZERO: f64 = 0.0;
    const ONE: f64 = 1.0;
    const LEAST_TOTAL: f64 = f64::from_bits((1023 - 512) << 52);
    #[inline(always)]
    fn is_below(self, count: usize) -> bool {
        let (whole, last) = (self as i32, (count.min(1 << 31) as i64 - 1) as i32);
        (whole as f64 == self) & (whole >= 0) & (whole <= last)
    }
    #[inline(always)]
    fn is_below_infinity(self) -> bool {
        self <= f64::MAX
    }
    #[inline(always)]
    fn from_f64(number: f64) -> f64 {
        number
    }
    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }
    fn widen(numbers: &[f64]) -> Cow<'_, [f64]> {
        Cow::Borrowed(numbers)
    }
    #[inline(always)]
    fn to_number(self) -> f64 {
        self
    }
    #[inline(always)]
    fn from_number(number: f64) -> f64 {
        number
    }
    #[inline(always)]
    fn absolute(self) -> f64 {
        self.abs()
    }
    #[inline(always)]
    fn square_root(self) -> f64 {
        self.sqrt()
    }
    #[inline(always)]
    fn round_down(self) -> f64 {
        self.floor()
    }
    #[inline(always)]
    fn exponential(self) -> f64 {
        // e⁻⁷⁴⁶ is 0 and e⁷¹⁰ is infinite; NaN stays NaN.
        let x = if self < -746.0 { -746.0 } else { self };
        let x = if x > 710.0 { 710.0 } else { x };
        let rounded = x.mul_add(std::f64::consts::LOG2_E, ROUND);
        let (n, whole) = (rounded - ROUND, rounded.to_bits().wrapping_sub(ROUND.to_bits()) as i64);
        let r = n.mul_add(-LN_2_LOW, n.mul_add(-LN_2_HIGH, x));
        let value = 1.0 + (polynomial(r, EXPONENTIAL) * r).mul_add(r, r);
        // Two multiplications, so that the last one makes the result subnormal or infinite.
        let half = whole >> 1;
        let power = |n: i64| f64::from_bits(((n + 1023) as u64) << 52);
        value * power(half) * power(whole - half)
    }
    #[inline(always)]
    fn natural_logarithm(self) -> f64 {
        let subnormal = self < f64::MIN_POSITIVE;
        let (x, more) = if subnormal { (self * SCALE, -54.0) } else { (self, 0.0) };
        // x = m · 2ᵉ with m in [√½, √2): subtracting the bits of √½ leaves the exponent in the high bits.
        let raised = x.to_bits().wrapping_sub(std::f64::consts::FRAC_1_SQRT_2.to_bits()) & EXPONENT;
        let f = f64::from_bits(x.to_bits().wrapping_sub(raised)) - 1.0;
        // The exponent as a number; a conversion instruction would not be vectorised.
        let biased = f64::from_bits((raised >> 52) | ROUND.to_bits()) - ROUND;
        let e = (if biased > 2047.0 { biased - 4096.0 } else { biased }) + more;
        // ln(1 + f) = 2 artanh s with s = f / (2 + f), as f − (f²/2 − s (f²/2 + R)): so f, the largest part, is exact.
        let s = f / (2.0 + f);
        let (z, half) = (s * s, 0.5 * f * f);
        let r = polynomial(z, LOGARITHM) * z;
        let value = e.mul_add(LN_2_HIGH, f - (half - s.mul_add(half + r, e * LN_2_LOW)));
        let value = if self == f64::INFINITY { self } else { value };
        if self > 0.0 {
            value
        } else if self == 0.0 {
            f64::NEG_INFINITY
        } else {
            f64::NAN
        }
    }
    #[inline(always)]
    fn normal_cumulative(self) -> f64 {
        crate::operators::normal_cumulative(self)
    }
    #[inline(always)]
    fn entropy_term(self) -> f64 {
        let value = -self * self.natural_logarithm();
        if self <= 0.0 || self >= 1.0 { 0.0 } else { value }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Scalar;

    /// The distance of two numbers in units of the last place of the second.
    fn units(one: f64, other: f64) -> f64 {
        let unit = f64::from_bits(other.abs().to_bits() + 1) - other.abs();
        (one - other).abs() / unit
    }

    #[test]
    fn the_functions_of_f64_are_as_accurate_as_documented() {
        let (mut exponential, mut logarithm): (f64, f64) = (0.0, 0.0);
        for step in 0..2_000_000 {
            let x = f64::from(step) * 7.253e-4 - 741.0;
            exponential = exponential.max(units(Scalar::exponential(x), x.exp()));
            // Near 1, and over all exponents.
            for y in [f64::from(step + 1) * 1.3e-6, x.exp(), f64::from_bits(u64::from(step as u32) << 31)] {
                if y > 0.0 && y != 1.0 && y.is_finite() {
                    logarithm = logarithm.max(units(y.natural_logarithm(), y.ln()));
                }
            }
        }
        assert!(exponential <= 1.5, "{exponential} units of the last place");
        assert!(logarithm <= 1.5, "{logarithm} units of the last place");
    }

    #[test]
    fn the_ends_are_those_of_the_c_library() {
        for x in [
            0.0,
            -0.0,
            1e-300,
            709.782,
            709.79,
            1e4,
            -745.13,
            -745.14,
            -1e300,
            f64::INFINITY,
            f64::NEG_INFINITY,
        ] {
            let (found, exact) = (Scalar::exponential(x), x.exp());
            assert!(found == exact || units(found, exact) <= 1.5, "exp {x}: {found}, not {exact}");
        }
        for x in [0.0, -0.0, 1.0, f64::from_bits(1), f64::MIN_POSITIVE, f64::MAX, f64::INFINITY] {
            let (found, exact) = (x.natural_logarithm(), x.ln());
            assert!(found == exact || units(found, exact) <= 1.5, "ln {x}: {found}, not {exact}");
        }
        assert!(Scalar::exponential(f64::NAN).is_nan() && f64::NAN.natural_logarithm().is_nan());
        assert!((-1.0f64).natural_logarithm().is_nan());
        assert_eq!((0.0f64.entropy_term(), (-1.0f64).entropy_term()), (0.0, 0.0));
    }
}
