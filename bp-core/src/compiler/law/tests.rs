//! Laws against statrs, against quadrature of their own density, and against their own draws.

use super::*;
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;
use statrs::distribution::{self as oracle, Continuous, ContinuousCDF, Discrete, DiscreteCDF};

/// The parameters at which each law is tested.
fn cases() -> Vec<(Law, Vec<f64>)> {
    vec![
        (Law::Uniform, vec![-2.0, 3.0]),
        (Law::Normal, vec![1.5, 0.7]),
        (Law::Lognormal, vec![0.3, 0.5]),
        (Law::Exponential, vec![2.5]),
        (Law::Gamma, vec![2.5, 1.7]),
        (Law::Gamma, vec![1.0, 3.0]),
        (Law::Beta, vec![2.0, 5.0]),
        (Law::Beta, vec![1.0, 1.0]),
        (Law::VonMises, vec![0.4, 3.0]),
        (Law::VonMises, vec![0.4, 0.01]),
        (Law::VonMises, vec![0.0, 500.0]),
        (Law::Weibull, vec![1.8, 2.0]),
        (Law::Binomial, vec![12.0, 0.3]),
        (Law::Binomial, vec![3.0, 1.0]),
        (Law::Poisson, vec![4.2]),
        (Law::HalfNormal, vec![1.3]),
        (Law::HalfCauchy, vec![0.6]),
        (Law::StudentT, vec![7.0, 0.5, 0.8]),
        (Law::StudentT, vec![0.7, 0.0, 1.0]),
        (Law::Cauchy, vec![-0.4, 0.5]),
        (Law::Laplace, vec![0.5, 0.7]),
        (Law::NegativeBinomial, vec![2.5, 0.4]),
        (Law::NegativeBinomial, vec![3.0, 1.0]),
        (Law::Geometric, vec![0.35]),
        (Law::Geometric, vec![1.0]),
    ]
}

/// In 40 digits (mpmath 1.3): closed forms with ψ, ln Γ and Bessel functions, or quadrature of −p ln p.
#[test]
fn entropies_have_their_known_values() {
    for (law, parameters, entropy) in [
        (Law::Uniform, vec![-2.0, 3.0], 5f64.ln()),
        (Law::Normal, vec![1.5, 0.7], 1.062_263_589_265_940_5),
        (Law::Lognormal, vec![0.3, 0.5], 1.025_791_352_644_727_4),
        (Law::Exponential, vec![2.5], 1.0 - 2.5f64.ln()),
        (Law::Gamma, vec![2.5, 1.7], 1.199_319_658_442_884),
        (Law::Gamma, vec![1e6, 2.0], 7.633_546_298_293_448),
        (Law::Beta, vec![0.5, 3.0], -1.108_050_201_102_210_1),
        (Law::Beta, vec![2e7, 3e7], -8.158_386_437_422_722),
        (Law::StudentT, vec![7.0, 0.5, 0.8], 1.343_234_710_403_395_3),
        (Law::StudentT, vec![1e6, 0.0, 1.0], 1.418_939_533_204_922_7),
        (Law::Weibull, vec![1.8, 2.0], 1.361_900_811_169_618_7),
        (Law::VonMises, vec![0.4, 3.0], 0.993_228_806_353_252_8),
        (Law::VonMises, vec![0.4, 500.0], -1.687_864_763_914_924_3),
        (Law::VonMises, vec![0.4, 1e6], -5.488_816_495_777_277),
        (Law::Poisson, vec![4.2], 2.112_587_184_713_986),
        (Law::Geometric, vec![0.35], 1.849_847_540_098_95),
        (Law::Laplace, vec![0.5, 0.7], 1.336_472_236_621_213),
        (Law::HalfNormal, vec![1.3], 0.988_155_617_112_218_5),
        (Law::HalfCauchy, vec![0.6], 1.327_051_442_643_354_8),
        (Law::Cauchy, vec![-0.4, 0.5], 1.837_877_066_409_345_5),
    ] {
        let found = law.entropy(&parameters);
        assert!((found - entropy).abs() < 3e-14 * entropy.abs().max(1.0), "{law:?} {parameters:?}: {found}");
    }
}

/// No value near the mode has a larger density, and none of a grid.
#[test]
fn modes_have_the_largest_density() {
    for (law, parameters) in cases() {
        let Some((mode, largest)) = law.largest_density(&parameters) else { continue };
        let step = if law.support() == Support::Counts { 1.0 } else { 1e-3 };
        for away in (-3000..=3000).map(f64::from) {
            let other = law.density(mode + away * step, &parameters);
            assert!(other <= largest * (1.0 + 1e-12), "{law:?} {parameters:?}: {mode}, {away}");
        }
    }
    // The limit at an end of the support: r of a gamma law of shape 1, a of beta(a, 1); none below 1.
    let (at, density) = Law::Gamma.largest_density(&[1.0, 3.0]).unwrap();
    assert!(at == 0.0 && (density - 3.0).abs() < 1e-14, "{at} {density}");
    let (at, density) = Law::Beta.largest_density(&[3.0, 1.0]).unwrap();
    assert!(at == 1.0 && (density - 3.0).abs() < 1e-14, "{at} {density}");
    for (law, parameters) in [(Law::Gamma, [0.5, 1.0]), (Law::Weibull, [0.9, 2.0]), (Law::Beta, [0.5, 1.0])] {
        assert_eq!(law.largest_density(&parameters), Some((0.0, f64::INFINITY)));
    }
}

/// Density and cumulative distribution from statrs.
fn known(law: Law, x: f64, p: &[f64]) -> Option<(f64, f64)> {
    fn real(law: impl Continuous<f64, f64> + ContinuousCDF<f64, f64>, x: f64) -> Option<(f64, f64)> {
        Some((law.pdf(x), law.cdf(x)))
    }
    fn count(law: impl Discrete<u64, f64> + DiscreteCDF<u64, f64>, x: f64) -> Option<(f64, f64)> {
        let inside = x >= 0.0 && x.fract() == 0.0;
        let below = if x < 0.0 { 0.0 } else { law.cdf(x as u64) };
        Some((if inside { law.pmf(x as u64) } else { 0.0 }, below))
    }
    match law {
        Law::Uniform => real(oracle::Uniform::new(p[0], p[1]).unwrap(), x),
        Law::Normal => real(oracle::Normal::new(p[0], p[1]).unwrap(), x),
        Law::Lognormal => real(oracle::LogNormal::new(p[0], p[1]).unwrap(), x),
        Law::Exponential => real(oracle::Exp::new(p[0]).unwrap(), x),
        Law::Gamma => real(oracle::Gamma::new(p[0], p[1]).unwrap(), x),
        Law::Beta => real(oracle::Beta::new(p[0], p[1]).unwrap(), x),
        Law::Weibull => real(oracle::Weibull::new(p[0], p[1]).unwrap(), x),
        Law::Binomial => count(oracle::Binomial::new(p[1], p[0] as u64).unwrap(), x),
        Law::Poisson => count(oracle::Poisson::new(p[0]).unwrap(), x),
        // Held to constants of 50 digits, in `tests/laws/special_functions`.
        _ => None,
    }
}

fn points(law: Law) -> Vec<f64> {
    match law.support() {
        Support::Counts => (-2..20).map(f64::from).chain([0.5]).collect(),
        Support::UnitInterval => (-2..=22).map(|step| f64::from(step) / 20.0 + 0.013).collect(),
        _ => (-40..80).map(|step| f64::from(step) / 10.0 + 0.013).collect(),
    }
}

#[test]
fn densities_and_cumulatives_are_those_of_statrs() {
    for (law, parameters) in cases() {
        for x in points(law) {
            let Some((density, cumulative)) = known(law, x, &parameters) else { continue };
            let (found, below) = (law.density(x, &parameters), law.cumulative(x, &parameters));
            assert!(
                (found - density).abs() <= 1e-11 * density.max(1e-3),
                "{law:?} density at {x}: {found} {density}"
            );
            assert!((below - cumulative).abs() <= 1e-10, "{law:?} cumulative at {x}: {below} {cumulative}");
        }
    }
}

/// ∫ g(x) f(x) dx between two bounds, by the midpoint rule.
fn integral(law: Law, parameters: &[f64], from: f64, to: f64, g: impl Fn(f64) -> f64) -> f64 {
    let steps = 400_000;
    let width = (to - from) / f64::from(steps);
    let middle = |step: i32| from + width * (f64::from(step) + 0.5);
    (0..steps).map(|step| g(middle(step)) * law.density(middle(step), parameters) * width).sum()
}

fn range(law: Law, parameters: &[f64]) -> (f64, f64) {
    match (law, law.support()) {
        (Law::VonMises, _) => (parameters[0] - std::f64::consts::PI, parameters[0] + std::f64::consts::PI),
        (Law::StudentT, _) => (-200.0, 200.0),
        (_, Support::Reals) => (-10.0, 12.0),
        (_, Support::UnitInterval) => (0.0, 1.0),
        _ => (0.0, 60.0),
    }
}

#[test]
fn moments_are_those_of_the_density() {
    for (law, parameters) in cases().into_iter().filter(|(law, p)| law.variance(p).is_finite()) {
        let (mean, variance) = (law.mean(&parameters), law.variance(&parameters));
        let expect = |g: &dyn Fn(f64) -> f64| match law.support() {
            Support::Counts => (0..200).map(f64::from).map(|x| g(x) * law.density(x, &parameters)).sum(),
            _ => {
                let (from, to) = range(law, &parameters);
                integral(law, &parameters, from, to, g)
            }
        };
        assert!((expect(&|_| 1.0) - 1.0).abs() < 2e-5, "{law:?} sums to one");
        assert!((expect(&|x| x) - mean).abs() < 1e-4, "{law:?} mean");
        let spread = match law {
            Law::VonMises => expect(&|x| 1.0 - (x - mean).cos()),
            _ => expect(&|x| (x - mean).powi(2)),
        };
        assert!((spread - variance).abs() < 1e-4 * variance.max(1.0), "{law:?} variance {spread} {variance}");
    }
}

#[test]
fn masses_are_differences_of_the_cumulative() {
    for (law, parameters) in cases() {
        for (low, high) in [(-3.0, 0.4), (0.2, 0.9), (1.0, 4.0)] {
            // A mass of von Mises goes round, its cumulative distribution begins half a turn before the mean.
            let (low, high) = match law {
                Law::VonMises => (f64::max(low, parameters[0] - 3.0), f64::min(high, parameters[0] + 3.0)),
                _ => (low, high),
            };
            let Some(mass) = law.mass(&mut Numbers, low, high, &parameters) else { continue };
            let expected = law.cumulative(high, &parameters) - law.cumulative(low, &parameters);
            assert!((mass - expected).abs() < 1e-14, "{law:?} ]{low}, {high}]: {mass} {expected}");
        }
    }
    // Thirty deviations above the mean, where 1 − Φ has no digits left: φ(30)/30 (1 − 1/900 + …) = 4.906713927e-198.
    let mass = Law::Normal.mass(&mut Numbers, 30.0, 40.0, &[0.0, 1.0]).unwrap();
    assert!((mass / 4.906_713_927_148_187e-198 - 1.0).abs() < 1e-9, "{mass:e}");
}

#[test]
fn the_von_mises_cumulative_is_the_integral_of_its_density() {
    for parameters in [[0.4, 3.0], [-2.0, 0.1], [0.0, 50.0]] {
        let from = parameters[0] - std::f64::consts::PI;
        for x in [from + 0.3, from + 2.0, from + 3.1, from + 6.0] {
            let expected = integral(Law::VonMises, &parameters, from, x, |_| 1.0);
            assert!((Law::VonMises.cumulative(x, &parameters) - expected).abs() < 1e-8, "{x}");
        }
    }
}

#[test]
fn draws_follow_the_cumulative() {
    // Kolmogorov–Smirnov: sup |F̂ − F| < 1.95/√n with probability 0.999.
    for (law, parameters) in cases() {
        let mut generator = Xoshiro256PlusPlus::seed_from_u64(7);
        let mut draws: Vec<f64> = (0..4000).map(|_| law.draw(&mut generator, &parameters)).collect();
        draws.sort_by(f64::total_cmp);
        let mut distance: f64 = 0.0;
        for (position, x) in draws.iter().enumerate() {
            let last = draws.get(position + 1).is_none_or(|next| next > x);
            if last {
                let empirical = (position + 1) as f64 / draws.len() as f64;
                distance = distance.max((empirical - law.cumulative(*x, &parameters)).abs());
            }
        }
        assert!(distance < 1.95 / (draws.len() as f64).sqrt(), "{law:?} {parameters:?}: {distance}");
    }
}

/// √κ (x − m) is standard normal where κ is large: its square has mean 1 and variance 2.
#[test]
fn draws_of_a_very_concentrated_angle() {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(3);
    assert!(Law::VonMises.draw(&mut generator, &[0.0, f64::MAX]).abs() < 1e-148);
    for concentration in [1e16, 1e200, 1e300] {
        let mut generator = Xoshiro256PlusPlus::seed_from_u64(3);
        let squares = (0..4000).map(|_| {
            let angle = Law::VonMises.draw(&mut generator, &[0.0, concentration]);
            (angle * concentration.sqrt()).powi(2)
        });
        let mean = squares.sum::<f64>() / 4000.0;
        assert!((mean - 1.0).abs() < 4.0 * (2.0 / 4000.0f64).sqrt(), "{concentration:e}: {mean}");
    }
}

#[test]
fn parameters_are_checked() {
    assert_eq!(Law::Normal.refuses(&[0.0, 0.0]), Some((1, "greater than 0")));
    assert_eq!(Law::Normal.refuses(&[f64::NAN, 1.0]), Some((0, "a finite number")));
    assert_eq!(Law::Uniform.refuses(&[1.0, 1.0]), Some((1, "greater than the first")));
    assert_eq!(Law::Binomial.refuses(&[2.5, 0.1]), Some((0, "a whole number, not negative")));
    assert_eq!(Law::Binomial.refuses(&[2.0, 0.1]), None);
    assert_eq!(Law::named("von_mises"), Some(Law::VonMises));
}
