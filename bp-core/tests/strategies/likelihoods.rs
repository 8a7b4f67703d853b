//! Likelihoods of a variable that is asked, and several likelihoods of one variable (virtual evidence, Pearl).
//!
//! In: a program of three variables. Out: the answers of each strategy, compared with products by hand.

use bp_core::prelude::*;

/// P(Wet = true) = 0.3 · 0.9 + 0.7 · (0.9 · 0.9 + 0.1 · 0.1) = 0.844; given rain it is 0.9, else 0.82.
const LAWN: &str = "program Lawn {
    variables { Rain, Sprinkler, Wet : bool; }
    decomposition { P(Rain) P(Sprinkler | Rain) P(Wet | Rain Sprinkler) }
    forms {
        P(Rain) = bernoulli(0.3);
        P(Sprinkler | Rain) = bernoulli(if Rain { 0.1 } else { 0.9 });
        P(Wet | Rain Sprinkler) = bernoulli(if Rain or Sprinkler { 0.9 } else { 0.1 });
    }
}";

#[test]
fn of_the_variable_that_is_asked_and_several_of_one() {
    let wet = 0.844 * 0.8 / (0.844 * 0.8 + 0.156 * 0.2);
    // The likelihoods multiply: 0.2 · 0.5 and 0.8 · 0.9.
    let of = |wet: f64| (1.0 - wet) * 0.1 + wet * 0.72;
    let rain = 0.3 * of(0.9) / (0.3 * of(0.9) + 0.7 * of(0.82));
    let cases = [
        ("P(Wet | Wet virtual [0.2, 0.8])", wet),
        ("P(Rain | Wet virtual [0.2, 0.8], Wet virtual [0.5, 0.9])", rain),
    ];
    for (strategy, tolerance) in [("sums", 1e-14), ("join_tree", 1e-14), ("weighting", 0.01), ("gibbs", 0.02)]
    {
        let program = Program::parse(LAWN).unwrap().by(strategy).unwrap();
        for (question, expected) in cases {
            let p = program.ask(question).unwrap().p(true).unwrap();
            assert!((p - expected).abs() < tolerance, "{strategy}, {question}: {p}, expected {expected}");
        }
    }
}

#[test]
fn a_value_is_known_once() {
    let program = Program::parse(LAWN).unwrap();
    for (question, said) in [
        ("P(Wet | Wet = true)", "this question asks what it knows: `Wet` is on both sides"),
        ("P(Wet | Wet soft [0.2, 0.8])", "this question asks what it knows: `Wet` is on both sides"),
        ("P(Rain | Wet = true, Wet virtual [0.2, 0.8])", "`Wet` is known twice"),
    ] {
        let error = program.ask(question).unwrap_err().to_string();
        assert!(error.contains(said), "{question}: {error}");
    }
}
