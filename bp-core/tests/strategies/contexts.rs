//! Reals for each value of what is known, fields at the values of variables, and constants.
//!
//! In: programs of a decision, of a field, of a constant. Out: exact answers. Invariant: expected values are sums over all values,
//! written out by hand.

use bp_core::prelude::*;

fn program(text: &str) -> Program {
    Program::parse(text).unwrap_or_else(|error| panic!("{error}"))
}

/// The names of the values of each row, and its number.
fn rows(program: &Program, question: &str) -> Vec<(Vec<String>, f64)> {
    let posterior = program.ask(question).unwrap_or_else(|error| panic!("{question}: {error}"));
    assert!(posterior.answer().estimate.is_none(), "{question} is estimated");
    let row = |row: &bp_core::compiler::answer::Row| {
        let values = row.values.iter().map(|(_, value)| value.clone()).filter(|value| !value.is_empty());
        (values.collect(), row.figure.number().unwrap())
    };
    posterior.answer().answer.iter().map(row).collect()
}

#[track_caller]
fn are(found: Vec<(Vec<String>, f64)>, expected: &[(&[&str], f64)]) {
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for ((values, number), (names, expected)) in found.iter().zip(expected) {
        assert_eq!(values, names);
        assert!(
            (number - expected).abs() < 1e-12 * expected.abs().max(1.0),
            "{names:?}: {number}, {expected}"
        );
    }
}

const UMBRELLA: &str = "program Umbrella {
    variables { Rain, Take : bool; Look : { dark, bright, green }; U : real; }
    decomposition { P(Rain) P(Look | Rain) P(Take) P(U | Rain Take) }
    forms { P(Rain) = bernoulli(0.3); P(Look | Rain) = table { false: 0.2, 0.8, 0; true: 0.9, 0.1, 0; }; P(Take) = bernoulli(0.5);
            P(U | Rain Take) = dirac(if Take { 50 } else { if Rain { 0 } else { 100 } }); }
}";

/// P(dry | dark) = 0.14/0.41 and P(dry | bright) = 0.56/0.59; nothing looks green.
#[test]
fn a_utility_is_expected_for_each_observation() {
    let umbrella = program(UMBRELLA);
    let [dark, bright] = [0.14 / 0.41, 0.56 / 0.59];
    are(
        rows(&umbrella, "expectation P(U | Look Take)"),
        &[
            (&["dark", "false"], 100.0 * dark),
            (&["dark", "true"], 50.0),
            (&["bright", "false"], 100.0 * bright),
            (&["bright", "true"], 50.0),
        ],
    );
    are(
        rows(&umbrella, "expectation P(U | Look)"),
        &[(&["dark"], 25.0 + 50.0 * dark), (&["bright"], 25.0 + 50.0 * bright)],
    );
    let variance = |dry: f64| {
        let mean = 25.0 + 50.0 * dry;
        0.5 * 2500.0 + 0.5 * 10_000.0 * dry - mean * mean
    };
    are(
        rows(&umbrella, "variance P(U | Look)"),
        &[(&["dark"], variance(dark)), (&["bright"], variance(bright))],
    );
    // One of the values is given by its name.
    are(rows(&umbrella, "expectation P(U | Look, Take = false)")[..1].to_vec(), &[(&["dark"], 100.0 * dark)]);
}

/// A rate with a conjugate prior in each context: gamma(7, 2), gamma(7, 3) and gamma(7, 4).
#[test]
fn a_rate_has_a_distribution_in_each_context() {
    let rate = program(
        "program Rate { variables { L : real; N : 0..=2; M : real; } decomposition { P(L) P(N) P(M | L N) }
         forms { P(L) = gamma(1, 1); P(N) = uniform; P(M | L N) = poisson(L * (N + 1)); } }",
    );
    are(
        rows(&rate, "expectation P(L | N, M = 6)"),
        &[(&["0"], 7.0 / 2.0), (&["1"], 7.0 / 3.0), (&["2"], 7.0 / 4.0)],
    );
}

/// P(X = 1 | Y = 1) = 0.6/0.625 and P(X = 1 | Y = 0) = 0.15/0.375.
#[test]
fn a_field_is_read_at_the_value_of_a_variable() {
    let field = program(
        "program Field { parameters { w[0..=1] : real = [2, 5]; } variables { X, Y : 0..=1; } decomposition { P(X) P(Y | X) }
         forms { P(X) = categorical(0.25, 0.75); P(Y | X) = table { 0: 0.9, 0.1; 1: 0.2, 0.8; }; } }",
    );
    let expected = |p: f64| 2.0 + 3.0 * p;
    are(rows(&field, "expectation P(w[X] | Y = 1)"), &[(&[], expected(0.96))]);
    are(rows(&field, "expectation P(w[X] | Y)"), &[(&["0"], expected(0.4)), (&["1"], expected(0.96))]);
    are(rows(&field, "P(X | w[X] = 5)"), &[(&["0"], 0.0), (&["1"], 1.0)]);
    let message = field.ask("P(w[1] | Y = 1)").unwrap_err().to_string();
    assert!(message.contains("`w[1]` contains no variable"), "{message}");
}

/// Y = 2 X + noise, X of mean 1 and variance 4: P(Y = 3) has the mean 2 and the variance 17, X then 1 + (8/17) 1.
#[test]
fn a_constant_is_a_number_of_other_forms() {
    let text = "program Scale { variables { B, C, X, Y : real; } decomposition { P(B) P(C | B) P(X) P(Y | C X) }
         forms { P(B) = dirac(1); P(C | B) = dirac(B + 1); P(X) = normal(1, 2); P(Y | C X) = normal(C * X, 1); } }";
    let scale = program(text);
    are(rows(&scale, "expectation P(X | Y = 3)"), &[(&[], 1.0 + 8.0 / 17.0)]);
    are(rows(&scale, "expectation P(C | Y = 3)"), &[(&[], 2.0)]);
    // Known at another value it is impossible, not replaced.
    let message = scale.ask("P(X | Y = 3, C = 3)").unwrap_err().to_string();
    assert!(message.contains("probability zero"), "{message}");
    let counts = program(
        "program Counts { variables { C, L : real; N : real; } decomposition { P(C) P(L) P(N | C L) }
         forms { P(C) = dirac(2); P(L) = gamma(3, 1); P(N | C L) = poisson(C * L); } }",
    );
    // gamma(6, 3)
    are(rows(&counts, "expectation P(L | N = 3)"), &[(&[], 2.0)]);
}
