//! Functions of finite variables, equations of reals, operands without a value, evidence on derived variables.
//!
//! In: programs and questions. Out: probabilities. Invariant: an expected value is counted or worked out by hand.

use bp_core::prelude::*;
use std::f64::consts::PI;
use std::time::{Duration, Instant};

const TWO: &str = "program Two {
    variables { A, B : 0..=3; C : bool; F[1..=13] : 0..=3; Y[1..=3] : bool; }
    decomposition { P(A) P(B) P(C | A) prod(i) { P(F[i]) } prod(i) { P(Y[i] | C) } }
    forms { P(A) = uniform; P(B) = categorical(0.4, 0.3, 0.2, 0.1); P(C | A) = bernoulli(0.25 * A);
        P(F[i]) = uniform; P(Y[i] | C) = bernoulli(if C { 0.9 } else { 0.2 }); } }";

fn program(text: &str) -> Program {
    Program::parse(text).unwrap_or_else(|wrong| panic!("{wrong}"))
}

fn ask(program: &Program, question: &str) -> Posterior {
    program.ask(question).unwrap_or_else(|error| panic!("{question}: {error}"))
}

#[track_caller]
fn close(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-12 * expected.abs().max(1e-3), "{found} ≠ {expected}");
}

/// A / (B + 1) is a half for (1, 1) with 0.3/4 and for (2, 3) with 0.1/4.
#[test]
fn functions_of_finite_variables_have_finitely_many_values() {
    for by in ["sums", "join_tree"] {
        let two = program(TWO).by(by).unwrap();
        let ratio = ask(&two, "P(A / (B + 1))");
        assert!(ratio.estimate().is_none());
        close(ratio.p(0.5).unwrap(), 0.1);
        close(ratio.p(3.0).unwrap(), 0.1);
        assert!(ratio.answer().answer.iter().any(|row| row.values[0].1 == "1.5"), "{ratio}");
        // E[A] E[1 / (B + 1)] = 1.5 (0.4 + 0.15 + 0.2/3 + 0.025).
        close(ask(&two, "expectation P(A / (B + 1))").number().unwrap(), 1.5 * (0.575 + 0.2 / 3.0));
        close(ask(&two, "P(A * 0.5 | C = true)").p(1.5).unwrap(), 0.5);
        close(ask(&two, "expectation P(exp(B))").number().unwrap(), {
            let e = std::f64::consts::E;
            0.4 + 0.3 * e + 0.2 * e * e + 0.1 * e * e * e
        });
    }
}

/// Of the 4¹³ combinations 56 230 176 have a sum above 15, counted by convolution.
#[test]
fn long_sums_are_chains_of_partial_sums() {
    let sum = (1..=13).map(|i| format!("F[{i}]")).collect::<Vec<_>>().join(" + ");
    let begun = Instant::now();
    for by in [None, Some("sums"), Some("join_tree")] {
        let two = by.map_or(program(TWO), |by| program(TWO).by(by).unwrap());
        close(ask(&two, &format!("P({sum} > 15)")).number().unwrap(), 56_230_176.0 / 67_108_864.0);
        close(ask(&two, &format!("expectation P({sum})")).number().unwrap(), 19.5);
        // A quarter of 0 alone: the sum of all is 0.
        close(ask(&two, &format!("P({sum})")).p(0).unwrap(), 0.25f64.powi(13));
        close(ask(&two, &format!("P(F[1] = 3 | {sum} = 39)")).number().unwrap(), 1.0);
    }
    assert!(begun.elapsed() < Duration::from_secs(10), "{:?}", begun.elapsed());
}

#[test]
fn two_variables_are_compared_by_two_signs() {
    let two = program(TWO);
    close(ask(&two, "P(A == B)").number().unwrap(), 0.25);
    close(ask(&two, "P(Y[3] == Y[1] | C = true)").number().unwrap(), 0.82);
    close(ask(&two, "P(Y[3] = Y[1] | C = true)").number().unwrap(), 0.82);
    let Err(wrong) = two.ask("P(A = B)") else { panic!("a variable is no value") };
    assert!(wrong.to_string().contains("write `A == B`"), "{wrong}");
}

/// 1 / A has no value where A = 0; `and` need not look at it there.
#[test]
fn operands_without_a_value_are_errors() {
    for by in ["sums", "join_tree", "weighting"] {
        let two = program(TWO).by(by).unwrap().seed(1);
        for question in ["P(1 / A > 0.4)", "P(ln(A) > 1)", "P(1 / A)", "P(C | 1 / A > 0.4)"] {
            let error = two.ask(question).map(|answer| answer.to_string());
            let error = error.expect_err(question).to_string();
            assert!(
                error.contains("must be a finite number") && error.contains("A = 0"),
                "{by}, {question}: {error}"
            );
        }
        if by != "weighting" {
            close(ask(&two, "P(A != 0 and 1 / A > 0.4)").number().unwrap(), 0.5);
            close(ask(&two, "P(A = 0 or 1 / A > 0.4)").number().unwrap(), 0.75);
            // Evidence may exclude it: A is 1, 2 or 3.
            close(ask(&two, "P(1 / A > 0.4 | A != 0)").number().unwrap(), 2.0 / 3.0);
            close(ask(&two, "expectation P(1 / A | A > 0)").number().unwrap(), (1.0 + 0.5 + 1.0 / 3.0) / 3.0);
        }
    }
}

/// Precisions: 2 T + noise = 5 adds 4 to 1/25; T + noise − B = 0 adds 1/2.
#[test]
fn equations_between_reals_are_known_by_their_difference() {
    let reals = program(
        "program Reals { variables { T, A, B, W : real; } decomposition { P(T) P(A | T) P(B) P(W | T) }
         forms { P(T) = normal(20, 5); P(A | T) = normal(T, 1); P(B) = normal(0, 1); P(W | T) = lognormal(0.01 * T, 1); } }",
    );
    let sum = ask(&reals, "P(T | T + A = 5)");
    close(sum.mean().unwrap(), 10.8 / 4.04);
    close(sum.variance().unwrap(), 1.0 / 4.04);
    assert_eq!(sum.question(), "P(T | T + A = 5)");
    // ln N(5; 40, 101)
    close(sum.ln_evidence().unwrap(), -9.290_855_227_268_867);
    close(ask(&reals, "P(T | A == B)").mean().unwrap(), 0.8 / 0.54);
    let Err(error) = reals.ask("P(W | T * T = 5)") else { panic!("it is not linear and Gaussian") };
    assert!(!error.to_string().contains("more draws"), "{error}");
    // The density of N(20, 25) at 3.
    close(
        ask(&reals, "P(T = 3)").number().unwrap(),
        (-0.5f64 * 17.0 * 17.0 / 25.0).exp() / (50.0 * PI).sqrt(),
    );
}

#[test]
fn virtual_evidence_on_predicates_and_slices() {
    let two = program(TWO);
    // B > 1 with 0.3: weights 0.7 · 0.2 and 0.3 · 0.8.
    close(ask(&two, "P(B > 1 | B > 0 virtual [0.2, 0.8])").number().unwrap(), 0.24 / (0.08 + 0.48));
    // Each element: C with 3/8 (0.1 · 0.2 + 0.9 · 0.8)², not C with 5/8 (0.8 · 0.2 + 0.2 · 0.8)².
    let (yes, no) = (0.375 * 0.74 * 0.74, 0.625 * 0.32 * 0.32);
    close(ask(&two, "P(C | Y[1..=2] virtual [0.2, 0.8])").p(true).unwrap(), yes / (yes + no));
}

#[test]
fn several_asks_may_be_typed() {
    let answers = program(TWO).ask_all("P(A | C = true); entropy P(A); P(A > 1)").unwrap();
    close(answers[0].p(3).unwrap(), 0.5);
    close(answers[1].number().unwrap(), 4f64.ln());
    close(answers[2].number().unwrap(), 0.5);
}
