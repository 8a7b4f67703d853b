//! Reals that other variables determine: their values have probabilities, in every door and strategy.
//!
//! In: a program. Out: probabilities and densities. Invariant: expected values are sums over the finite variables, written here.

use bp_core::compiler::answer::Figure;
use bp_core::prelude::*;

const TEXT: &str = "program Determined {
    variables { A : 0..=3; B : bool; W, V, X, Y, G : real; }
    decomposition { P(A) P(B) P(W | A B) P(V | W) P(X) P(Y | X) P(G | A) }
    forms {
        P(A) = uniform; P(B) = bernoulli(0.3); P(W | A B) = dirac(0.1 * (A + if B { 2 } else { 0 }));
        P(V | W) = normal(10 * W, 1); P(X) = normal(0, 1); P(Y | X) = dirac(2 * X);
        P(G | A) = gamma(A + 1, 2);
    }
}";

fn ask(text: &str) -> Posterior {
    let program = Program::parse(TEXT).unwrap();
    program.ask(text).unwrap_or_else(|error| panic!("{text}: {error}"))
}

fn figures(found: &Posterior) -> Vec<Figure> {
    found.answer().answer.iter().map(|row| row.figure).collect()
}

#[track_caller]
fn has_probability(text: &str, expected: f64) {
    match figures(&ask(text)).as_slice() {
        [Figure::Probability { p }] => assert!((p - expected).abs() <= 1e-12, "{text}: {p}, {expected}"),
        other => panic!("{text}: {other:?}"),
    }
}

#[track_caller]
fn has_density(text: &str, expected: f64) {
    match figures(&ask(text)).as_slice() {
        [Figure::Density { density }] => {
            assert!((density - expected).abs() <= 1e-12 * expected, "{text}: {density}, {expected}");
        }
        other => panic!("{text}: {other:?}"),
    }
}

/// P(W = w / 10), w = A + 2 B.
const P: [f64; 6] = [0.175, 0.175, 0.25, 0.25, 0.075, 0.075];

#[test]
fn a_value_has_its_probability() {
    has_probability("P(W = 0.3)", 0.25);
    has_probability("P(W = 0.35)", 0.0);
    has_probability("P(W = 0.3 | B = true)", 0.25);
    has_probability("P(A = 1, W = 0.3)", 0.075);
    let seen = |w: usize| P[w] * (-0.5 * (1.0 - w as f64).powi(2)).exp();
    let given = seen(3) / (0..6).map(seen).sum::<f64>();
    has_probability("P(W = 0.3 | V = 1)", given);
    has_probability("P(W == 0.3 | V = 1)", given);
    has_probability("P(Y = 2 | X = 1)", 1.0);
    has_probability("P(Y = 3 | X = 1)", 0.0);
    has_density("P(Y = 2)", (-0.5f64).exp() / (2.0 * std::f64::consts::TAU.sqrt()));
}

#[test]
fn modes_and_entropies_of_several_reals() {
    has_probability("argmax P(Y | X = 1)", 1.0);
    let both = ask("argmax P(W, Y | X = 1)");
    let rows = figures(&both);
    assert_eq!(rows.len(), 2, "{both}");
    assert!(rows.iter().all(|row| row.number().is_some_and(|p| (p - 0.25).abs() < 1e-12)), "{both}");
    has_probability("max P(W, Y | X = 1)", 0.25);
    has_probability("argmax P(W, Y | A = 1, X = 2)", 0.7);
    // Given the finite variables the reals are one normal distribution.
    has_density("argmax P(X, V | A = 1, B = true)", 1.0 / std::f64::consts::TAU);
    let nats = ask("entropy P(X, V | A = 1, B = true)").number().unwrap();
    assert!((nats - (std::f64::consts::TAU.ln() + 1.0)).abs() < 1e-12, "{nats}");
    // Where `B` is summed out they have a mixture, of which the mode of several is not computed.
    assert!(Program::parse(TEXT).unwrap().ask("argmax P(X, V | A = 1)").is_err());
}

/// P(A = 3 | W = 0.3) = 0.7, and G has the mean (A + 1) / 2.
#[test]
fn draws_meet_what_finite_variables_determine() {
    let program = Program::parse(TEXT).unwrap();
    for known in ["W = 0.3", "W == 0.3"] {
        let found = program.ask(&format!("P(G | {known})")).unwrap();
        let [mean, error] = found.mean_and_error().unwrap();
        assert!((mean - 1.7).abs() < 5.0 * error.max(1e-3), "{known}: {mean} ± {error}");
        let drawn = program.clone().by("weighting").unwrap().ask(&format!("P(A | {known})")).unwrap();
        assert!((drawn.p(3).unwrap() - 0.7).abs() < 0.02, "{known}: {drawn}");
    }
    // A constant is met by every draw, also of chains.
    let constant = "program Constant { variables { S, L, Y : real; } decomposition { P(S) P(L) P(Y | S L) }
        forms { P(S) = dirac(8); P(L) = gamma(2, 1); P(Y | S L) = normal(L, S); } }";
    let constant = Program::parse(constant).unwrap();
    for by in ["weighting", "gibbs"] {
        let by = constant.clone().by(by).unwrap();
        let [without, with] =
            ["P(L | Y = 1)", "P(L | Y = 1, S = 8)"].map(|text| by.ask(text).unwrap().mean().unwrap());
        assert!((without - with).abs() < 0.05, "{without} {with}");
    }
}

/// A law of a real beside the value of another variable would be that over all its values.
#[test]
fn a_value_beside_a_whole_distribution_is_refused() {
    for text in ["P(A = 1, V)", "P(V, B = true)", "P(X = 1, V)", "P(V > 1, X)"] {
        let refused = Program::parse(TEXT).unwrap().ask(text).map(|found| found.to_string());
        let refused = refused.expect_err(text).to_string();
        assert!(refused.contains("for the whole distribution of the real"), "{text}: {refused}");
    }
}
