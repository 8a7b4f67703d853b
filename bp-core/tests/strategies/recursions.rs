//! Families whose elements depend on earlier ones.
//!
//! In: chains, hidden chains and recursions of known values. Out: posteriors, by each strategy that answers. Invariant: expected
//! values are from fractions, enumeration by hand, or a filter written out in the test.

use bp_core::prelude::*;

/// P(Z₃) and ln P(x) of [`HIDDEN`] for x = 1, 1, 0, 1, 0.
const EXPECTED: f64 = 2572.0 / 3577.0;
const LN_EVIDENCE: f64 = -4.080_363_257_759_551;

const HIDDEN: &str = "program Hidden {
    variables { Z[1..=5], X[1..=5] : bool; }
    decomposition { P(Z[1]) prod(t in 2..=5) { P(Z[t] | Z[t - 1]) } prod(t) { P(X[t] | Z[t]) } }
    forms {
        P(Z[1]) = bernoulli(0.5);
        P(Z[t] | Z[t - 1]) = table { false: 0.9, 0.1; true: 0.2, 0.8; };
        P(X[t] | Z[t]) = bernoulli(if Z[t] { 0.7 } else { 0.1 });
    }
}";

const MOVING_AVERAGE: &str = "program MovingAverage {
    parameters { N : size; mu : real = 1; phi : real = 0.5; theta : real = 0.25; }
    variables { Nu[1..=N], Y[1..=N] : real; }
    decomposition {
        P(Nu[1]) prod(t in 2..=N) { P(Nu[t] | Nu[t - 1] Y[t - 1]) }
        prod(t in 1..=N) { P(Y[t] | Nu[t]) }
    }
    forms {
        P(Nu[1]) = dirac(mu + phi * mu);
        P(Nu[t] | Nu[t - 1] Y[t - 1]) = dirac(mu + phi * Y[t - 1] + theta * (Y[t - 1] - Nu[t - 1]));
        P(Y[t] | Nu[t]) = normal(Nu[t], 1);
    }
}";

fn program(text: &str) -> Program {
    Program::parse(text).unwrap_or_else(|error| panic!("{error}"))
}

#[track_caller]
fn near(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance * expected.abs().max(1.0), "{found}, expected {expected}");
}

#[track_caller]
fn refused(text: &str, words: &str) {
    let message = Program::parse(text).map(|_| "read").unwrap_err().to_string();
    assert!(message.contains(words), "{message}\nexpected: {words}");
}

/// All 32 sequences of states, in fractions.
#[test]
fn a_hidden_chain_is_its_enumeration() {
    let asked = |by: &str| {
        let program = if by.is_empty() { program(HIDDEN) } else { program(HIDDEN).by(by).unwrap() };
        let question = program.question("P(Z[3] | X = x)").unwrap();
        question.given("x", vec![true, true, false, true, false]).unwrap().ask().unwrap()
    };
    for by in ["", "sums", "join_tree"] {
        let posterior = asked(by);
        near(posterior.p(true).unwrap(), EXPECTED, 1e-14);
        near(posterior.ln_evidence().unwrap(), LN_EVIDENCE, 1e-14);
    }
    for by in ["gibbs", "weighting"] {
        let posterior = asked(by);
        let [p, error] = posterior.p_and_error(true).unwrap();
        assert!((p - EXPECTED).abs() < 4.0 * error, "{by}: {p} ± {error}");
    }
}

/// Y₃ is missing: ν₄ = 1 + Y₃/2 + (Y₃ − ν₃)/4 with Y₃ ~ N(ν₃, 1), ν₃ = 1 + 3/2 + (3 − ν₂)/4, ν₂ = 17/8.
#[test]
fn families_may_depend_on_each_others_earlier_elements() {
    let rows = || Rows::new().column("Y", [2.0, 3.0, f64::NAN, f64::NAN]);
    let program = program(MOVING_AVERAGE).rows(rows()).unwrap();
    let next = program.ask("P(Y[4])").unwrap();
    assert_eq!(next.strategy().name(), "gaussian");
    near(next.mean().unwrap(), 2.359_375, 1e-14);
    near(next.deviation().unwrap(), 1.25, 1e-14);
    let drawn = program.by("weighting").unwrap().ask("P(Y[4])").unwrap();
    let [mean, error] = drawn.mean_and_error().unwrap();
    assert!((mean - 2.359_375).abs() < 4.0 * error, "{mean} ± {error}");
}

/// From 0 to 0 and 1: 1 and 2 times; from 1 to 0 and 1: once each.
#[test]
fn unknown_transitions_are_counted() {
    let chain = program(
        "program Chain {
            variables { Stay[1..=2] : real; Z[1..=6] : bool; }
            decomposition { prod(k) { P(Stay[k]) } P(Z[1]) prod(t in 2..=6) { P(Z[t] | Z[t - 1] Stay) } }
            forms {
                P(Stay[k]) = beta(1, 1);
                P(Z[1]) = bernoulli(0.5);
                P(Z[t] | Z[t - 1] Stay) = if Z[t - 1] { bernoulli(Stay[2]) } else { bernoulli(Stay[1]) };
            }
        }",
    );
    let question = chain.question("P(Stay | Z = z)").unwrap();
    let posterior = question.given("z", vec![false, false, true, true, false, true]).unwrap().ask().unwrap();
    assert_eq!(posterior.strategy().name(), "conjugate");
    near(posterior.of("Stay[1]").unwrap().mean().unwrap(), 0.6, 1e-14);
    near(posterior.of("Stay[2]").unwrap().mean().unwrap(), 0.5, 1e-14);
}

/// A level that walks, seen with noise at 20 000 instants: a filter of one number, written out here.
#[test]
fn a_long_walk_is_filtered() {
    const N: usize = 20_000;
    let walk = program(
        "program Walk {
            parameters { N : size; }
            variables { Level[1..=N], Y[1..=N] : real; }
            decomposition {
                P(Level[1]) prod(t in 2..=N) { P(Level[t] | Level[t - 1]) } prod(t in 1..=N) { P(Y[t] | Level[t]) }
            }
            forms {
                P(Level[1]) = normal(0, 3);
                P(Level[t] | Level[t - 1]) = normal(Level[t - 1], 0.5);
                P(Y[t] | Level[t]) = normal(Level[t], 2);
            }
        }",
    );
    let seen: Vec<f64> = (0..N).map(|t| (t as f64 * 0.37).sin() * 3.0 + (t as f64 * 0.011).cos()).collect();
    let (mut mean, mut variance, mut ln) = (0.0, 9.0, 0.0);
    for (t, seen) in seen.iter().enumerate() {
        variance += if t > 0 { 0.25 } else { 0.0 };
        let total = variance + 4.0;
        ln -= 0.5 * ((seen - mean).powi(2) / total + (std::f64::consts::TAU * total).ln());
        mean += variance / total * (seen - mean);
        variance *= 4.0 / total;
    }
    let start = std::time::Instant::now();
    let last = walk.rows(Rows::new().column("Y", seen)).unwrap().ask(&format!("P(Level[{N}])")).unwrap();
    println!("{:?}", start.elapsed());
    near(last.mean().unwrap(), mean, 1e-11);
    near(last.variance().unwrap(), variance, 1e-11);
    near(last.ln_evidence().unwrap(), ln, 1e-11);
}

/// The first two elements have forms of their own, one of which depends on another variable: P(Z₃) by hand.
#[test]
fn first_elements_have_factors_of_their_own() {
    let chain = program(
        "program Chain {
            variables { A : bool; Z[1..=3] : bool; }
            decomposition { P(A) P(Z[1] | A) P(Z[2] | Z[1]) prod(t in 3..=3) { P(Z[t] | Z[t - 1] Z[t - 2]) } }
            forms {
                P(A) = bernoulli(0.25);
                P(Z[1] | A) = table { 0.5, 0.5; 0.9, 0.1; };
                P(Z[2] | Z[1]) = table { 0.8, 0.2; 0.3, 0.7; };
                P(Z[t] | Z[t - 1] Z[t - 2]) = table { 1, 0; 0.75, 0.25; 0.5, 0.5; 0, 1; };
            }
        }",
    );
    // P(Z₁) = 0.4; then Z₁ Z₂ = 00, 01, 10, 11 have 0.48, 0.12, 0.12, 0.28, and rows are of Z₂ Z₁.
    near(chain.ask("P(Z[3])").unwrap().p(true).unwrap(), 0.12 * 0.5 + 0.12 * 0.25 + 0.28, 1e-15);
    let marginals = chain.marginals(&evidence! {}).unwrap();
    near(marginals.of("Z[3]").unwrap().p(true).unwrap(), 0.37, 1e-15);
}

#[test]
fn wrong_elements_are_named() {
    let chain = |decomposition: &str, form: &str| {
        format!(
            "program Chain {{
                variables {{ Y[1..=5], X[1..=5] : real; }}
                decomposition {{ {decomposition} prod(t) {{ P(X[t] | Y[t]) }} }}
                forms {{ P(Y[1]) = normal(0, 1); {form}; P(X[t] | Y[t]) = normal(Y[t], 1); }}
            }}"
        )
    };
    let form = "P(Y[t] | Y[t - 1]) = normal(Y[t - 1], 1)";
    let after = |range: &str| chain(&format!("P(Y[1]) prod(t in {range}) {{ P(Y[t] | Y[t - 1]) }}"), form);
    assert!(Program::parse(&after("2..=5")).is_ok());
    refused(&after("3..=5"), "`Y[2]` has no distribution");
    refused(&after("1..=5"), "the elements of `Y` have two distributions");
    refused(&after("2..=6"), "`Y` has the elements 1..=5, but `P(Y[t] | Y[t - 1])` is of 2..=6");
    let whole =
        |form: &str| chain("prod(t) { P(Y[t] | Y[t - 1]) }", form).replace("P(Y[1]) = normal(0, 1);", "");
    refused(&whole(form), "where t = 1, `P(Y[t] | Y[t - 1])` reads `Y[0]`, which does not exist");
    assert!(
        Program::parse(&whole("P(Y[t] | Y[t - 1]) = if t > 1 { normal(Y[t - 1], 1) } else { normal(0, 1) }"))
            .is_ok()
    );
    let with =
        |right: &str, form: &str| chain(&format!("P(Y[1]) prod(t in 2..=5) {{ P(Y[t] | {right}) }}"), form);
    refused(
        &with("Y[t + 1]", "P(Y[t] | Y[t + 1]) = normal(Y[t + 1], 1)"),
        "an element of a family may depend on earlier ones, such as `Y[t - 1]`",
    );
    refused(
        &with("Y[t - 1]", "P(Y[t] | Y[t - 1]) = normal(Y[t - 2], 1)"),
        "`Y[t - 2]` is not on the right of `P(Y[t] | Y[t - 1])`",
    );
    refused(
        &with("Y[t - 2]", "P(Y[t] | Y[t - 2]) = normal(Y[t - 2], 1)"),
        "where t = 2, `P(Y[t] | Y[t - 2])` reads `Y[0]`, which does not exist",
    );
    refused(
        &with("Y[t - 1]", "P(Y[t] | Y[t - 1]) = unknown"),
        "`P(Y[t] | Y[t - 1])` is `unknown`, but forms of some elements are not learned",
    );
    refused(
        &with("Y[t - 1] X[t - 1] X[t + 1]", "P(Y[t] | Y[t - 1] X[t - 1] X[t + 1]) = normal(X[t + 1], 1)"),
        "the decomposition has a cycle: Y ← X ← Y",
    );
}
