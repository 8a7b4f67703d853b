//! Fits against closed forms, against the gradient of the likelihood, and against the parameters of seeded draws.

use super::*;
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

/// Laws, the parameters drawn from, and the number of known ones.
const DRAWN: [(Law, &[f64], usize); 17] = [
    (Law::Normal, &[1.5, 0.7], 0),
    (Law::Lognormal, &[0.3, 0.5], 0),
    (Law::Exponential, &[2.5], 0),
    (Law::Gamma, &[2.5, 1.7], 0),
    (Law::Gamma, &[0.6, 3.0], 0),
    (Law::Beta, &[2.0, 5.0], 0),
    (Law::Beta, &[0.7, 0.9], 0),
    (Law::VonMises, &[0.4, 3.0], 0),
    (Law::Weibull, &[1.8, 2.0], 0),
    (Law::Binomial, &[12.0, 0.3], 1),
    (Law::Poisson, &[4.2], 0),
    (Law::HalfNormal, &[1.3], 0),
    (Law::HalfCauchy, &[0.6], 0),
    (Law::StudentT, &[4.0, 0.5, 0.8], 0),
    (Law::Cauchy, &[-0.4, 0.5], 0),
    (Law::NegativeBinomial, &[2.5, 0.4], 0),
    (Law::Geometric, &[0.35], 0),
];

fn drawn(law: Law, parameters: &[f64], count: usize) -> Sample {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(11);
    (0..count).map(|_| law.draw(&mut generator, parameters)).collect()
}

/// E[ln f(x)] over a sample.
fn ln_likelihood(law: Law, sample: &Sample, parameters: &[f64]) -> f64 {
    sample.mean_of(|x| law.ln_density(&mut Numbers, x, parameters))
}

#[test]
fn the_likelihood_is_flat_at_the_fit_and_curves_down() {
    for (law, parameters, known) in DRAWN {
        let sample = drawn(law, parameters, 500);
        let fitted = law.fit(&sample, &parameters[..known]).unwrap();
        for position in known..fitted.len() {
            let step = 1e-4 * fitted[position].abs().max(0.1);
            let at = |offset: f64| {
                let mut moved = fitted.clone();
                moved[position] += offset;
                ln_likelihood(law, &sample, &moved)
            };
            let (below, here, above) = (at(-step), at(0.0), at(step));
            // The third derivative leaves a slope of the order of step² behind.
            let slope = (above - below) / (2.0 * step) * fitted[position].abs().max(0.1);
            assert!(slope.abs() < 1e-6, "{law:?} parameter {position}: slope {slope}");
            assert!(here > below && here > above, "{law:?} parameter {position} is no maximum");
        }
    }
}

#[test]
fn parameters_come_back_from_draws() {
    for (law, parameters, known) in DRAWN {
        let count = 20_000;
        let sample = drawn(law, parameters, count);
        let fitted = law.fit(&sample, &parameters[..known]).unwrap();
        // The variance of an estimate is that of the inverse Fisher information, here measured on the sample itself.
        for position in known..fitted.len() {
            let step = 1e-3 * fitted[position].abs().max(0.1);
            let at = |first: f64, second: usize, by: f64| {
                let mut moved = fitted.clone();
                moved[position] += first;
                moved[second] += by;
                ln_likelihood(law, &sample, &moved)
            };
            let here = at(0.0, position, 0.0);
            let bend = |one: usize| {
                let step = 1e-3 * fitted[one].abs().max(0.1);
                (2.0 * here - at(0.0, one, step) - at(0.0, one, -step)) / (step * step)
            };
            let mut information = bend(position);
            // Location and the others have no information in common.
            let related = match law {
                Law::StudentT if position == 1 => None,
                Law::StudentT => Some(2 - position),
                _ if fitted.len() - known == 2 => Some(known + (1 - (position - known))),
                _ => None,
            };
            if let Some(other) = related {
                let wide = 1e-3 * fitted[other].abs().max(0.1);
                let cross = (at(step, other, wide) - at(step, other, -wide) - at(-step, other, wide)
                    + at(-step, other, -wide))
                    / (4.0 * step * wide);
                information -= cross * cross / bend(other);
            }
            let deviation = 1.0 / (information * count as f64).sqrt();
            let error = (fitted[position] - parameters[position]).abs();
            assert!(
                error < 4.0 * deviation,
                "{law:?} {fitted:?} {parameters:?}: {error} against {deviation}"
            );
        }
    }
}

#[test]
fn closed_forms_are_those_of_the_book() {
    let sample: Sample = [12.0, 23.0, 57.0, -30.0, -46.0, 78.0].into_iter().collect();
    let normal = Law::Normal.fit(&sample, &[]).unwrap();
    assert!((normal[0] - 47.0 / 3.0).abs() < 1e-13 && (normal[1] - 43.8736).abs() < 5e-5, "{normal:?}");
    let waits: Sample = [1.0, 2.0, 3.0].into_iter().collect();
    assert_eq!(Law::Exponential.fit(&waits, &[]).unwrap(), [0.5]);
    assert_eq!(Law::Poisson.fit(&waits, &[]).unwrap(), [2.0]);
    assert_eq!(Law::Uniform.fit(&waits, &[]).unwrap(), [1.0, 3.0]);
    assert_eq!(Law::Binomial.fit(&waits, &[4.0]).unwrap(), [4.0, 0.5]);
    // Angles just left and just right of the full turn have their mean at the turn.
    let angles: Sample = [-0.1, 0.1 + std::f64::consts::TAU].into_iter().collect();
    assert!(Law::VonMises.fit(&angles, &[]).unwrap()[0].abs() < 1e-12);
}

/// Laws, samples, and the parameters of maximum likelihood by mpmath (40 digits, `findroot` on the equations).
const SOLVED: [(Law, &[f64], &[f64]); 13] = [
    (Law::Gamma, &NEAR, &[181201.3166645217, 601997.7297824641]),
    (Law::Beta, &NEAR, &[126659.93779450854, 294137.1977364938]),
    (Law::Weibull, &NEAR, &[475.5569515664736, 0.3013509831998052]),
    (Law::VonMises, &[0.3, 0.302, 0.304, 0.306, 0.308], &[0.304, 125000.39166825479]),
    (Law::Gamma, &FAR, &[0.0014392664348443721, 1.0074865043910606e-302]),
    (Law::Weibull, &FAR, &[0.0024125763229428253, 3.1673939271068345e+99]),
    (Law::HalfNormal, &POSITIVE, &[34.06676742599953]),
    (Law::HalfCauchy, &POSITIVE, &[0.9358619993061712]),
    (Law::StudentT, &HEAVY, &[2.216243335199367, 0.2142368881757348, 1.1454166995478494]),
    (Law::Cauchy, &HEAVY, &[0.24576049365989422, 0.8037353284287124]),
    (Law::Laplace, &HEAVY, &[0.25, 1.3611111111111112]),
    (Law::NegativeBinomial, &COUNTS, &[0.802000887928573, 0.17096988547718364]),
    (Law::Geometric, &COUNTS, &[0.20454545454545456]),
];

const NEAR: [f64; 5] = [0.3, 0.3005, 0.301, 0.3015, 0.302];
const FAR: [f64; 7] = [1e-300, 1e-200, 1e-100, 1.0, 1e100, 1e200, 1e300];

const POSITIVE: [f64; 7] = [0.0, 0.25, 0.5, 1.0, 1.5, 4.5, 90.0];
const HEAVY: [f64; 9] = [-3.0, -1.25, -0.5, 0.0, 0.25, 0.5, 1.0, 1.5, 4.5];
const COUNTS: [f64; 9] = [0.0, 0.0, 1.0, 1.0, 2.0, 3.0, 5.0, 9.0, 14.0];

#[test]
fn narrow_and_wide_samples_have_the_parameters_of_mpmath() {
    for (law, numbers, expected) in SOLVED {
        let fitted = law.fit(&numbers.iter().copied().collect(), &[]).unwrap();
        for (found, expected) in fitted.iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 1e-7, "{law:?}: {fitted:?}, expected {expected}");
        }
    }
}

#[test]
fn a_weibull_law_of_one_value_and_a_trace_of_a_larger_one_is_fitted() {
    // By hand: x = 1 of weight 1 and x = e of weight w. w eᵏ / (1 + w eᵏ) = 1/k + w, so that w eᵏ = 1/(k − 1) but for terms
    // in w.
    let mut sample = Sample::default();
    sample.add(1.0, 1.0);
    sample.add(std::f64::consts::E, 1e-30);
    let k = (0..200).fold(60.0_f64, |k, _| 30.0 * std::f64::consts::LN_10 - (k - 1.0).ln());
    let fitted = Law::Weibull.fit(&sample, &[]).unwrap();
    assert!((fitted[0] / k - 1.0).abs() < 1e-9, "{fitted:?}, expected {k}");
}

#[test]
fn no_shape_is_larger_than_the_most() {
    // Deviations of 10⁻⁸ of the mean: the best shapes are far above 10⁶.
    let sample: Sample = (0..5).map(|step| 0.3 * (1.0 + 1e-8 * f64::from(step))).collect();
    let gamma = Law::Gamma.fit(&sample, &[]).unwrap();
    assert!(gamma[0] == 1e6 && (gamma[1] * 0.300000006 / 1e6 - 1.0).abs() < 1e-14, "{gamma:?}");
    let beta = Law::Beta.fit(&sample, &[]).unwrap();
    assert!((beta[0] + beta[1] - 1e6).abs() < 1e-6 && (beta[0] - 300_000.006).abs() < 1e-6, "{beta:?}");
    assert_eq!(Law::VonMises.fit(&sample, &[]).unwrap()[1], 1e6);
    // mpmath: the scale that is likeliest with that shape, (mean of x^k)^(1/k).
    let weibull = Law::Weibull.fit(&sample, &[]).unwrap();
    assert!(weibull[0] == 1e6 && (weibull[1] / 0.3000000060299993 - 1.0).abs() < 1e-14, "{weibull:?}");
}

#[test]
fn samples_that_cannot_be_fitted_are_refused() {
    let same: Sample = [0.3, 0.3].into_iter().collect();
    for law in [Law::Uniform, Law::Normal, Law::Lognormal, Law::Gamma, Law::Beta, Law::VonMises, Law::Weibull]
    {
        assert_eq!(law.fit(&same, &[]), Err("needs values that differ"), "{law:?}");
    }
    let negative: Sample = [-1.0, 2.0].into_iter().collect();
    for law in [Law::Cauchy, Law::Laplace, Law::StudentT] {
        assert_eq!(law.fit(&same, &[]), Err("needs values that differ"), "{law:?}");
    }
    for law in [Law::Lognormal, Law::Exponential, Law::Gamma, Law::Beta, Law::Weibull, Law::Poisson]
        .into_iter()
        .chain([Law::HalfNormal, Law::HalfCauchy, Law::Geometric, Law::NegativeBinomial])
    {
        assert!(law.fit(&negative, &[]).is_err(), "{law:?}");
    }
    for law in Law::ALL {
        assert!(law.fit(&Sample::default(), &[3.0]).is_err(), "{law:?} of nothing");
    }
}

#[test]
fn weights_are_repetitions_and_order_leaves_no_trace() {
    let numbers = [0.4, 0.1, 0.7, 0.1, 0.4, 0.4, 0.2];
    let forward: Sample = numbers.into_iter().collect();
    let backward: Sample = numbers.into_iter().rev().collect();
    let mut weighed = Sample::default();
    for (number, weight) in [(0.1, 2.0), (0.2, 1.0), (0.4, 3.0), (0.7, 1.0)] {
        weighed.add(number, weight);
    }
    for law in [Law::Normal, Law::Gamma, Law::Beta, Law::Weibull, Law::VonMises, Law::StudentT, Law::Laplace]
    {
        let fitted = law.fit(&forward, &[]).unwrap();
        assert_eq!(fitted, law.fit(&backward, &[]).unwrap());
        assert_eq!(fitted, law.fit(&weighed, &[]).unwrap());
    }
}
