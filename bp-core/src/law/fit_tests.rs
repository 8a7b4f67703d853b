//! Fits against closed forms, against the gradient of the likelihood, and against the parameters of seeded draws.

use super::*;
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

/// Laws, the parameters drawn from, and how many of them are known.
const DRAWN: [(Law, &[f64], usize); 11] = [
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
            if fitted.len() - known == 2 {
                let other = known + (1 - (position - known));
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
    // An angle just left of the turn and one just right of it have their mean on it.
    let angles: Sample = [-0.1, 0.1 + std::f64::consts::TAU].into_iter().collect();
    assert!(Law::VonMises.fit(&angles, &[]).unwrap()[0].abs() < 1e-12);
}

#[test]
fn what_cannot_be_fitted_is_refused() {
    let same: Sample = [0.3, 0.3].into_iter().collect();
    for law in [Law::Uniform, Law::Normal, Law::Lognormal, Law::Gamma, Law::Beta, Law::VonMises, Law::Weibull]
    {
        assert_eq!(law.fit(&same, &[]), Err("needs values that differ"), "{law:?}");
    }
    let negative: Sample = [-1.0, 2.0].into_iter().collect();
    for law in [Law::Lognormal, Law::Exponential, Law::Gamma, Law::Beta, Law::Weibull, Law::Poisson] {
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
    for law in [Law::Normal, Law::Gamma, Law::Beta, Law::Weibull, Law::VonMises] {
        let fitted = law.fit(&forward, &[]).unwrap();
        assert_eq!(fitted, law.fit(&backward, &[]).unwrap());
        assert_eq!(fitted, law.fit(&weighed, &[]).unwrap());
    }
}
