//! Batches of a program with reals, steps that are forgotten, and likelihoods that are given later. Expected values: by hand.

use bp_core::prelude::*;

/// P(Rain | Depth = 2) = 1 / (1 + 3 e^-2), by the ratio of the densities.
const YARD: &str = "program Yard {
    variables { Rain, Wet : bool; Depth : real; }
    decomposition { P(Rain) P(Wet | Rain) P(Depth | Rain) }
    forms {
        P(Rain) = bernoulli(0.25);
        P(Wet | Rain) = bernoulli(if Rain { 0.9 } else { 0.1 });
        P(Depth | Rain) = normal(if Rain { 2 } else { 0 }, 1);
    }
}";

fn near(found: f64, expected: f64) {
    assert!((found - expected).abs() < 1e-12, "{found} {expected}");
}

#[test]
fn the_columns_do_not_depend_on_the_cells() {
    let yard = Program::parse(YARD).unwrap();
    let columns = [
        "ln_p_evidence",
        "Rain=false",
        "Rain=true",
        "Wet=false",
        "Wet=true",
        "Depth.mean",
        "Depth.deviation",
    ];
    let nothing: [&str; 0] = [];
    assert_eq!(yard.batch_columns(Cases::new()).unwrap(), columns);
    for (wet, depth) in [("true", "2"), ("", "2"), ("true", ""), ("", "")] {
        let found = yard.batch(Cases::new().column("Wet", [wet]).column("Depth", [depth])).unwrap();
        assert_eq!(found.columns, columns);
        let row = found.rows[0].as_ref().unwrap();
        let odds =
            if wet.is_empty() { 1.0 } else { 9.0 } * if depth.is_empty() { 1.0 } else { 2f64.exp() } / 3.0;
        near(row[2], odds / (1.0 + odds));
        assert_eq!(row[5].is_nan(), !depth.is_empty());
    }
    assert_eq!(yard.batch(Cases::new().column("Wet", nothing)).unwrap().columns, columns);
}

#[test]
fn rows_that_observe_the_same_share_a_plan() {
    let yard = Program::parse(YARD).unwrap();
    let depths: Vec<f64> = (0..12).map(|at| f64::from(at) / 4.0).collect();
    let found = yard.batch(Cases::new().column("Depth", &depths).only(["Rain"])).unwrap();
    for (row, depth) in found.rows.iter().zip(&depths) {
        let odds = (2.0 * depth - 2.0).exp() / 3.0;
        near(row.as_ref().unwrap()[2], odds / (1.0 + odds));
    }
    // Depth does not matter: a join tree of the rest answers.
    let found = yard.batch(Cases::new().column("Wet", ["true"; 12]).only(["Rain"])).unwrap();
    assert_eq!(found.columns, ["ln_p_evidence", "Rain=false", "Rain=true"]);
    near(found.rows[11].as_ref().unwrap()[2], 0.75);
    near(found.rows[11].as_ref().unwrap()[0], 0.3f64.ln());
}

const DOOR: &str = "program Door {
    variables { X, X^-1, Z : bool; }
    decomposition { P(X^-1) P(X | X^-1) P(Z | X) }
    forms {
        P(X^-1) = previous(X) else bernoulli(0);
        P(X | X^-1) = table { false: 0.9, 0.1; true: 0.2, 0.8; };
        P(Z | X) = bernoulli(if X { 0.7 } else { 0.1 });
    }
}";

#[test]
fn a_step_is_taken_in_only_if_it_is_accepted() {
    let programs = [
        DOOR,
        "program Walk {
             variables { X, X^-1, Z : real; }
             decomposition { P(X^-1) P(X | X^-1) P(Z | X) }
             forms { P(X^-1) = previous(X) else normal(0, 1); P(X | X^-1) = normal(X^-1, 1); P(Z | X) = normal(X, 1); }
         }",
    ];
    for (text, by, seen) in [
        (programs[0], "chain", Value::Bool(true)),
        (programs[0], "particles", Value::Bool(true)),
        (programs[1], "gaussian", Value::Real(1.0)),
        (programs[1], "extended_kalman", Value::Real(1.0)),
        (programs[1], "particles", Value::Real(1.0)),
    ] {
        let program = Program::parse(text).unwrap().by(by).unwrap().draws(300);
        let seen = Evidence::new().with("Z", seen);
        let (mut one, mut other) = (program.filter("P(X | Z)").unwrap(), program.filter("P(X | Z)").unwrap());
        for _ in 0..2 {
            let forgotten = one.step_if(seen.clone(), |posterior| (posterior.to_string(), false)).unwrap();
            let taken = one.step(seen.clone()).unwrap();
            assert_eq!(forgotten, taken.to_string(), "{by}");
            assert_eq!(taken.to_string(), other.step(seen.clone()).unwrap().to_string(), "{by}");
            assert_eq!((one.instants(), one.ln_evidence()), (other.instants(), other.ln_evidence()), "{by}");
        }
        assert_eq!(one.instants(), 2);
    }
}

#[test]
fn likelihoods_are_evidence_at_single_instants() {
    let door = Program::parse(DOOR).unwrap();
    // The door opens with 0.1; seen with weights 1 and 3 it weighs 0.3 + 3 · 0.7, and shut 0.9 + 3 · 0.1.
    let seen = Evidence::new().with("Z", Value::Likelihood(vec![1.0, 3.0]));
    let first = 0.1 * 2.4 / (0.1 * 2.4 + 0.9 * 1.2);
    let opens = 0.8 * first + 0.1 * (1.0 - first);
    let second = 0.7 * opens / (0.7 * opens + 0.1 * (1.0 - opens));
    let mut filter = door.filter("P(X | Z)").unwrap();
    near(filter.step(seen.clone()).unwrap().p(true).unwrap(), first);
    near(filter.ln_evidence(), 1.32f64.ln());
    near(filter.step(evidence! { Z: true }).unwrap().p(true).unwrap(), second);
    let both = [seen.clone(), evidence! { Z: true }];
    near(door.question("filter P(X | Z)").unwrap().over(&both).unwrap().p(true).unwrap(), second);
    // The four paths of both instants.
    let path = |now: usize, then: usize, go: f64| [0.9 * 1.2, 0.1 * 2.4][now] * go * [0.1, 0.7][then];
    let (shut, open) = (path(0, 0, 0.9) + path(0, 1, 0.1), path(1, 0, 0.2) + path(1, 1, 0.8));
    let smooth = door.question("smooth P(X | Z)").unwrap().over(&both).unwrap();
    near(smooth.at(1).unwrap().p(true).unwrap(), open / (open + shut));
    near(smooth.ln_evidence().unwrap(), (open + shut).ln());
    let error = door.by("particles").unwrap().filter("P(X | Z)").unwrap().step(seen).unwrap_err().to_string();
    assert!(error.contains("give a value"), "{error}");
}

#[test]
fn likelihoods_are_given_later() {
    let yard = Program::parse(YARD).unwrap();
    let seen = Value::Likelihood(vec![1.0, 3.0]);
    // 0.1 + 3 · 0.9 and 0.9 + 3 · 0.1.
    let expected = 0.25 * 2.8 / (0.25 * 2.8 + 0.75 * 1.2);
    for question in ["P(Rain | Wet)", "P(Rain | Wet = w)"] {
        let name = if question.contains('w') { "w" } else { "Wet" };
        let asked = yard.question(question).unwrap().given(name, seen.clone()).unwrap();
        near(asked.ask().unwrap().p(true).unwrap(), expected);
    }
    let error = yard.question("P(Rain)").unwrap().given("Wet", seen).unwrap_err().to_string();
    assert!(error.contains("leaves open"), "{error}");
}
