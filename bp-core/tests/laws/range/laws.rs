//! Distributions over integers with probabilities below the range of f64.
//!
//! In: observations tens of deviations away from every value. Out: the answers of sums, of join trees and of chains
//! over time, compared with mpmath at 50 digits. Invariant: a value of nonzero probability is never reported as
//! impossible.

use super::{answer, model_of, near, numbers, question, try_answer};
use bp_core::compiler::answer::{Figure, ask_over_time, compile_by};
use bp_core::compiler::distribution::Setting;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::plan::Strategy;
use bp_core::compiler::sample::Sampling;
use bp_core::compiler::strategies::join_tree::{Marginals, Network, NetworkEvidence, most_probable};

const SENSORS: &str = "program Sensors { variables { X, Z1, Z2 : 0..=100; }
    decomposition { P(X) P(Z1 | X) P(Z2 | X) }
    forms { P(X) = uniform; P(Z1 | X) = normal(X, 1); P(Z2 | X) = normal(X, 1); } }";

#[test]
fn two_sensors_that_disagree_meet_in_the_middle() {
    // P(x | 0, 75) ∝ n(0; x) n(75; x), n(z; x) = exp(−(z − x)²/2) / Σ_k exp(−(k − x)²/2).
    let asked = "P(X | Z1 = 0, Z2 = 75)";
    let by_sums = answer(SENSORS, asked, &Inputs::new());
    near(
        &numbers(&by_sums)[36..40],
        &[0.059_471_296_701_721, 0.439_436_747_605_165, 0.439_436_747_605_165, 0.059_471_296_701_721],
        1e-9,
    );
    assert!((by_sums.ln_evidence.unwrap() + 1_412.130_736_102_75).abs() < 1e-6);
    let model = model_of(SENSORS);
    let by_tree = compile_by(&model, &question(&model, asked), Some(Strategy::JoinTree)).unwrap();
    let by_tree = by_tree.ask(&Inputs::new()).unwrap().remove(0);
    near(&numbers(&by_tree)[36..40], &numbers(&by_sums)[36..40], 1e-9);
    near(&[by_tree.ln_evidence.unwrap()], &[-1_412.130_736_102_750_4], 1e-12);
    // Here f64 loses no significant term.
    let asked = "P(X | Z1 = 50, Z2 = 52)";
    let by_tree = compile_by(&model, &question(&model, asked), Some(Strategy::JoinTree)).unwrap();
    let by_tree = by_tree.ask(&Inputs::new()).unwrap().remove(0);
    near(&numbers(&by_tree)[50..53], &numbers(&answer(SENSORS, asked, &Inputs::new()))[50..53], 1e-12);
}

#[test]
fn marginals_and_most_probable_values_beyond_the_range_of_f64() {
    // As above for the readings 0 and 74; the largest is x = 37, of which ln P(37, 0, 74) is the second logarithm.
    let (ln_evidence, ln_best) = (-1_374.880_529_210_004_9, -1_375.452_997_593_951_8);
    let expected = [0.207_532_280_248_748_13, 0.564_131_226_218_842_1, 0.207_532_280_248_748_13];
    let model = model_of(SENSORS);
    let inputs = Inputs::new();
    let network = Network::of(&Setting::new(&model, &inputs).unwrap()).unwrap();
    let observed = NetworkEvidence { hard: vec![(1, 0), (2, 74)], likelihoods: Vec::new() };
    for (given, weighed) in [([1, 2].as_slice(), [].as_slice()), (&[], &[1, 2])] {
        let plan = Marginals::new(&network, given, weighed, &[0]).unwrap();
        let mut session = plan.session();
        session.ask(&observed).unwrap();
        near(&session.marginal(0)[36..39], &expected, 1e-9);
        near(&[session.ln_evidence()], &[ln_evidence], 1e-12);
    }
    let (values, found) = most_probable(&network, &observed).unwrap();
    assert_eq!(values, [37, 0, 74]);
    near(&[found], &[ln_best], 1e-12);
    // With likelihoods of 10³⁰⁰ each: P(x | Z1 = 0) Λ(x), Λ = 10³⁰⁰ at x = 50 and 60 alone: odds of exp(−50²/2) / S(50)
    // to exp(−60²/2) / S(60), whose sums S differ by less than 10⁻²⁰.
    let mut likelihood = vec![0.0; 101];
    (likelihood[50], likelihood[60]) = (1e300, 1e300);
    let observed = NetworkEvidence { hard: vec![(1, 0)], likelihoods: vec![(0, likelihood)] };
    let plan = Marginals::new(&network, &[1], &[0], &[0]).unwrap();
    let mut session = plan.session();
    session.ask(&observed).unwrap();
    near(&[session.marginal(0)[60]], &[(-550f64).exp()], 1e-9);
}

#[test]
fn weights_beyond_the_range_of_f64() {
    // P(W = 0 | C A) = 1 / (1 + exp(300 C A)): one half in seven of sixteen contexts, at most 10⁻¹³⁰ in the others.
    let text = "program A { variables { C, A : 0..=3; W : 0..=1; } decomposition { P(C) P(A) P(W | C A) }
        forms { P(C) = uniform; P(A) = uniform; P(W | C A) = weights(exp(300 * C * A * W) * 1e-300); } }";
    let model = model_of(text);
    for (asked, first, ln_evidence) in [
        ("P(C | W = 0)", 4.0 / 7.0, (3.5f64 / 16.0).ln()),
        ("P(W | C = 3, A = 3)", (-2700f64).exp(), -(16f64.ln())),
        ("P(C | W = 0, A = 3)", 1.0, -(32f64.ln())),
    ] {
        for strategy in [Strategy::Sums, Strategy::JoinTree] {
            let compiled = compile_by(&model, &question(&model, asked), Some(strategy)).unwrap();
            let found = compiled.ask(&Inputs::new()).unwrap().remove(0);
            near(&numbers(&found)[..1], &[first], 1e-12);
            near(&[found.ln_evidence.unwrap()], &[ln_evidence], 1e-12);
        }
    }
    // No other value is possible here: ln P(W = 0, C = 3, A = 3) = −2700 − ln 16.
    let inputs = Inputs::new();
    let network = Network::of(&Setting::new(&model, &inputs).unwrap()).unwrap();
    let observed = NetworkEvidence { hard: vec![(0, 3), (1, 3), (2, 0)], likelihoods: Vec::new() };
    let (_, found) = most_probable(&network, &observed).unwrap();
    near(&[found], &[-2700.0 - 16f64.ln()], 1e-12);
}

#[test]
fn readings_billions_of_deviations_away() {
    // P(C | x) ∝ P(C) exp(−(x − C)²/2): by hand, the odds of C = 2 to C = 1 are 5/3 exp(x − 1.5); A is irrelevant.
    let text =
        "program Far { variables { C : 0..=2; A : bool; X : real; } decomposition { P(C) P(A) P(X | C) }
        forms { P(C) = categorical(0.2, 0.3, 0.5); P(A) = bernoulli(0.125); P(X | C) = normal(C, 1); } }";
    for x in [4e9, 1e10, 1e15] {
        let found = answer(text, &format!("P(C | X = {x})"), &Inputs::new());
        near(&numbers(&found), &[0.0, 0.0, 1.0], 0.0);
        near(&[found.ln_evidence.unwrap()], &[-0.5 * (x - 2.0) * (x - 2.0)], 1e-12);
        near(&numbers(&answer(text, &format!("P(A | X = {x})"), &Inputs::new())), &[0.875, 0.125], 1e-15);
    }
    for x in [1e30, -1e200] {
        let error = try_answer(text, &format!("P(C | X = {x})"), &Inputs::new()).unwrap_err().to_string();
        assert!(error.contains("beyond the range of numbers"), "{error}");
    }
}

#[test]
fn chains_over_time_weigh_far_observations() {
    let model = model_of(
        "program Drift { variables { X, X^-1, Z1, Z2 : 0..=100; }
         decomposition { P(X^-1) P(X | X^-1) P(Z1 | X) P(Z2 | X) }
         forms { P(X^-1) = previous(X) else uniform; P(X | X^-1) = normal(X^-1, 0.05);
                 P(Z1 | X) = normal(X, 1); P(Z2 | X) = normal(X, 1); } }",
    );
    let row = |one: f64, other: f64| vec![("Z1".to_owned(), one), ("Z2".to_owned(), other)];
    let rows = [row(0.0, 100.0), row(5.0, 95.0), row(40.0, 80.0)];
    let asked = question(&model, "expectation smooth P(X | Z1 Z2)");
    let found = ask_over_time(&model, &asked, &rows, &Inputs::new(), Sampling::default()).unwrap().remove(0);
    assert!((found.ln_evidence.unwrap() + 5_001.810_332_225_573).abs() < 5e-6, "{found:?}");
    for row in &found.answer {
        let Figure::Expectation { expectation, .. } = row.figure else { panic!("{row:?}") };
        assert!((expectation - 53.263_145_144_657_03).abs() < 1e-7, "{expectation}");
    }
}
