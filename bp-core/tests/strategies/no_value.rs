//! Variables that may have no value, and parameters that have no number at an index: where a sum leaves its range, or all weights are 0, the parents' values are impossible.
//!
//! In: programs with such a variable, which is neither searched nor known. Out: answers of every strategy. Invariant: expected values
//! are sums over all dice and closed forms, in the comments; every way to ask gives the same.

use crate::support::{model_of, question};
use bp_core::compiler::answer::{Answer, Figure, ask, ask_over_time, compile_by};
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::model::Model;
use bp_core::compiler::plan::Strategy;
use bp_core::compiler::sample::Sampling;

fn asked(program: &str, text: &str) -> Answer {
    let model = model_of(program);
    ask(&model, &question(&model, text), &Inputs::new()).unwrap_or_else(|error| panic!("{error}")).remove(0)
}

fn figures(answer: &Answer) -> Vec<f64> {
    answer.answer.iter().map(|row| row.figure.number().unwrap()).collect()
}

#[track_caller]
fn near(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len(), "{found:?} {expected:?}");
    let all = found.iter().zip(expected).all(|(p, q)| (p - q).abs() <= tolerance);
    assert!(all, "{found:?}, expected {expected:?}");
}

/// Two dice whose sum is at most 7: A = a has 7 − a of the 21 pairs.
const DICE: &str = "program Dice { variables { A, B : 1..=6; S : 2..=7; X, Y : real; }
    decomposition { P(A) P(B) P(S | A B) P(X | A) P(Y | X) }
    forms { P(A) = uniform; P(B) = uniform; P(S | A B) = dirac(A + B); P(X | A) = normal(A, 1); P(Y | X) = normal(X, 1); } }";

#[test]
fn mixtures_know_what_has_no_value() {
    // P(a | y) ∝ (7 − a) exp(−(6 − a)² / 4), and P(y) = Σ (7 − a) / 36 · N(6; a, √2).
    let weight = |a: f64| (7.0 - a) * (-(6.0 - a).powi(2) / 4.0).exp();
    let total: f64 = (1..=6).map(|a| weight(f64::from(a))).sum();
    let expected: Vec<f64> = (1..=6).map(|a| weight(f64::from(a)) / total).collect();
    let found = asked(DICE, "P(A | Y = 6)");
    near(&figures(&found), &expected, 1e-12);
    let ln = (total / 36.0 / (2.0 * std::f64::consts::TAU).sqrt()).ln();
    assert!((found.ln_evidence.unwrap() - ln).abs() < 1e-12, "{:?} {ln}", found.ln_evidence);
    // E X = Σ a (7 − a) / 21 = 56 / 21.
    near(&figures(&asked(DICE, "expectation P(X)")), &[56.0 / 21.0], 1e-12);
    // Evidence that says nothing changes nothing.
    near(&figures(&asked(DICE, "P(A | Y = 6, S virtual [1, 1, 1, 1, 1, 1])")), &expected, 1e-12);
}

#[test]
fn draws_know_what_has_no_value() {
    let program = "program D { variables { Y : bool; N : 0..=2; R : real; } decomposition { P(Y) P(N | Y) P(R | Y) }
        forms { P(Y) = bernoulli(0.5); P(N | Y) = dirac(if Y { 1 } else { 5 }); P(R | Y) = normal(if Y { 1 } else { 0 }, 1); } }";
    let model = model_of(program);
    for by in [Strategy::Weighting, Strategy::Gibbs, Strategy::Sums] {
        let compiled = compile_by(&model, &question(&model, "P(Y | R = 0)"), Some(by)).unwrap();
        let answers = compiled.ask_with(&Inputs::new(), Sampling { particles: 2000, seed: 1 }).unwrap();
        near(&figures(&answers[0]), &[0.0, 1.0], 1e-12);
    }
}

#[test]
fn conjugate_answers_know_what_has_no_value() {
    // K is true: T ~ beta(3, 2).
    let program = "program D { variables { T : real; K : bool; X : 0..=2; J : bool; } decomposition { P(T) P(K | T) P(X | K) P(J | T) }
        forms { P(T) = beta(2, 2); P(K | T) = bernoulli(T); P(X | K) = weights(if K { 1 } else { 0 }); P(J | T) = bernoulli(T); } }";
    for (text, expected) in [("P(K)", [0.0, 1.0]), ("P(J)", [0.4, 0.6])] {
        near(&figures(&asked(program, text)), &expected, 0.01);
    }
    let found = asked(program, "expectation P(T)");
    let Figure::Expectation { expectation, .. } = found.answer[0].figure else { panic!("{found:?}") };
    assert!((expectation - 0.6).abs() < 0.01, "{expectation}");
    // A count over a range with 0 always has a value: the answer stays exact.
    let program = "program D { variables { L : real; N : 0..=20; K : 0..=5; Y : real; } decomposition { P(L) P(N | L) P(K) P(Y | L) }
        forms { P(L) = gamma(2, 3); P(N | L) = poisson(L); P(K) = binomial(5, 0.3); P(Y | L) = exponential(L); } }";
    let found = asked(program, "P(L | Y = 1)");
    assert!(matches!(found.answer[0].figure, Figure::Law { .. }), "{found:?}");
}

/// The labels of S are the numbers 0, 1 and 2, so that `p[1..=3]` has no number for the first of them.
#[test]
fn an_index_outside_the_range_of_a_parameter_is_an_error() {
    let program = |parameters: &str, form: &str| {
        model_of(&format!(
            "program Sky {{ parameters {{ {parameters} }} variables {{ S : {{ Sun, Cloud, Rain }}; U : bool; W[i in 1..=4] : bool; }}
             decomposition {{ P(S) P(U | S) prod(i) {{ P(W[i]) }} }}
             forms {{ P(S) = uniform; P(U | S) = bernoulli({form}); P(W[i]) = bernoulli(p[i]); }} }}"
        ))
    };
    let of = |model: &Model, text: &str| ask(model, &question(model, text), &Inputs::new());
    let wrong = program("p[1..=4] : probability = [0.1, 0.2, 0.9, 0.5]; ", "p[S]");
    let refused = of(&wrong, "P(S | U = true)").unwrap_err().to_string();
    assert!(refused.contains("bernoulli(p[S])") && refused.contains("S = Sun"), "{refused}");
    assert!(refused.contains("`p[S]` has no number at 0"), "{refused}");
    // One number for all elements is none for others.
    let one = program("q[1..=3] : probability = 0.5; p[1..=4] : probability = 0.5; ", "q[S]");
    let refused = of(&one, "P(S | U = true)").unwrap_err().to_string();
    assert!(refused.contains("`q[S]` has no number at 0"), "{refused}");
    // Where the range fits: (0.1, 0.2, 0.9) / 1.2.
    let right = program("q[0..=2] : probability = [0.1, 0.2, 0.9]; p[1..=4] : probability = 0.5; ", "q[S]");
    let found = of(&right, "P(S | U = true)").unwrap();
    let found: Vec<f64> = found[0].answer.iter().map(|row| row.p().unwrap()).collect();
    let near = |one: &f64, other: f64| (one - other).abs() < 1e-12;
    assert!(near(&found[0], 1.0 / 12.0) && near(&found[2], 0.75), "{found:?}");
    // An index that is outside only in a case that does not hold is none.
    let guarded =
        program("p[1..=4] : probability = [0.1, 0.2, 0.9, 0.5]; ", "if S == Sun { 0.3 } else { p[S] }");
    let found = of(&guarded, "P(U = true)").unwrap();
    assert!(near(&found[0].answer[0].p().unwrap(), (0.3 + 0.1 + 0.2) / 3.0), "{found:?}");
    // A product over more elements than the parameter has.
    let short = program("p[1..=3] : probability = [0.1, 0.2, 0.9]; ", "0.5");
    assert!(of(&short, "P(W[4])").is_err());
    assert!(of(&short, "P(W)").is_err());
}

/// 3 · 0.1 · 10 is 3.0000000000000004 in f64: it is 3 in a range, as it is in a bin and in an observation.
#[test]
fn a_range_holds_numbers_that_are_whole_up_to_rounding() {
    let model = model_of(
        "program Rounded { variables { J, D : 0..=10; F : real; } decomposition { P(J) P(D | J) P(F | J) }
         forms { P(J) = uniform; P(D | J) = dirac(J * 0.1 * 10); P(F | J) = normal(J, 1); } }",
    );
    for by in [None, Some(Strategy::Sums), Some(Strategy::JoinTree)] {
        let compiled = compile_by(&model, &question(&model, "P(J)"), by).unwrap();
        near(&figures(&compiled.ask(&Inputs::new()).unwrap()[0]), &[1.0 / 11.0; 11], 1e-12);
        let compiled = compile_by(&model, &question(&model, "P(J = 3 | D = 3)"), by).unwrap();
        near(&figures(&compiled.ask(&Inputs::new()).unwrap()[0]), &[1.0], 1e-12);
    }
    let found = ask(&model, &question(&model, "expectation P(F)"), &Inputs::new()).unwrap();
    near(&figures(&found[0]), &[5.0], 1e-12);
    // What is no whole number has no place in a range.
    let half = model_of(
        "program Half { variables { J : 0..=3; D : 0..=3; } decomposition { P(J) P(D | J) }
         forms { P(J) = uniform; P(D | J) = dirac(J * 0.5); } }",
    );
    let found = ask(&half, &question(&half, "P(J)"), &Inputs::new()).unwrap();
    near(&figures(&found[0]), &[0.5, 0.0, 0.5, 0.0], 1e-12);
}

/// S counts up from 0..=3, uniform at first, and Z is observed: P(z) = ¼ Σ (0.1 + 0.2 s) over the starts that have a value after one
/// step (1 to 3), or after two (2 and 3 at the second instant).
#[test]
fn a_prediction_counts_that_there_are_values() {
    let model = model_of(
        "program Up { variables { S, S^-1 : 0..=3; Z : bool; } decomposition { P(S^-1) P(S | S^-1) P(Z | S) }
         forms { P(S^-1) = previous(S) else uniform; P(S | S^-1) = dirac(S^-1 + 1); P(Z | S) = bernoulli(0.1 + 0.2 * S); } }",
    );
    let seen = vec![("Z".to_owned(), 1.0)];
    let ln = |text: &str, rows: &[Vec<(String, f64)>]| {
        let sampling = Sampling::default();
        let answers = ask_over_time(&model, &question(&model, text), rows, &Inputs::new(), sampling).unwrap();
        answers[0].ln_evidence.unwrap()
    };
    let [one, two] = [(0.3 + 0.5 + 0.7) / 4.0, (0.3 + 0.5) / 4.0].map(f64::ln);
    assert!((ln("filter P(S | Z)", std::slice::from_ref(&seen)) - one).abs() < 1e-12);
    assert!((ln("predict(1) P(S | Z)", std::slice::from_ref(&seen)) - two).abs() < 1e-12);
    assert!((ln("filter P(S | Z)", &[seen, Vec::new()]) - two).abs() < 1e-12);
}
