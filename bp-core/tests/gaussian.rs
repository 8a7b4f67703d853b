//! Linear and Gaussian programs: published vestibular figures, and posteriors by hand.
//!
//! In: programs written here, parameters, observations. Out: beliefs of the closed-form filter. Invariant: the
//! gains, decay and response are those of Laurens and Angelaki (eLife 6:e28074, 2017); the time constant is
//! τ_c · sqrt(1 + σ_Ω² / σ_V²).

mod support;

use bp_core::answer::{Figure, ask};
use bp_core::error::Error;
use bp_core::exec::{Filter, Inputs};
use bp_core::model::Model;
use bp_core::plan::{Gaussian, Options, Route, plan};
use statrs::distribution::{Continuous, Normal};
use support::{model_of, question};

const YAW: &str = "program Yaw over t in Time {
    parameters { sigma_omega : real = 0.7; sigma_v : real = 0.175; tau_c : real = 4; dt : real = 0.01; }
    variables { Omega, C, V : real; }
    decomposition { P(Omega) P(C | C^-1 Omega) P(V | Omega C) }
    forms {
        P(Omega) = normal(0, sigma_omega);
        P(C | C^-1 Omega) = dirac((tau_c * C^-1 + dt * Omega) / (tau_c + dt));
        P(V | Omega C)    = normal(Omega - C, sigma_v);
    }
    question estimate { P(Omega C | V) }
}";

fn closed_form(model: &Model, text: &str) -> Gaussian {
    let mut plan = plan(model, &question(model, text), Options::default()).unwrap();
    let Route::Gaussian(gaussian) = plan.routes.remove(0) else { panic!("`{text}` has a closed form") };
    gaussian
}

fn yaw(parameters: &[(&str, f64)]) -> Filter {
    let model = model_of(YAW);
    let mut filter = Filter::new(&model, &closed_form(&model, "estimate"), parameters).unwrap();
    filter.settle().unwrap();
    filter
}

#[track_caller]
fn near(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found}, expected {expected}");
}

#[test]
fn settled_gains_are_the_published_ones() {
    let filter = yaw(&[]);
    near(filter.gain_of("Omega", "V").unwrap(), 0.9428, 0.5e-4);
    near(filter.gain_of("C", "V").unwrap() / 0.01, 0.1892, 0.5e-4);
}

/// Estimates (Ω, C) at each instant of a rotation of velocity 1 that starts in the dark and never ends.
fn response(filter: &mut Filter, tau_c: f64, dt: f64, instants: usize) -> Vec<[f64; 2]> {
    let (mut canal, mut before) = (0.0, 0.0);
    let keep = tau_c / (tau_c + dt);
    (0..instants)
        .map(|_| {
            canal = (1.0 - dt / tau_c) * canal + keep * (1.0 - before);
            before = 1.0;
            let belief = filter.step(&[("V", canal)]).unwrap();
            [belief.mean_of("Omega").unwrap(), belief.mean_of("C").unwrap()]
        })
        .collect()
}

#[test]
fn a_constant_rotation_fades_as_published() {
    let estimates = response(&mut yaw(&[]), 4.0, 0.01, 6001);
    for (second, expected) in [(0, 0.9405), (1, 0.8846), (10, 0.5115), (30, 0.1520), (60, 0.0247)] {
        near(estimates[second * 100][0], expected, 0.5e-4);
    }
    let peak = (0..6001).max_by(|a, b| estimates[*a][1].total_cmp(&estimates[*b][1])).unwrap();
    near(estimates[peak][1], 0.480, 0.5e-3);
    near(peak as f64 * 0.01, 7.5, 0.05);
    // Once the canal's own 4 s have gone, what is left falls by e in 4 · sqrt(17) = 16.49 s.
    let fall = 20.0 / (estimates[4000][0] / estimates[6000][0]).ln();
    near(fall, 4.0 * 17f64.sqrt(), 0.05);
}

/// ln(x(t) / x(t + 1)) of the filter left alone: the pole of the closed loop.
fn free_fall(filter: &mut Filter, dt: f64) -> f64 {
    filter.step(&[("V", 1.0)]).unwrap();
    let state = |filter: &mut Filter| filter.step(&[("V", 0.0)]).unwrap().mean_of("C").unwrap();
    let (first, steps) = (state(filter), 50);
    let last = (0..steps).map(|_| state(filter)).last().unwrap();
    f64::from(steps) * dt / (first / last).ln()
}

#[test]
fn the_time_constant_is_that_of_the_formula() {
    let sets = [
        (0.7, 0.175, 4.0),
        (40.0, 5.0, 4.0),
        (40.0, 20.0, 4.0),
        (40.0, 10.0, 6.0),
        (1.0, 1.0, 4.0),
        (0.2, 0.5, 2.0),
        (3.0, 1.0, 5.0),
    ];
    for (sigma_omega, sigma_v, tau_c) in sets {
        for dt in [0.01, 0.002] {
            let parameters =
                [("sigma_omega", sigma_omega), ("sigma_v", sigma_v), ("tau_c", tau_c), ("dt", dt)];
            let found = free_fall(&mut yaw(&parameters), dt);
            let ratio: f64 = sigma_omega / sigma_v;
            let expected = tau_c * (1.0 + ratio * ratio).sqrt();
            near(found / expected, 1.0, 1.5 * dt / tau_c);
        }
    }
}

#[test]
fn the_published_constants_of_three_parameter_sets() {
    for (sigma_v, tau_c, expected) in [(5.0, 4.0, 32.25), (20.0, 4.0, 8.94), (10.0, 6.0, 24.74)] {
        let parameters = [("sigma_omega", 40.0), ("sigma_v", sigma_v), ("tau_c", tau_c), ("dt", 0.001)];
        near(free_fall(&mut yaw(&parameters), 0.001), expected, 0.01);
    }
}

const TWO: &str = "program Two {
    parameters { sigma_1, sigma_2 : real; mean : real = 1; }
    variables { X, Y, Z : real; }
    decomposition { P(X) P(Y | X) P(Z | X) }
    forms { P(X) = normal(mean, 2); P(Y | X) = normal(X, sigma_1); P(Z | X) = normal(3 * X - 1, sigma_2); }
}";

fn two() -> Inputs<'static, f64> {
    Inputs::new().number("sigma_1", 0.5).number("sigma_2", 1.5)
}

fn law(model: &Model, text: &str, inputs: &Inputs<'_, f64>) -> (Vec<(f64, f64)>, f64) {
    let answers = ask(model, &question(model, text), inputs).unwrap();
    let of = |row: &bp_core::answer::Row| match row.figure {
        Figure::Normal { mean, deviation } => (mean, deviation),
        figure => panic!("{figure:?}"),
    };
    (answers[0].answer.iter().map(of).collect(), answers[0].ln_evidence.unwrap_or(0.0))
}

#[test]
fn two_measurements_of_one_mean() {
    let model = model_of(TWO);
    let (prior, _) = law(&model, "P(X)", &two());
    assert_eq!(prior, [(1.0, 2.0)]);
    // Precisions add: ¼ + 4; the mean is weighted by them.
    let (one, ln) = law(&model, "P(X | Y = 2)", &two());
    near(one[0].0, (0.25 * 1.0 + 4.0 * 2.0) / 4.25, 1e-12);
    near(one[0].1, (1.0 / 4.25f64).sqrt(), 1e-12);
    near(ln, Normal::new(1.0, 4.25f64.sqrt()).unwrap().ln_pdf(2.0), 1e-12);
    // Z says of X that it is (Z + 1) / 3 with deviation ½.
    let (both, ln_both) = law(&model, "P(X | Y = 2, Z = 4)", &two());
    near(both[0].0, (0.25 + 4.0 * 2.0 + 4.0 * 5.0 / 3.0) / 8.25, 1e-12);
    near(both[0].1, (1.0 / 8.25f64).sqrt(), 1e-12);
    // P(y z) = P(y) P(z | y): z has mean 3 m − 1 and variance 9 / 4.25 + 2.25 given y.
    let given = Normal::new(3.0 * one[0].0 - 1.0, (9.0 / 4.25 + 2.25f64).sqrt()).unwrap();
    near(ln_both, ln + given.ln_pdf(4.0), 1e-12);
    // What is not observed is predicted: variance 9 · 4 + 2.25.
    let (z, _) = law(&model, "P(Z)", &two());
    near(z[0].0, 2.0, 1e-12);
    near(z[0].1, 38.25f64.sqrt(), 1e-12);
    // Evidence may be given when the question is asked.
    let (given, _) = law(&model, "P(X | Y)", &two().number("Y", 2.0));
    assert_eq!(given, one);
}

fn message(error: Error) -> String {
    error.to_string()
}

#[test]
fn what_is_wrong_with_the_data_is_told() {
    let model = model_of(TWO);
    let asked = |inputs: &Inputs<'_, f64>, text: &str| {
        message(ask(&model, &question(&model, text), inputs).unwrap_err())
    };
    let missing = asked(&Inputs::new().number("sigma_1", 1.0), "P(X | Y = 2, Z = 1)");
    assert!(missing.contains("`sigma_2`") && missing.contains("not given"), "{missing}");
    for bad in [0.0, -1.0] {
        let text = asked(&two().number("sigma_1", bad), "P(X | Y = 2)");
        assert!(text.contains("`P(Y | X) = normal(") && text.contains("the standard deviation is"), "{text}");
    }
    let infinite = asked(&two().number("mean", f64::INFINITY), "P(X | Y = 2)");
    assert!(infinite.contains("`mean`") && infinite.contains("finite"), "{infinite}");
    for bad in [f64::NAN, f64::INFINITY] {
        let text = asked(&two().number("Y", bad), "P(X | Y)");
        assert!(text.contains("`Y`"), "{text}");
    }
    let unobserved = asked(&two(), "P(X | Y)");
    assert!(unobserved.contains("`Y`") && unobserved.contains("not given"), "{unobserved}");
    let entropy = asked(&two(), "entropy P(X | Y = 2)");
    assert!(entropy.contains("no exact answer"), "{entropy}");
}

#[test]
fn what_is_wrong_with_a_step_is_told() {
    let mut filter = yaw(&[]);
    assert!(message(filter.step(&[("V", f64::NAN)]).unwrap_err()).contains("must be finite"));
    assert!(message(filter.step(&[]).unwrap_err()).contains("not observed"));
    assert!(message(filter.step(&[("V", 1.0), ("W", 1.0)]).unwrap_err()).contains("`W`"));
    let model = model_of(YAW);
    let plan = closed_form(&model, "estimate");
    let made =
        |parameters: &[(&str, f64)]| Filter::new(&model, &plan, parameters).map(|_| ()).map_err(message);
    assert!(made(&[("sigma_v", 0.0)]).unwrap_err().contains("must be greater than 0"));
    assert!(made(&[("sigma", 1.0)]).unwrap_err().contains("no such parameter"));
    assert!(made(&[("tau_c", -0.01), ("dt", 0.01)]).unwrap_err().contains("must be a finite number"));
    assert!(made(&[]).is_ok());
    // An error leaves the filter where it was.
    let (mut fresh, mut used) = (yaw(&[]), yaw(&[]));
    used.step(&[("V", f64::NAN)]).unwrap_err();
    assert_eq!(fresh.step(&[("V", 0.3)]).unwrap(), used.step(&[("V", 0.3)]).unwrap());
}

#[test]
fn a_dirac_that_is_observed_twice_has_no_density() {
    let model = model_of(
        "program Same { variables { X, Y, Z : real; } decomposition { P(X) P(Y | X) P(Z | X) }
         forms { P(X) = normal(0, 1); P(Y | X) = dirac(2 * X); P(Z | X) = dirac(X + 1); } }",
    );
    let (one, ln) = law(&model, "P(X | Y = 3)", &Inputs::new());
    near(one[0].0, 1.5, 1e-12);
    near(one[0].1, 0.0, 1e-12);
    near(ln, Normal::new(0.0, 2.0).unwrap().ln_pdf(3.0), 1e-12);
    let error = ask(&model, &question(&model, "P(X | Y = 3, Z = 2)"), &Inputs::new()).unwrap_err();
    assert!(message(error).contains("no density"));
}
