//! The most probable values of finite variables and of reals that they determine.
//!
//! In: programs as texts. Out: values and their probabilities. Invariant: a value that has a probability exceeds one that has a
//! density; expected values are read off the program.

use bp_core::prelude::*;

fn program(k: &str, rest: [&str; 3]) -> Program {
    let [variables, factors, forms] = rest;
    Program::parse(&format!(
        "program Modes {{ variables {{ K : 0..=2; {variables} }} decomposition {{ P(K) {factors} }}
         forms {{ P(K) = categorical({k}); {forms} }} }}"
    ))
    .unwrap_or_else(|error| panic!("{error}"))
}

const POINT: [&str; 3] = ["Y : real;", "P(Y | K)", "P(Y | K) = dirac(0.1 * K);"];
const LINE: [&str; 3] =
    ["X, Y : real;", "P(X | K) P(Y | X)", "P(X | K) = normal(K, 1); P(Y | X) = dirac(2 * X);"];
const BOTH: [&str; 3] =
    ["Y : real;", "P(Y | K)", "P(Y | K) = if K == 1 { dirac(0.1) } else { normal(0, 0.001) };"];

/// The rows of an answer, as text.
fn rows(found: &Posterior) -> Vec<Vec<String>> {
    let row =
        |row: &bp_core::compiler::answer::Row| row.values.iter().map(|(_, text)| text.clone()).collect();
    found.answer().answer.iter().map(row).collect()
}

/// ln of the probability of an assignment.
fn ln_p(found: &Posterior) -> f64 {
    found.answer().answer.iter().next().and_then(|row| row.figure.number()).unwrap()
}

#[test]
fn a_determined_real_has_the_probability_of_what_determines_it() {
    let program = program("0.05, 0.9, 0.05", POINT);
    let found = program.ask("argmax P(K Y)").unwrap();
    assert_eq!(rows(&found), [["1", "0.1"]]);
    let p = found.answer().answer.iter().next().and_then(|row| row.p()).unwrap();
    assert!((p - 0.9).abs() < 1e-15, "{p}");
    let whole = program.most_probable(&Evidence::new()).unwrap();
    assert!((ln_p(&whole) - 0.9f64.ln()).abs() < 1e-14);
}

#[test]
fn all_of_several_most_probable_values_are_listed() {
    let even = program("0.4, 0.2, 0.4", POINT);
    assert_eq!(rows(&even.ask("argmax P(Y)").unwrap()), [["0"], ["0.2"]]);
    assert_eq!(rows(&even.ask("argmax P(K Y)").unwrap()), [["0", "0"], ["2", "0.2"]]);
}

/// ln of 0.9 N(1; 1, 1).
#[test]
fn reals_on_a_line_are_compared_along_it() {
    let line = program("0.05, 0.9, 0.05", LINE);
    for (question, expected) in [("argmax P(K X Y)", ["1", "1", "2"]), ("argmax P(K Y X)", ["1", "2", "1"])] {
        assert_eq!(rows(&line.ask(question).unwrap()), [expected], "{question}");
    }
    let whole = line.most_probable(&Evidence::new()).unwrap();
    let expected = 0.9f64.ln() - 0.5 * std::f64::consts::TAU.ln();
    assert!((ln_p(&whole) - expected).abs() < 1e-13);
}

#[test]
fn a_probability_exceeds_a_density() {
    let found = program("0.45, 0.1, 0.45", BOTH).ask("argmax P(K Y)").unwrap();
    assert_eq!(rows(&found), [["1", "0.1"]]);
}
