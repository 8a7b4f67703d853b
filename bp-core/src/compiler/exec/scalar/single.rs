//! The functions of f32.
//!
//! In: a number. Out: a number. Invariant: no branches and no calls; the relative error is below 4e-7 (tested), and that of
//! −p ln p below 2.5e-7 p + 2e-7 of the result.
//!
//! Logarithm and exponential: reduction to [√½, √2) and [−½ ln 2, ½ ln 2], then minimax polynomials with the
//! coefficients of S. Moshier's Cephes library. −p ln p: the same reduction, and a shorter minimax polynomial of ln(1 + f)/f,
//! weighted by f. erfc: the Chebyshev fit of Press et al., *Numerical Recipes*,
//! 2nd ed., section 6.2.

use super::Scalar;
use std::borrow::Cow;

/// ln 2, in two parts: the first is exact in few bits, so that n · LN_2_HIGH is exact.
const LN_2_HIGH: f32 = 0.693_359_4;
const LN_2_LOW: f32 = -2.121_944_4e-4;

/// Adding and subtracting this rounds to a whole number.
const ROUND: f32 = 12_582_912.0;

/// Fused multiply-add with one rounding: one instruction on every processor with AVX2, slow on others; the bits are the
/// same.
#[inline(always)]
fn polynomial<const N: usize>(x: f32, coefficients: [f32; N]) -> f32 {
    let mut sum = coefficients[0];
    for coefficient in &coefficients[1..] {
        sum = sum.mul_add(x, *coefficient);
    }
    sum
}

/// f and e of a normal x = (1 + f) · 2ᵉ with 1 + f in [√½, √2): subtracting the bits of √½ leaves the exponent in the high
/// bits.
#[inline(always)]
fn reduced(x: f32) -> (f32, f32) {
    let bits = x.to_bits() as i32;
    let raised = bits.wrapping_sub(std::f32::consts::FRAC_1_SQRT_2.to_bits() as i32) >> 23;
    (f32::from_bits(bits.wrapping_sub(raised << 23) as u32) - 1.0, raised as f32)
}

/// ln(x · 2ⁿ) of a normal x > 0.
#[inline(always)]
fn logarithm_of_normal(x: f32, n: f32) -> f32 {
    let (f, e) = reduced(x);
    let e = e + n;
    let coefficients = [
        7.037_683_6e-2,
        -1.151_461e-1,
        1.167_699_9e-1,
        -1.242_014_1e-1,
        1.424_932_3e-1,
        -1.666_805_8e-1,
        2.000_071_5e-1,
        -2.499_999_4e-1,
        3.333_333e-1,
    ];
    let square = f * f;
    let tail = polynomial(f, coefficients) * f * square + e * LN_2_LOW - 0.5 * square;
    (f + tail) + e * LN_2_HIGH
}

/// Below it the exponential would be subnormal, and is set to 0.
const SMALLEST: f32 = -87.3;

/// m and n of eˣ = m · 2ⁿ, of x not above 89; those of [`SMALLEST`] below it.
#[inline(always)]
fn exponential_parts(x: f32) -> (f32, i32) {
    let x = if x < SMALLEST { SMALLEST } else { x };
    // The whole number n is read from the low bits: a conversion would not be vectorised.
    let rounded = x * std::f32::consts::LOG2_E + ROUND;
    let (n, whole) = (rounded - ROUND, rounded.to_bits().wrapping_sub(ROUND.to_bits()) as i32);
    let x = (x - n * LN_2_HIGH) - n * LN_2_LOW;
    let coefficients = [1.987_569_1e-4, 1.398_199_9e-3, 8.333_452e-3, 4.166_579_6e-2, 1.666_666_5e-1, 0.5];
    (polynomial(x, coefficients) * x * x + x + 1.0, whole)
}

/// 2ⁿ, of n from −126 to 127.
#[inline(always)]
fn power_of_two(n: i32) -> f32 {
    f32::from_bits((n.wrapping_add(127) as u32) << 23)
}

impl Scalar for f32 {
    type Number = f64;
    const ZERO: f32 = 0.0;
    const ONE: f32 = 1.0;
    const LEAST_TOTAL: f32 = f32::from_bits((127 - 64) << 23);
    #[inline(always)]
    fn is_below(self, count: usize) -> bool {
        let (whole, last) = (self as i32, (count.min(1 << 31) as i64 - 1) as i32);
        (whole as f32 == self) & (whole >= 0) & (whole <= last)
    }
    #[inline(always)]
    fn is_below_infinity(self) -> bool {
        self <= f32::MAX
    }
    #[inline(always)]
    fn from_f64(number: f64) -> f32 {
        number as f32
    }
    #[inline(always)]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
    fn widen(numbers: &[f32]) -> Cow<'_, [f64]> {
        numbers.iter().copied().map(f64::from).collect()
    }
    #[inline(always)]
    fn to_number(self) -> f64 {
        f64::from(self)
    }
    #[inline(always)]
    fn from_number(number: f64) -> f32 {
        number as f32
    }
    #[inline(always)]
    fn absolute(self) -> f32 {
        self.abs()
    }
    #[inline(always)]
    fn square_root(self) -> f32 {
        self.sqrt()
    }
    #[inline(always)]
    fn round_down(self) -> f32 {
        self.floor()
    }

    #[inline(always)]
    fn exponential(self) -> f32 {
        // e⁸⁹ is infinite; NaN stays NaN.
        let x = if self > 89.0 { 89.0 } else { self };
        let (value, n) = exponential_parts(x);
        // Two multiplications, so that the last one makes the result infinite.
        let half = n >> 1;
        let value = value * power_of_two(half) * power_of_two(n.wrapping_sub(half));
        if self < SMALLEST { 0.0 } else { value }
    }

    #[inline(always)]
    fn natural_logarithm(self) -> f32 {
        // Subnormal numbers are scaled up first.
        let subnormal = self < f32::MIN_POSITIVE;
        let (x, more) = if subnormal { (self * 33_554_432.0, -25.0) } else { (self, 0.0) };
        let value = logarithm_of_normal(x, more);
        let value = if self == f32::INFINITY { self } else { value };
        if self > 0.0 {
            value
        } else if self == 0.0 {
            f32::NEG_INFINITY
        } else {
            f32::NAN
        }
    }

    #[inline(always)]
    fn entropy_term(self) -> f32 {
        // Of 0 the product is 0. The logarithm of a subnormal number is wrong, but the product is within f32's rounding of
        // 0. NaN stays NaN.
        let x = if self <= 0.0 { 0.0 } else { self };
        let (f, e) = reduced(x);
        // ln(1 + f)/f: an error of 2.1e-7 of the logarithm, which is multiplied by p.
        let coefficients =
            [0.118_274_82, -0.189_019_8, 0.206_046_73, -0.248_813_4, 0.333_033, -0.500_019_67, 1.000_003_2];
        let value = -x * f.mul_add(polynomial(f, coefficients), e * std::f32::consts::LN_2);
        if value < 0.0 { 0.0 } else { value }
    }

    #[inline(always)]
    fn normal_cumulative(self) -> f32 {
        let z = self.abs() * std::f32::consts::FRAC_1_SQRT_2;
        let t = 1.0 / (1.0 + 0.5 * z);
        let coefficients = [
            0.170_872_77,
            -0.822_152_23,
            1.488_515_9,
            -1.135_204,
            0.278_868_07,
            -0.186_288_06,
            0.096_784_18,
            0.374_091_96,
            1.000_023_7,
            -1.265_512_2,
        ];
        // The exponent is at most 0, up to rounding: the power of two is a normal number.
        let exponent = polynomial(t, coefficients) - z * z;
        let (value, n) = exponential_parts(exponent);
        let bell = if exponent < SMALLEST { 0.0 } else { value * power_of_two(n) };
        let half_tail = 0.5 * t * bell;
        if self < 0.0 { half_tail } else { 1.0 - half_tail }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Scalar;

    #[test]
    fn the_functions_of_f32_are_as_accurate_as_documented() {
        for step in 1..200_000 {
            let x = step as f32 * 1e-3;
            let ln = f64::from(x).ln();
            assert!((x.natural_logarithm().to_f64() - ln).abs() <= 4e-7 * ln.abs().max(1e-2), "ln {x}");
            let y = x * 0.8 - 80.0;
            let exp = f64::from(y).exp();
            assert!(
                (y.exponential().to_f64() / exp - 1.0).abs() <= 4e-7 + 1.2e-7 * f64::from(y.abs()),
                "exp {y}"
            );
        }
        assert_eq!(0f32.natural_logarithm(), f32::NEG_INFINITY);
        for subnormal in [1e-39f32, 3e-42, f32::from_bits(1)] {
            let ln = f64::from(subnormal).ln();
            assert!((subnormal.natural_logarithm().to_f64() / ln - 1.0).abs() < 4e-7, "ln {subnormal:e}");
        }
        for step in 0..=100_000 {
            let p = step as f32 * 1e-5;
            let exact = if p > 0.0 { -f64::from(p) * f64::from(p).ln() } else { 0.0 };
            let bound = 2.5e-7 * f64::from(p) + 2e-7 * exact;
            assert!((p.entropy_term().to_f64() - exact).abs() <= bound, "−p ln p at {p}");
        }
        assert!(f32::from_bits(1).entropy_term().abs() < 1e-40);
        assert_eq!((-1e30f32).exponential(), 0.0);
        for step in -800..800 {
            let x = step as f32 * 1e-2;
            let exact = crate::operators::normal_cumulative(f64::from(x));
            assert!((x.normal_cumulative().to_f64() - exact).abs() <= 4e-7, "Φ({x})");
        }
    }

    #[test]
    fn the_ends_are_those_of_the_c_library() {
        for x in [
            0.0f32,
            -0.0,
            1e-30,
            88.3,
            88.4,
            88.72,
            88.73,
            1e4,
            -87.2,
            -104.0,
            f32::INFINITY,
            f32::NEG_INFINITY,
        ] {
            let (found, exact) = (Scalar::exponential(x), x.exp());
            assert!(found == exact || (found / exact - 1.0).abs() < 1.2e-5, "exp {x}: {found}, not {exact}");
        }
        for x in [0.0f32, -0.0, 1.0, f32::MIN_POSITIVE, f32::MAX, f32::INFINITY] {
            let (found, exact) = (x.natural_logarithm(), x.ln());
            assert!(found == exact || (found / exact - 1.0).abs() < 4e-7, "ln {x}: {found}, not {exact}");
        }
        let functions = [Scalar::exponential, Scalar::natural_logarithm, Scalar::normal_cumulative];
        assert!(functions.iter().all(|function: &fn(f32) -> f32| function(f32::NAN).is_nan()));
        assert!((-1.0f32).natural_logarithm().is_nan());
        assert_eq!([f32::NEG_INFINITY, f32::INFINITY].map(Scalar::normal_cumulative), [0.0, 1.0]);
    }
}
