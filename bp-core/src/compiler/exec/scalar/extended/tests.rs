//! Numbers with separate exponents, against constants of mpmath 1.3 at 50 digits, and against f64 where it represents
//! them.

use super::{Extended, Scalar};

fn of(number: f64) -> Extended {
    Extended::from_f64(number)
}

/// |found / m 2ᵉ − 1|
fn error(found: Extended, mantissa: f64, exponent: i128) -> f64 {
    (found / Extended::scaled(mantissa, exponent)).to_f64() - 1.0
}

#[test]
fn ordinary_numbers_are_those_of_f64() {
    let numbers = [0.0, 1.0, -1.0, 1.5, -2.75, 1e-300, 3e300, 0.1, 7.0, 1e16, -1e-5, 1.0 + f64::EPSILON];
    for x in numbers {
        assert_eq!(of(x).to_f64(), x);
        for y in numbers {
            for (found, exact) in [(of(x) + of(y), x + y), (of(x) - of(y), x - y), (of(x) * of(y), x * y)] {
                assert!(exact.is_infinite() || exact == 0.0 || found.to_f64() == exact, "{x} {y}: {found:?}");
            }
            assert_eq!(of(x).partial_cmp(&of(y)), x.partial_cmp(&y), "{x} {y}");
            if y != 0.0 {
                let (found, exact) = (of(x) / of(y), x / y);
                assert!(!exact.is_normal() || found.to_f64() == exact, "{x} {y}: {found:?}");
            }
        }
        assert_eq!(of(x).round_down().to_f64(), x.floor(), "{x}");
        assert_eq!(of(x).round().to_f64(), x.round(), "{x}");
        if x >= 0.0 {
            assert_eq!(of(x).square_root().to_f64(), x.sqrt(), "{x}");
        }
    }
    let tiny = f64::from_bits(3);
    assert_eq!(of(tiny).to_f64(), tiny);
    assert!(of(f64::NAN).to_f64().is_nan() && of(f64::INFINITY).to_f64().is_infinite());
    assert!((of(f64::INFINITY) - of(f64::INFINITY)).to_f64().is_nan());
    assert!(of(f64::NEG_INFINITY) < of(-1e300) && of(1e300) < of(f64::INFINITY));
    assert_eq!(of(f64::NAN).partial_cmp(&of(1.0)), None);
}

#[test]
fn zeros_have_the_signs_of_f64() {
    for (x, y) in [(0.0, 0.0), (0.0, -0.0), (-0.0, 0.0), (-0.0, -0.0f64)] {
        assert_eq!((of(x) + of(y)).to_f64().to_bits(), (x + y).to_bits(), "{x} + {y}");
        assert_eq!((of(x) - of(y)).to_f64().to_bits(), (x - y).to_bits(), "{x} - {y}");
    }
}

#[test]
fn exponents_do_not_end() {
    // mpmath: exp(x) = m · 2ᵉ, with e = floor(log(exp(x), 2)).
    let constants = [
        (-1e6, 1.944_111_598_172_928_6, -1_442_696),
        (-1000.5, 1.498_596_088_079_077_9, -1444),
        (12345.678, 1.034_136_776_978_199_5, 17811),
    ];
    for (x, mantissa, exponent) in constants {
        let found = of(x).exponential();
        // The only error is that of rounding x.
        assert!(error(found, mantissa, exponent).abs() < 2e-16 * f64::max(10.0, x.abs()), "{x}: {found:?}");
        assert!((found.natural_logarithm().to_f64() - x).abs() <= 4e-16 * x.abs(), "{x}");
    }
    let product = (0..100_000).fold(Extended::ONE, |product, _| product * of(1e-300));
    assert!((product.natural_logarithm().to_f64() / (-30e6 * std::f64::consts::LN_10) - 1.0).abs() < 1e-15);
    assert_eq!((product / product).to_f64(), 1.0);
    assert_eq!((product * product * of(0.0)).to_f64(), 0.0);
    assert_eq!((product, of(1.0) + product), (product + of(0.0), of(1.0)));
    assert!(product > Extended::ZERO && product * product < product && -product < product);
    assert_eq!((product.to_f64(), (Extended::ONE / product).to_f64()), (0.0, f64::INFINITY));
    // mpmath: exp(-5e19), whose exponent exceeds i64.
    assert!(error(of(-5e19).exponential(), 1.0026137675087634, -72134752044448170368).abs() < 1e-5);
    let small = of(-1e35).exponential();
    assert!(small > Extended::ZERO && !small.is_beyond(), "{small:?}");
    assert!((small.natural_logarithm().to_f64() / -1e35 - 1.0).abs() < 1e-15);
    assert!(of(-1e40).exponential().is_beyond() && of(-1e200).normal_cumulative().is_beyond());
    assert_eq!(of(f64::NEG_INFINITY).exponential(), Extended::ZERO);
    assert!(!of(1e40).exponential().is_finite());
    assert_eq!(of(1e-30).exponential(), Extended::ONE);
}

#[test]
fn far_tails_of_the_normal_law() {
    // mpmath: log(erfc(-x / sqrt(2)) / 2)
    let constants =
        [(-36.5, -670.642_000_000_313_7), (-37.0, -689.030_585_576_890_6), (-100.0, -5_005.524_208_694_205)];
    for (x, ln) in constants {
        let found = of(x).normal_cumulative();
        // ln Φ with a relative error of 1e-13 gives Φ to 1e-10.
        assert!((found.natural_logarithm().to_f64() - ln).abs() < 1e-12, "{x}: {found:?}");
    }
    let far = of(-1000.125).normal_cumulative().natural_logarithm().to_f64();
    assert!((far + 500_132.834_632_304_1).abs() < 1e-9, "{far}");
    assert_eq!(of(f64::NEG_INFINITY).normal_cumulative(), Extended::ZERO);
    assert_eq!(of(1.0).normal_cumulative().to_f64(), crate::operators::normal_cumulative(1.0));
}

#[test]
fn powers_go_beyond_f64() {
    // 10⁻⁴⁰⁰ and (−10)⁴⁰¹, by logarithms.
    let ln_ten = std::f64::consts::LN_10;
    let small = of(1e-100).power(of(4.0)).natural_logarithm().to_f64();
    assert!((small + 400.0 * ln_ten).abs() < 1e-12 * 400.0 * ln_ten, "{small}");
    let odd = of(-10.0).power(of(401.0));
    assert!(odd < Extended::ZERO, "{odd:?}");
    assert!(((-odd).natural_logarithm().to_f64() - 401.0 * ln_ten).abs() < 1e-9);
    assert_eq!(of(2.0).power(of(0.5)).to_f64(), 2f64.powf(0.5));
    assert_eq!(of(0.0).power(of(2.0)), Extended::ZERO);
    assert!(of(-1e300).power(of(1.5)).to_f64().is_nan());
}
