//! Gibbs sampling, compared with closed forms, sums and integrals.
//!
//! In: programs whose posteriors are known by hand. Out: estimates. Invariant: each estimate lies within four of its
//! own standard errors of the truth; the number of threads does not matter; chains that disagree are reported.

use crate::support::{model_of, question};
use bp_core::compiler::answer::{Answer, Figure, compile_by};
use bp_core::compiler::distribution::Setting;
use bp_core::compiler::error::Error;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::ids::Id;
use bp_core::compiler::model::Model;
use bp_core::compiler::plan::Strategy;
use bp_core::compiler::sample::{Observations, Sampling};
use bp_core::compiler::strategies::gibbs::gibbs;
use bp_core::compiler::strategies::weighting::Treatment;
use statrs::distribution::{Beta, ContinuousCDF};

fn asked_by(by: Strategy, model: &Model, text: &str, particles: usize) -> Result<Answer, Error> {
    asked_with(by, model, text, &Inputs::new(), particles)
}

fn asked_with(
    by: Strategy,
    model: &Model,
    text: &str,
    inputs: &Inputs<'_, f64>,
    particles: usize,
) -> Result<Answer, Error> {
    let compiled = compile_by(model, &question(model, text), Some(by))?;
    compiled.ask_with(inputs, Sampling { particles, seed: 1 }).map(|mut answers| answers.remove(0))
}

fn asked(model: &Model, text: &str, particles: usize) -> Answer {
    asked_by(Strategy::Gibbs, model, text, particles).unwrap()
}

#[track_caller]
fn within([found, error]: [f64; 2], expected: f64) {
    assert!(error > 0.0 && (found - expected).abs() < 4.0 * error, "{found} ± {error}, expected {expected}");
}

fn real(answer: &Answer, name: &str) -> ([f64; 2], [f64; 2], [[f64; 2]; 3]) {
    let row = answer.answer.iter().find(|row| row.values[0].0 == name).unwrap();
    let Figure::Real { mean, deviation, quantiles } = row.figure else { panic!("{row:?}") };
    (mean, deviation, quantiles)
}

fn probability(answer: &Answer, value: &str) -> [f64; 2] {
    let row = answer.answer.iter().find(|row| row.values[0].1 == value).unwrap();
    let Figure::Estimated { p, error } = row.figure else { panic!("{row:?}") };
    [p, error]
}

/// The prior of the coin allows almost nothing but tails, and all throws are heads.
#[test]
fn an_unlikely_coin_is_beta_distributed() {
    let model = model_of(
        "program Coin { variables { Bias : real; Heads : 0..=40; } decomposition { P(Bias) P(Heads | Bias) }
         forms { P(Bias) = beta(1, 40); P(Heads | Bias) = binomial(40, Bias); } }",
    );
    let weighed = asked_by(Strategy::Weighting, &model, "P(Bias | Heads = 40)", 20_000).unwrap();
    assert!(weighed.estimate.unwrap().effective < 50.0);
    let answer = asked(&model, "P(Bias | Heads = 40)", 20_000);
    let estimate = answer.estimate.clone().unwrap();
    // At most four fifths of the draws: chains end once 10 000 are effective.
    assert!(estimate.effective > 1000.0 && estimate.particles <= 16_000, "{estimate:?}");
    assert_eq!((estimate.warning, answer.ln_evidence), (None, None));
    let (mean, deviation, quantiles) = real(&answer, "Bias");
    within(mean, 41.0 / 81.0);
    within(deviation, (41.0 * 40.0 / (81.0 * 81.0 * 82.0f64)).sqrt());
    let law = Beta::new(41.0, 40.0).unwrap();
    for (quantile, level) in quantiles.into_iter().zip([0.05, 0.5, 0.95]) {
        within(quantile, law.inverse_cdf(level));
    }
}

/// A chain X → Y → D → Z with a far observation Z; an unlinked switch rules out the closed form, and D, a Dirac, is
/// computed. Given Z: X ~ N(0, 1), Y = X + N(0, 1), D = 2 Y, Z = D + N(0, 0.1).
#[test]
fn a_gaussian_chain_far_from_its_prior() {
    let model = model_of(
        "program Line { variables { S : bool; X, Y, D, Z : real; }
         decomposition { P(S) P(X) P(Y | X S) P(D | Y) P(Z | D) }
         forms { P(S) = bernoulli(0.5); P(X) = normal(0, 1); P(Y | X S) = normal(if S { X } else { 0 + X }, 1);
                 P(D | Y) = dirac(2 * Y); P(Z | D) = normal(D, 0.1); } }",
    );
    let weighed = asked_by(Strategy::Weighting, &model, "P(X | Z = 12)", 20_000).unwrap();
    assert!(weighed.estimate.unwrap().effective < 50.0);
    let answer = asked(&model, "P(X D | Z = 12)", 20_000);
    assert!(answer.estimate.as_ref().unwrap().effective > 500.0, "{answer:?}");
    // Var Z = 4 · 2 + 0.01, Cov(X, Z) = 2, Cov(D, Z) = 8.
    let (mean, deviation, _) = real(&answer, "X");
    within(mean, 2.0 / 8.01 * 12.0);
    within(deviation, (1.0 - 4.0 / 8.01f64).sqrt());
    let (mean, deviation, _) = real(&answer, "D");
    within(mean, 8.0 / 8.01 * 12.0);
    within(deviation, (8.0 - 64.0 / 8.01f64).sqrt());
}

/// Three finite variables, against the sum over all their values, drawn without a question: it has an exact answer.
#[test]
fn a_finite_model_has_the_probabilities_of_the_sum() {
    let model = model_of(
        "program Net { variables { A : 0..=1; B : 1..=3; C : bool; D : 0..=4; E : bool; }
         decomposition { P(A) P(B | A) P(C | A B) P(D | A B) P(E | D) }
         forms { P(A) = categorical(0.7, 0.3); P(B | A) = if A == 1 { categorical(0.1, 0.2, 0.7) } else { categorical(0.5, 0.3, 0.2) };
                 P(C | A B) = bernoulli(if A == 1 { 0.2 * B } else { 0.9 / B }); P(D | A B) = dirac(A + B);
                 P(E | D) = bernoulli(0.2 + 0.15 * D); } }",
    );
    let inputs = Inputs::new();
    let setting = Setting::new(&model, &inputs).unwrap();
    let mut observations = Observations::none(&setting);
    observations.observe(&setting, 2, 1.0).unwrap();
    observations.observe(&setting, 4, 0.0).unwrap();
    let steps: Vec<_> = (0..5)
        .map(|factor| {
            let treatment = if factor == 2 || factor == 4 { Treatment::Weighed } else { Treatment::Drawn };
            (bp_core::compiler::ids::FactorId::new(factor), treatment)
        })
        .collect();
    let draws =
        gibbs(&setting, &steps, &observations, &[], &[0, 1, 3], Sampling { particles: 40_000, seed: 1 })
            .unwrap();
    let weight = |a: usize, b: usize| {
        let of_b = [[0.5, 0.3, 0.2], [0.1, 0.2, 0.7]][a][b - 1];
        let of_c = if a == 1 { 0.2 * b as f64 } else { 0.9 / b as f64 };
        [0.7, 0.3][a] * of_b * of_c * (0.8 - 0.15 * (a + b) as f64)
    };
    let total: f64 = (0..2).flat_map(|a| (1..=3).map(move |b| weight(a, b))).sum();
    for a in 0..2 {
        for b in 1..=3 {
            let holds = |draw| draws.value(draw, 0) == a as f64 && draws.value(draw, 1) == (b - 1) as f64;
            within(draws.mean(|draw| f64::from(u8::from(holds(draw)))), weight(a, b) / total);
        }
    }
    assert!(
        (0..draws.count())
            .all(|draw| draws.value(draw, 2) == draws.value(draw, 0) + draws.value(draw, 1) + 1.0)
    );
}

const SWITCH: &str = "program Switch { variables { S : bool; X, Y : real; } decomposition { P(S) P(X | S) P(Y | X) }
    forms { P(S) = bernoulli(0.3); P(X | S) = normal(if S { 2 } else { -1 }, 1.5); P(Y | X) = normal(X, 0.5); } }";

#[test]
fn a_switch_behind_a_real_and_virtual_evidence() {
    let model = model_of(SWITCH);
    // P(Y | S) is normal of deviation √2.5.
    let density = |mean: f64| (-(1.0 - mean) * (1.0 - mean) / 5.0f64).exp();
    let odds = 0.3 * density(2.0) / (0.7 * density(-1.0));
    within(probability(&asked(&model, "P(S | Y = 1)", 40_000), "true"), odds / (1.0 + odds));
    // 0.7 · 0.2 to 0.3 · 0.8.
    let odds = 4.0 * odds;
    let answer = asked(&model, "P(X | Y = 1, S virtual [0.2, 0.8])", 40_000);
    let given = |m: f64| m + 0.9 * (1.0 - m);
    within(real(&answer, "X").0, (odds * given(2.0) + given(-1.0)) / (odds + 1.0));
}

#[test]
fn families_follow_their_own_elements_only() {
    // M ~ exponential(1), Z[i] ~ N(M, i), W[i] ~ N(Z[i], 1) given: by the trapezium rule over M, W[i] ~ N(M, √(i² + 1)).
    let model = model_of(
        "program Many { variables { M : real; Z[1..=3], W[1..=3] : real; }
         decomposition { P(M) prod(i) { P(Z[i] | M) } prod(i) { P(W[i] | Z[i]) } }
         forms { P(M) = exponential(1); P(Z[i] | M) = normal(M, i); P(W[i] | Z[i]) = normal(Z[i], 1); } }",
    );
    let w = [0.4, 3.0, -2.0];
    let inputs = Inputs::new().array("W", &w);
    let asked = asked_with(Strategy::Gibbs, &model, "P(M | W)", &inputs, 40_000);
    let answer = asked.unwrap();
    let weight = |power: i32| {
        (0..20_000)
            .map(|step| (f64::from(step) + 0.5) * 1e-3)
            .map(|m| {
                let square = |(w, i): (&f64, i32)| (w - m).powi(2) / f64::from(i * i + 1);
                m.powi(power) * (-m - 0.5 * w.iter().zip(1..).map(square).sum::<f64>()).exp()
            })
            .sum::<f64>()
    };
    within(real(&answer, "M").0, weight(1) / weight(0));
}

#[test]
fn an_observed_dirac_is_solved_or_refused() {
    let text = |forms: &str| {
        format!(
            "program Tied {{ variables {{ S : bool; X, E, Y : real; T, V : bool; }}
             decomposition {{ P(S) P(X | S) P(E) P(Y | X E) P(T | X E) P(V | S X) }}
             forms {{ P(S) = bernoulli(0.5); P(X | S) = {forms};
                      P(E) = normal(0, 1); P(Y | X E) = dirac(3 * X + E); P(T | X E) = dirac(X > E);
                      P(V | S X) = dirac(X > 0); }} }}"
        )
    };
    let model = model_of(&text("normal(if S { 1 } else { 0 }, 2)"));
    // As with weighting: Y | S ~ N(3 or 0, √37), E(X | Y, S) = m + 12 / 37 (Y − 3 m).
    let density = |mean: f64| (-(4.0 - mean) * (4.0 - mean) / 74.0f64).exp();
    let (one, none) = (density(3.0), density(0.0));
    let given = |m: f64| m + 12.0 / 37.0 * (4.0 - 3.0 * m);
    let answer = asked(&model, "P(S X | Y = 4)", 40_000);
    within(probability(&answer, "true"), one / (one + none));
    within(real(&answer, "X").0, (one * given(1.0) + none * given(0.0)) / (one + none));
    // A predicate of a hidden real can be observed: X > 0.
    let answer = asked(&model, "P(X | V = true, S = false)", 20_000);
    within(real(&answer, "X").0, 2.0 * (2.0 / std::f64::consts::PI).sqrt());
    // And one of two reals, X > E: with D = X − E ~ N(m, √5), E(X | D > 0) = m + 4/√5 φ(m/√5) / Φ(m/√5).
    let answer = asked(&model, "P(X | T = true)", 40_000);
    within(real(&answer, "X").0, 1.732_865_039_531_290_3);
    let model = model_of(&text("mixture(0.5, dirac(0), 0.5, normal(0, 1))"));
    let refused = asked_by(Strategy::Gibbs, &model, "P(X | V = true)", 1000).unwrap_err().to_string();
    assert!(refused.contains("`X` has a `dirac` in part of its form"), "{refused}");
}

#[test]
fn evidence_that_no_prior_draw_allows_is_an_error() {
    let model = model_of(
        "program Far { variables { X, Y : real; } decomposition { P(X) P(Y | X) }
         forms { P(X) = gamma(2, 1); P(Y | X) = uniform(X, X + 1); } }",
    );
    let error = asked_by(Strategy::Gibbs, &model, "P(X | Y = -1)", 100).unwrap_err().to_string();
    assert!(error.contains("none of 10000 draws met the evidence of `P(X | Y = -1)`"), "{error}");
    assert!(error.contains("rare or impossible") && error.contains("`draws(n)`"), "{error}");
}

/// Two modes twenty deviations apart: no chain moves from one to the other.
#[test]
fn chains_that_do_not_agree_give_a_warning() {
    let model = model_of(
        "program Modes { variables { X, Z : real; } decomposition { P(X) P(Z | X) }
         forms { P(X) = normal(0, 10); P(Z | X) = normal(X * X, 0.5); } }",
    );
    let estimate = asked(&model, "P(X | Z = 400)", 4000).estimate.unwrap();
    assert!(estimate.warning.as_ref().is_some_and(|warning| warning.contains("R-hat")), "{estimate:?}");
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let model = model_of(SWITCH);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| asked(&model, "P(S X | Y = 1)", 2000))
    };
    let one = on(1);
    assert_eq!(one, on(2));
    assert_eq!(one, on(8));
}

/// Counts with P(A) = normal(0, 5) and rates exp(A + x / 2): the posterior mean of A is a ratio of two integrals over a fine grid.
#[test]
fn many_observations_are_answered_by_chains_without_being_asked_for() {
    let model = model_of(
        "program Counts { parameters { x[1..=12] : real; } variables { A : real; Y[1..=12] : real; }
         decomposition { P(A) prod(i) { P(Y[i] | A) } }
         forms { P(A) = normal(0, 5); P(Y[i] | A) = poisson(exp(A + 0.5 * x[i])); } }",
    );
    let x: Vec<f64> = (0..12).map(|i| f64::from(i) / 3.0 - 2.0).collect();
    let y = [3.0, 2.0, 4.0, 3.0, 6.0, 5.0, 7.0, 6.0, 9.0, 8.0, 12.0, 14.0];
    let inputs = Inputs::new().array("x", &x).array("y", &y);
    let compiled = compile_by(&model, &question(&model, "P(A | Y = y)"), None).unwrap();
    let answer = compiled.ask_with(&inputs, Sampling { particles: 4000, seed: 1 }).unwrap().remove(0);
    assert_eq!(answer.strategy, Strategy::Gibbs);
    let ln_density = |a: f64| {
        let terms = x.iter().zip(y).map(|(x, y)| y * (a + 0.5 * x) - (a + 0.5 * x).exp());
        terms.sum::<f64>() - 0.5 * (a / 5.0).powi(2)
    };
    let grid = || (0..=40_000).map(|step| f64::from(step) * 1e-4);
    let most = grid().map(ln_density).fold(f64::NEG_INFINITY, f64::max);
    let weight = |a: f64| (ln_density(a) - most).exp();
    let mean = grid().map(|a| a * weight(a)).sum::<f64>() / grid().map(weight).sum::<f64>();
    within(real(&answer, "A").0, mean);
}
