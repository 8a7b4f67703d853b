//! Likelihood weighting, compared with closed forms.
//!
//! In: programs whose posteriors are known by hand. Out: estimates. Invariant: each estimate lies within five of its
//! own standard errors of the truth, and the errors match the scatter of the estimates; the number of threads does not
//! matter.

use crate::support::{model_of, question};
use bp_core::compiler::answer::{Answer, Figure, ask, compile_by};
use bp_core::compiler::error::Error;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::model::Model;
use bp_core::compiler::plan::{Notation, Options, Route, Strategy, plan};
use bp_core::compiler::sample::Sampling;
use bp_core::prelude::Program;
use statrs::distribution::{Beta, ContinuousCDF, Normal};
use statrs::function::beta::ln_beta;

fn asked(model: &Model, text: &str, particles: usize, seed: u64) -> Answer {
    let sampling = Sampling { particles, seed };
    let compiled = compile_by(model, &question(model, text), Some(Strategy::Weighting)).unwrap();
    compiled.ask_with(&Inputs::new(), sampling).unwrap().remove(0)
}

#[track_caller]
fn within([found, error]: [f64; 2], expected: f64) {
    assert!(error > 0.0 && (found - expected).abs() < 5.0 * error, "{found} ± {error}, expected {expected}");
}

const COIN: &str =
    "program Coin { variables { Bias : real; Heads : 0..=10; } decomposition { P(Bias) P(Heads | Bias) }
    forms { P(Bias) = beta(2, 2); P(Heads | Bias) = binomial(10, Bias); } }";

#[test]
fn an_event_of_all_draws_has_probability_one() {
    // All weight is on K = true, whose ln is −5·10⁵: rounding of the logarithms must not show.
    let model = model_of(
        "program W { variables { K : bool; Y : real; } decomposition { P(K) P(Y | K) }
         forms { P(K) = bernoulli(0.3); P(Y | K) = normal(if K { 1 } else { 0 }, 1); } }",
    );
    for seed in 1..4 {
        let answer = asked(&model, "P(K | Y = 1000)", 10_000, seed);
        let found: Vec<f64> = answer.answer.iter().map(|row| row.p().unwrap()).collect();
        assert_eq!(
            (found, answer.parts[0].probabilities().unwrap().to_vec()),
            (vec![0.0, 1.0], vec![0.0, 1.0])
        );
    }
}

#[test]
fn a_coin_is_beta_distributed_after_some_throws() {
    // P(Bias | 7 of 10) = beta(9, 5); P(7) = C(10, 7) B(9, 5) / B(2, 2).
    let model = model_of(COIN);
    let answer = asked(&model, "P(Bias | Heads = 7)", 100_000, 1);
    let Figure::Real { mean, deviation, quantiles } = answer.answer[0].figure else { panic!("{answer:?}") };
    within(mean, 9.0 / 14.0);
    within(deviation, (9.0 * 5.0 / (14.0 * 14.0 * 15.0f64)).sqrt());
    let law = Beta::new(9.0, 5.0).unwrap();
    for (quantile, level) in quantiles.into_iter().zip([0.05, 0.5, 0.95]) {
        within(quantile, law.inverse_cdf(level));
    }
    let ln = 120f64.ln() + ln_beta(9.0, 5.0) - ln_beta(2.0, 2.0);
    let estimate = answer.estimate.unwrap();
    within([answer.ln_evidence.unwrap(), estimate.ln_evidence_error.unwrap()], ln);
    // Half of the draws or so count: E w² / (E w)² = ∫ p(θ) L² / (∫ p L)².
    let second = 2.0 * 120f64.ln() + ln_beta(16.0, 8.0) - ln_beta(2.0, 2.0);
    assert!(
        (estimate.effective / (100_000.0 * (2.0 * ln - second).exp()) - 1.0).abs() < 0.03,
        "{estimate:?}"
    );
    assert_eq!(estimate.warning, None);
}

/// A hidden switch moves a hidden real: P(S | Y) is a ratio of two normal densities.
const SWITCH: &str = "program Switch { variables { S : bool; X, Y : real; } decomposition { P(S) P(X | S) P(Y | X) }
    forms { P(S) = bernoulli(0.3); P(X | S) = normal(if S { 2 } else { -1 }, 1.5); P(Y | X) = normal(X, 0.5); } }";

fn switch(y: f64) -> f64 {
    let density = |mean: f64| {
        use statrs::distribution::Continuous;
        Normal::new(mean, 2.5f64.sqrt()).unwrap().pdf(y)
    };
    0.3 * density(2.0) / (0.3 * density(2.0) + 0.7 * density(-1.0))
}

fn probability(answer: &Answer, value: &str) -> [f64; 2] {
    let row = answer.answer.iter().find(|row| row.values[0].1 == value).unwrap();
    let Figure::Estimated { p, error } = row.figure else { panic!("{row:?}") };
    [p, error]
}

#[test]
fn a_switch_behind_a_real_has_the_probability_of_the_sum() {
    let model = model_of(SWITCH);
    let answer = asked(&model, "P(S | Y = 1)", 50_000, 3);
    within(probability(&answer, "true"), switch(1.0));
    let sum: f64 = answer.answer.iter().filter_map(|row| row.p()).sum();
    assert!((sum - 1.0).abs() < 1e-12);
    // Virtual evidence multiplies: 0.7 · 0.2 to 0.3 · 0.8. E(X | Y, S) = m + 2.25 / 2.5 (Y − m).
    let answer = asked(&model, "P(X | Y = 1, S virtual [0.2, 0.8])", 50_000, 3);
    let Figure::Real { mean, .. } = answer.answer[0].figure else { panic!("{answer:?}") };
    let odds = switch(1.0) / (1.0 - switch(1.0)) * 4.0;
    let given = |m: f64| m + 0.9 * (1.0 - m);
    within(mean, (odds * given(2.0) + given(-1.0)) / (odds + 1.0));
}

#[test]
fn standard_errors_are_as_large_as_estimates_scatter() {
    let model = model_of(SWITCH);
    let truth = switch(1.0);
    let scores: Vec<f64> = (0..200)
        .map(|seed| {
            let [p, error] = probability(&asked(&model, "P(S | Y = 1)", 2000, seed), "true");
            (p - truth) / error
        })
        .collect();
    let square = scores.iter().map(|score| score * score).sum::<f64>() / 200.0;
    // χ² of 200 degrees of freedom, over 200: 0.70 to 1.36 but for one case in a thousand.
    assert!((0.70..1.36).contains(&square), "{square}");
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let model = model_of(SWITCH);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| asked(&model, "P(S X | Y = 1)", 5000, 9))
    };
    let one = on(1);
    assert_eq!(one, on(2));
    assert_eq!(one, on(8));
    assert_ne!(one, asked(&model, "P(S X | Y = 1)", 5000, 10), "another seed draws others");
}

#[test]
fn an_observed_dirac_is_solved_where_it_is_linear() {
    // Y = 3 X + E exactly; X ~ N(if S 1 else 0, 2), E ~ N(0, 1): Y | S ~ N(3 or 0, √37).
    let text = |value: &str| {
        format!(
            "program Sum {{ variables {{ S : bool; X, E, Y : real; }} decomposition {{ P(S) P(X | S) P(E) P(Y | X E) }}
             forms {{ P(S) = bernoulli(0.5); P(X | S) = normal(if S {{ 1 }} else {{ 0 }}, 2); P(E) = normal(0, 1);
                      P(Y | X E) = dirac({value}); }} }}"
        )
    };
    let model = model_of(&text("3 * X + E"));
    let answer = asked(&model, "P(X | Y = 4)", 50_000, 1);
    let Figure::Real { mean, .. } = answer.answer[0].figure else { panic!("{answer:?}") };
    let normal = |mean: f64| {
        use statrs::distribution::Continuous;
        Normal::new(mean, 37f64.sqrt()).unwrap().pdf(4.0)
    };
    let (one, none) = (normal(3.0), normal(0.0));
    // E(X | Y, S) = m + 3 · 4 / 37 (Y − 3 m).
    let given = |m: f64| m + 12.0 / 37.0 * (4.0 - 3.0 * m);
    within(mean, (one * given(1.0) + none * given(0.0)) / (one + none));
    let ln = answer.ln_evidence.unwrap();
    within([ln, answer.estimate.unwrap().ln_evidence_error.unwrap()], (0.5 * (one + none)).ln());
    let bent = model_of(&text("X * X + E * E"));
    let error = ask(&bent, &question(&bent, "P(X | Y = 4)"), &Inputs::new()).unwrap_err().to_string();
    assert!(error.contains("`Y` is observed") && error.contains("linear in no parent"), "{error}");
}

#[test]
fn impossible_evidence_is_an_error_and_unlikely_evidence_a_warning() {
    let model = model_of(
        "program Far { variables { X, Y, Z : real; } decomposition { P(X) P(Y | X) P(Z | X) }
         forms { P(X) = gamma(2, 1); P(Y | X) = uniform(X, X + 1); P(Z | X) = normal(X, 0.01); } }",
    );
    // P(Y | X) gives −1 the probability 0 for each X above 0, but no single factor excludes it: draws cannot
    // distinguish it from a rare event.
    let unmet = ask(&model, &question(&model, "P(X | Y = -1)"), &Inputs::new()).unwrap_err();
    assert!(matches!(unmet, Error::Unmet { draws: 100_000, .. }), "{unmet}");
    assert!(unmet.to_string().contains("rare or impossible; make more draws"), "{unmet}");
    // X = −2 is outside its own law, for all values of the others.
    let impossible = ask(&model, &question(&model, "P(Z | X = -2)"), &Inputs::new()).unwrap_err();
    assert!(impossible.to_string().contains("`P(X)` is 0 for `X = -2`"), "{impossible}");
    let estimate = asked(&model, "P(X | Z = 9)", 2000, 1).estimate.unwrap();
    assert!(
        estimate.effective < 20.0 && estimate.warning.unwrap().contains("improbable a priori"),
        "{}",
        estimate.effective
    );
}

#[test]
fn families_and_values_given_with_the_question() {
    let model = model_of(
        "program Many { variables { K : 1..=3; M : real; Z[1..=3] : real; } decomposition { P(K) P(M | K) prod(i) { P(Z[i] | M) } }
         forms { P(K) = uniform; P(M | K) = exponential(K); P(Z[i] | M) = normal(M, i); } }",
    );
    let z = [0.4, 1.0, -2.0];
    let inputs = Inputs::new().array("Z", &z);
    let answer = ask(&model, &question(&model, "P(K M | Z)"), &inputs).unwrap().remove(0);
    // By the trapezium rule over M.
    let weight = |k: f64, power: i32| {
        (0..40_000)
            .map(|step| (f64::from(step) + 0.5) * 1e-3)
            .map(|m| {
                let squares: f64 = z.iter().zip(1..).map(|(z, i)| ((z - m) / f64::from(i)).powi(2)).sum();
                m.powi(power) * k * (-k * m - 0.5 * squares).exp()
            })
            .sum::<f64>()
    };
    let total: f64 = (1..=3).map(|k| weight(f64::from(k), 0)).sum();
    for k in 1..=3 {
        within(probability(&answer, &k.to_string()), weight(f64::from(k), 0) / total);
    }
    let Figure::Real { mean, .. } = answer.answer[3].figure else { panic!("{answer:?}") };
    within(mean, (1..=3).map(|k| weight(f64::from(k), 1)).sum::<f64>() / total);
    let missing = ask(&model, &question(&model, "P(K | Z)"), &Inputs::new()).unwrap_err().to_string();
    assert!(missing.contains("`Z`") && missing.contains("not given"), "{missing}");
}

#[test]
fn the_route_shows_its_reasons_and_equations() {
    let model = model_of(SWITCH);
    let by = Options { by: Some(Strategy::Weighting), ..Options::default() };
    let made = plan(&model, &question(&model, "P(S | Y = 1)"), by).unwrap();
    assert!(matches!(made.routes[0], Route::Sampled(_)));
    let lines = made.derivation(&model, Notation::Unicode);
    let text: Vec<String> =
        lines.iter().map(|(rule, reason, equation)| format!("{rule}: {reason}: {equation}")).collect();
    assert!(text[0].ends_with("draw ~ P(S) P(X | S)") && text[1].ends_with("wₙ = P(Y | X)"), "{text:?}");
    assert!(text[2].contains("no exact strategy applies") && text[2].contains("`X`"), "{text:?}");
    assert!(text[2].ends_with("P(S | Y) ≈ Σₙ wₙ [Sⁿ = S] / Σₙ wₙ"), "{text:?}");
}

/// P(A, B = true): ½ · 0.9, ½ · 0.1, so that P(A | B = true) is 0.9 and 0.1.
#[test]
fn entropy_best_and_draws_are_estimated() {
    let program = Program::parse(
        "program Two { variables { A, B : bool; } decomposition { P(A) P(B | A) }
         forms { P(A) = bernoulli(0.5); P(B | A) = bernoulli(if A { 0.9 } else { 0.1 }); } }",
    )
    .unwrap()
    .by("weighting")
    .unwrap();
    let entropy = program.ask("entropy P(A | B = true)").unwrap();
    let Figure::Entropy { entropy, error: Some(error) } = entropy.answer().answer[0].figure else {
        panic!("{entropy}")
    };
    let expected = -(0.9 * 0.9f64.ln() + 0.1 * 0.1f64.ln());
    assert!(error < 0.02 && (entropy - expected).abs() < 4.0 * error, "{entropy} ± {error}");
    let best = program.ask("best(1) P(A | B = true)").unwrap();
    assert_eq!(best.answer().answer.len(), 1);
    assert_eq!(best.answer().answer[0].values[0].1, "true");
    let draws = program.ask("draw(2000) P(A | B = true)").unwrap();
    let drawn = draws.answer().answer.iter().filter(|row| row.values[0].1 == "true").count() as f64 / 2000.0;
    // The deviation of a share of 2000 is 0.0067.
    assert!((drawn - 0.9).abs() < 0.03, "{drawn}");
}
