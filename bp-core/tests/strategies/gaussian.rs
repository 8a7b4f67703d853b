//! Linear and Gaussian programs: published vestibular figures, and posteriors by hand.
//!
//! In: programs written here, parameters, observations. Out: beliefs of the closed-form filter. Invariant: the
//! gains, decay and response are those of Laurens and Angelaki (eLife 6:e28074, 2017); the time constant is
//! τ_c · sqrt(1 + σ_Ω² / σ_V²).

use crate::support::{model_of, near, question};
use bp_core::compiler::answer::{Figure, ask};
use bp_core::compiler::error::Error;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::model::Model;
use bp_core::compiler::plan::{Options, Route, plan};
use bp_core::compiler::strategies::gaussian::{Filter, Gaussian};
use statrs::distribution::{Continuous, Normal};

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
    // Once the canal's own 4 s are over, the rest decays by e in 4 · sqrt(17) = 16.49 s.
    let fall = 20.0 / (estimates[4000][0] / estimates[6000][0]).ln();
    near(fall, 4.0 * 17f64.sqrt(), 0.05);
}

/// ln(x(t) / x(t + 1)) of the filter without input: the pole of the closed loop.
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
    let of = |row: &bp_core::compiler::answer::Row| match row.figure {
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
    // Z measures X as (Z + 1) / 3 with deviation ½.
    let (both, ln_both) = law(&model, "P(X | Y = 2, Z = 4)", &two());
    near(both[0].0, (0.25 + 4.0 * 2.0 + 4.0 * 5.0 / 3.0) / 8.25, 1e-12);
    near(both[0].1, (1.0 / 8.25f64).sqrt(), 1e-12);
    // P(y z) = P(y) P(z | y): z has mean 3 m − 1 and variance 9 / 4.25 + 2.25 given y.
    let given = Normal::new(3.0 * one[0].0 - 1.0, (9.0 / 4.25 + 2.25f64).sqrt()).unwrap();
    near(ln_both, ln + given.ln_pdf(4.0), 1e-12);
    // An unobserved variable is predicted: variance 9 · 4 + 2.25.
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
fn wrong_data_are_reported() {
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
}

#[test]
fn wrong_steps_are_reported() {
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
    // An error leaves the filter unchanged.
    let (mut fresh, mut used) = (yaw(&[]), yaw(&[]));
    used.step(&[("V", f64::NAN)]).unwrap_err();
    assert_eq!(fresh.step(&[("V", 0.3)]).unwrap(), used.step(&[("V", 0.3)]).unwrap());
}

#[test]
fn observations_of_determined_reals_agree_or_are_impossible() {
    let model = model_of(
        "program Same { variables { X, Y, Z : real; } decomposition { P(X) P(Y | X) P(Z | X) }
         forms { P(X) = normal(0, 1); P(Y | X) = dirac(2 * X); P(Z | X) = dirac(X + 1); } }",
    );
    let (one, ln) = law(&model, "P(X | Y = 3)", &Inputs::new());
    near(one[0].0, 1.5, 1e-12);
    near(one[0].1, 0.0, 0.0);
    near(ln, Normal::new(0.0, 2.0).unwrap().ln_pdf(3.0), 1e-12);
    // Z is 2.5 with certainty: it adds nothing.
    let (both, ln_both) = law(&model, "P(X | Y = 3, Z = 2.5)", &Inputs::new());
    assert_eq!((both, ln_both), (one, ln));
    let error = ask(&model, &question(&model, "P(X | Y = 3, Z = 2)"), &Inputs::new()).unwrap_err();
    let expected = "`Z = 2` is impossible: earlier observations determine `Z` = 2.5";
    assert!(message(error).contains(expected));
}

/// A is a million, B a millionth; Y + 2 Z follows from Y and Z, though no row is zero before both are known.
#[test]
fn combinations_are_determined_in_any_units() {
    let model = model_of(
        "program Units { variables { A, B, N, Y, Z, W, V : real; }
         decomposition { P(A) P(B) P(N) P(Y | A B) P(Z | A B) P(W | A B) P(V | W N) }
         forms { P(A) = normal(0, 1e6); P(B) = normal(0, 1e-6); P(N) = normal(0, 1e-6);
                 P(Y | A B) = dirac(A + 1e12 * B); P(Z | A B) = dirac(A - 1e12 * B);
                 P(W | A B) = dirac(3e-6 * A - 1e6 * B); P(V | W N) = dirac(1e6 * W + 0.1 * N); } }",
    );
    let (two, ln) = law(&model, "P(A B | Y = 3000000, Z = 1000000)", &Inputs::new());
    near(two[0].0, 2e6, 1e-8);
    near(two[1].0, 1e-6, 1e-20);
    // Two independent normals of variance 1e12, whose sum and difference have determinant 2.
    near(ln, -2.5 - (2e12f64).ln() - std::f64::consts::TAU.ln(), 1e-12);
    let agrees = "P(A B | Y = 3000000, Z = 1000000, W = 5)";
    assert_eq!(law(&model, agrees, &Inputs::new()), (two, ln));
    let asked = |text: &str| ask(&model, &question(&model, text), &Inputs::new());
    let error = asked("P(A | Y = 3000000, Z = 1000000, W = 5.0001)").unwrap_err();
    assert!(message(error).contains("`W = 5.0001` is impossible"));
    // V is 5e6 up to a noise of deviation 1e-7, which is small but not rounding error.
    let (noise, ln_noise) = law(&model, "P(N | Y = 3000000, Z = 1000000, V = 5000000)", &Inputs::new());
    // One unit in the last place of V, 9.3e-10, is 9.3e-9 of N.
    near(noise[0].0, 0.0, 1e-8);
    near(ln_noise, ln - (1e-7f64).ln() - 0.5 * std::f64::consts::TAU.ln(), 1e-3);
}

/// ln p of two readings z of X ~ N(0, s₀²), each of deviation s: N(z; 0, s₀² 1 1ᵀ + s² I), in 50 digits (mpmath), for
/// the numbers as f64 represents them; so are all values of the tests below.
#[test]
fn two_precise_sensors_of_a_vague_prior() {
    let model = model_of(
        "program Vague { parameters { prior, sensor : real; } variables { X, Y, Z : real; }
         decomposition { P(X) P(Y | X) P(Z | X) }
         forms { P(X) = normal(0, prior); P(Y | X) = normal(X, sensor); P(Z | X) = normal(X, sensor); } }",
    );
    for (prior, sensor, mean, deviation, ln) in [
        (1e2, 0.1, 1.0499994750002626, 0.070_710_660_440_991_85, -4.737_091_124_655_739),
        (1e3, 0.1, 1.04999999475, 0.070_710_677_941_878_06, -7.039_621_396_427_407),
        (1e4, 1.0, 1.04999999475, 0.707_106_779_418_780_6, -11.397291036678),
        (1e6, 0.1, 1.0499999999999947, 0.070_710_678_118_654_58, -13.9473761216601),
        (1e8, 0.1, 1.05, 0.070_710_678_118_654_75, -18.55254630764764),
    ] {
        let inputs = Inputs::new().number("prior", prior).number("sensor", sensor);
        let (found, ln_found) = law(&model, "P(X | Y = 1, Z = 1.1)", &inputs);
        near(found[0].0, mean, 1e-13);
        near(found[0].1 / deviation, 1.0, 1e-13);
        near(ln_found, ln, 1e-12);
    }
}

#[test]
fn sensors_that_share_a_vague_bias() {
    let model = model_of(
        "program Bias { variables { X, B, Y, Z, W : real; }
         decomposition { P(X) P(B) P(Y | X B) P(Z | X B) P(W | X B) }
         forms { P(X) = normal(0, 1e6); P(B) = normal(2, 1e4); P(Y | X B) = normal(X + B, 0.1);
                 P(Z | X B) = normal(X - B, 0.1); P(W | X B) = normal(X + 2 * B, 1); } }",
    );
    let expected = [
        (
            "P(X B | Y = 5.25)",
            [3.249_675_032_496_718, 9999.5000379968],
            [2.000_324_967_503_25, 9_999.500_037_496_875],
            -14.7344990886744,
        ),
        (
            "P(X B | Y = 5.25, Z = 1.75)",
            [3.4999999999999827, 0.070_710_678_118_654_58],
            [1.7500000000125, 0.070_710_678_116_886_99],
            -25.556875177253374,
        ),
        (
            "P(X B | Y = 5.25, Z = 1.75, W = 6.5)",
            [3.497_560_975_609_614, 0.070_538_002_212_265_08],
            [1.745121951232007, 0.070_017_419_433_665_97],
            -26.61011123627725,
        ),
    ];
    for (text, x, b, ln) in expected {
        let (found, ln_found) = law(&model, text, &Inputs::new());
        for ((mean, deviation), expected) in found.into_iter().zip([x, b]) {
            near(mean, expected[0], 1e-10);
            near(deviation / expected[1], 1.0, 1e-10);
        }
        near(ln_found, ln, 1e-10);
    }
}

#[test]
fn units_of_a_millionth_and_a_million_in_one_program() {
    let model = model_of(
        "program Units { variables { X, V, Y, Z, U : real; }
         decomposition { P(X) P(V | X) P(Y | X) P(Z | V) P(U | V X) }
         forms { P(X) = normal(0, 1e4); P(V | X) = normal(1e-6 * X, 1e-6); P(Y | X) = normal(1e6 * X, 1e5);
                 P(Z | V) = normal(1e6 * V + 3, 0.5); P(U | V X) = normal(1e-6 * V + 1e-12 * X, 1e-13); } }",
    );
    let (found, ln) = law(&model, "P(X V | Y = 2500000, Z = 7, U = 6.5e-12)", &Inputs::new());
    near(found[0].0, 2.527070063459534, 1e-12);
    near(found[0].1, 0.096_378_147_653_964_48, 1e-13);
    near(found[1].0 * 1e6, 3.960191083023868, 1e-12);
    near(found[1].1 * 1e6, 0.1333466023092764, 1e-13);
    near(ln, 1.405_375_194_431_858, 1e-11);
}

/// More variables than are kept; the expected values are those of the scalar recursion p ← p + q − …, in 50 digits.
#[test]
fn a_long_chain_with_a_vague_start() {
    let (mut names, mut heads, mut forms, mut known) = (vec![], String::new(), String::new(), vec![]);
    for k in 0..150 {
        names.push(format!("X{k}, Z{k}"));
        match k {
            0 => (heads += "P(X0) ", forms += "P(X0) = normal(0, 1e8); "),
            _ => (
                heads += &format!("P(X{k} | X{}) ", k - 1),
                forms += &format!("P(X{k} | X{0}) = normal(X{0}, 0.1); ", k - 1),
            ),
        };
        heads += &format!("P(Z{k} | X{k}) ");
        forms += &format!("P(Z{k} | X{k}) = normal(X{k}, 0.1); ");
        known.push(format!("Z{k} = {}", f64::from(k * 7 % 10) / 4.0));
    }
    let names = names.join(", ");
    let text = format!(
        "program Chain {{ variables {{ {names} : real; }} decomposition {{ {heads} }} forms {{ {forms} }} }}"
    );
    let model = model_of(&text);
    let (found, ln) = law(&model, &format!("P(X149 | {})", known.join(", ")), &Inputs::new());
    near(found[0].0, 1.065998788301112, 1e-10);
    near(found[0].1, 0.078_615_137_775_742_33, 1e-12);
    near(ln, -2529.515600271813, 1e-7);
}

/// ln P is computed separately from P, and is finite where P is 0 in f64: X ~ N(0, 1), Z = X + N(0, 1), ln N(z; 0, 2) = −z²/4 − …
#[test]
fn far_observations_have_a_density() {
    let model = model_of(
        "program Far { variables { X, Z : real; } decomposition { P(X) P(Z | X) }
         forms { P(X) = normal(0, 1); P(Z | X) = normal(X, 1); } }",
    );
    for z in [1e9, 1e10, 1e100, 1e154, 2e154] {
        let (found, ln) = law(&model, "P(X | Z)", &Inputs::new().number("Z", z));
        near(found[0].0 / (z / 2.0), 1.0, 1e-14);
        near(found[0].1, 0.5f64.sqrt(), 1e-14);
        near(ln / (-0.25 * z * z), 1.0, 1e-14);
    }
}
