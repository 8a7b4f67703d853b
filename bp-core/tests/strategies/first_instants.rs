//! Programs whose first instant has a form of its own, `P(initial(X))`.
//!
//! In: finite programs over time. Out: filtered, smoothed and most likely states. Invariant: expected values are counted by hand.

use crate::support::{all_near, model_of, question};
use bp_core::compiler::answer::{Answer, ask, ask_over_time};
use bp_core::compiler::error::Error;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::model::Model;
use bp_core::compiler::sample::Sampling;

/// A row for each instant; NaN where nothing was observed.
fn asked(model: &Model, text: &str, names: &[&str], rows: &[Vec<f64>]) -> Result<Answer, Error> {
    let observed = |row: &Vec<f64>| {
        let cells = names.iter().zip(row).filter(|(_, value)| !value.is_nan());
        cells.map(|(name, value)| ((*name).to_owned(), *value)).collect::<Vec<_>>()
    };
    let rows: Vec<_> = rows.iter().map(observed).collect();
    let answers = ask_over_time(model, &question(model, text), &rows, &Inputs::new(), Sampling::default());
    answers.map(|mut answers| answers.remove(0))
}

/// The probabilities, row by row.
fn figures(answer: &Answer) -> Vec<f64> {
    answer.answer.iter().map(|row| row.p().unwrap()).collect()
}

const STARTED: &str = "program Machine { variables { Up, Up^-1, Light : bool; }
    decomposition { P(initial(Up)) P(Up | Up^-1) P(Light | Up) }
    forms { P(initial(Up)) = bernoulli(0.8); P(Up | Up^-1) = bernoulli(if Up^-1 { 0.7 } else { 0.1 });
            P(Light | Up) = bernoulli(if Up { 0.9 } else { 0.2 }); } }";

#[test]
fn the_first_instant_has_a_form_of_its_own() {
    let model = model_of(STARTED);
    let on = |text: &str, rows: &[f64]| {
        let rows: Vec<Vec<f64>> = rows.iter().map(|value| vec![*value]).collect();
        asked(&model, text, &["Light"], &rows).unwrap()
    };
    // By hand: P(up₁ | on) = 0.8 · 0.9 / (0.8 · 0.9 + 0.2 · 0.2) = 0.72 / 0.76.
    let first = 0.72 / 0.76;
    let found = on("filter P(Up | Light)", &[1.0]);
    all_near(&figures(&found), &[1.0 - first, first], 1e-14);
    assert!((found.ln_evidence.unwrap() - 0.76f64.ln()).abs() < 1e-14);
    // One step: 0.1 + 0.6 p; then no light.
    let moved = 0.1 + 0.6 * first;
    let second = moved * 0.1 / (moved * 0.1 + (1.0 - moved) * 0.8);
    all_near(&figures(&on("filter P(Up | Light)", &[1.0, 0.0])), &[1.0 - second, second], 1e-14);
    all_near(&figures(&on("predict(1) P(Up | Light)", &[1.0]))[1..], &[moved], 1e-14);
    // P(up₁ | on, off) ∝ 0.72 (0.7 · 0.1 + 0.3 · 0.8), P(down₁ | on, off) ∝ 0.04 (0.1 · 0.1 + 0.9 · 0.8).
    let (up, down) = (0.72 * 0.31, 0.04 * 0.73);
    all_near(
        &figures(&on("smooth P(Up | Light)", &[1.0, 0.0]))[..2],
        &[down / (up + down), up / (up + down)],
        1e-14,
    );
    // Most likely: up, down, with probability 0.8 · 0.9 · 0.3 · 0.8 of 0.8 · 0.9 · 0.31 + 0.2 · 0.2 · 0.73.
    let likely = on("sequence P(Up | Light)", &[1.0, 0.0]);
    let values: Vec<&str> = likely.answer.iter().map(|row| row.values[1].1.as_str()).collect();
    assert_eq!(values, ["true", "false"]);
    let most = on("max sequence P(Up | Light)", &[1.0, 0.0]);
    all_near(&figures(&most), &[0.72 * 0.24 / (up + down)], 1e-14);
    let now = ask(&model, &question(&model, "P(Up | Light = true)"), &Inputs::new()).unwrap_err().to_string();
    assert!(now.contains("has a form of its own at the first instant: ask over time"), "{now}");
}

#[test]
fn a_first_instant_may_depend_on_the_parents_of_its_factor() {
    // Of two machines the first starts up with probability 0.9, the other with 0.2.
    let model = model_of(
        "program Machines { variables { Kind : bool; Up, Up^-1, Light : bool; }
         decomposition { P(Kind) P(initial(Up) | Kind) P(Up | Up^-1 Kind) P(Light | Up) }
         forms { P(Kind) = bernoulli(0.5); P(initial(Up) | Kind) = bernoulli(if Kind { 0.9 } else { 0.2 });
                 P(Up | Up^-1 Kind) = dirac(Up^-1); P(Light | Up) = bernoulli(if Up { 1 } else { 0.5 }); } }",
    );
    let found = asked(&model, "filter P(Kind | Light)", &["Light"], &[vec![1.0]]).unwrap();
    // 0.9 + 0.1 / 2 = 0.95 against 0.2 + 0.8 / 2 = 0.6.
    all_near(&figures(&found), &[0.6 / 1.55, 0.95 / 1.55], 1e-14);
}

/// X reads what Y was, but not at the first instant, where it has a form of its own: Y^-1 needs no factor.
#[test]
fn what_is_read_at_later_instants_only_needs_no_factor_before_the_first() {
    let model = model_of(
        "program Both { variables { X, X^-1, Y, Y^-1, Z : bool; }
            decomposition { P(initial(X)) P(X | X^-1 Y^-1) P(initial(Y)) P(Y | Y^-1) P(Z | X) }
            forms { P(initial(X)) = bernoulli(0.5); P(X | X^-1 Y^-1) = bernoulli(if X^-1 and Y^-1 { 0.9 } else { 0.2 });
                    P(initial(Y)) = bernoulli(0.3); P(Y | Y^-1) = bernoulli(if Y^-1 { 0.8 } else { 0.1 });
                    P(Z | X) = bernoulli(if X { 0.9 } else { 0.3 }); } }",
    );
    let found = asked(&model, "filter P(X | Z)", &["Z"], &[vec![1.0]]).unwrap();
    all_near(&figures(&found), &[0.25, 0.75], 1e-14);
    // P(X₂) = 0.9 · 0.75 · 0.3 + 0.2 (1 − 0.75 · 0.3)
    let found = asked(&model, "filter P(X | Z)", &["Z"], &[vec![1.0], vec![f64::NAN]]).unwrap();
    all_near(&figures(&found)[found.answer.len() - 2..], &[1.0 - 0.3575, 0.3575], 1e-14);
}

/// Nothing stands before the first instant where it has a form of its own: the answers begin with the second.
#[test]
fn a_variable_before_the_first_instant_has_no_answer() {
    let model = model_of(STARTED);
    let on = |text: &str, rows: &[f64]| {
        let rows: Vec<Vec<f64>> = rows.iter().map(|value| vec![*value]).collect();
        asked(&model, text, &["Light"], &rows)
    };
    let found = on("smooth P(Up^-1 | Light)", &[1.0, 0.0]).unwrap();
    assert_eq!(found.answer.iter().map(|row| row.values[0].1.clone()).collect::<Vec<_>>(), ["2", "2"]);
    // P(up₁ | on, off), as above.
    let (up, down) = (0.72 * 0.31, 0.04 * 0.73);
    all_near(&figures(&found), &[down / (up + down), up / (up + down)], 1e-14);
    let sequence = on("sequence P(Up Up^-1 | Light)", &[1.0, 0.0]).unwrap();
    let values: Vec<&str> =
        sequence.answer.iter().flat_map(|row| &row.values).map(|it| it.1.as_str()).collect();
    assert_eq!(values, ["2", "false", "true"]);
    let refused = on("filter P(Up^-1 | Light)", &[1.0]).unwrap_err().to_string();
    assert!(refused.contains("`Up^-1` has no value at the first instant"), "{refused}");
}

/// The rows of a table are those of the parents at the first instant. By hand: P(x₁, z₁ on) is .75 · .1 and .25 · .8;
/// times P(x₂ | x₁) P(z₂ off | x₂, z₁ on), where z₂ is off with probability .5 given not x₂, .2 given x₂.
#[test]
fn a_table_of_several_rows_is_the_law_of_the_first_instant() {
    let model = model_of(
        "program Two { variables { X, X^-1, Z, Z^-1 : bool; }
         decomposition { P(initial(X)) P(X | X^-1) P(initial(Z) | X) P(Z | X Z^-1) }
         forms { P(initial(X)) = bernoulli(0.25); P(X | X^-1) = bernoulli(if X^-1 { 0.9 } else { 0.2 });
                 P(initial(Z) | X) = table { false: 0.9, 0.1; true: 0.2, 0.8; };
                 P(Z | X Z^-1) = bernoulli(if X { 0.8 } else { if Z^-1 { 0.5 } else { 0.3 } }); } }",
    );
    let found = asked(&model, "smooth P(X | Z)", &["Z"], &[vec![1.0], vec![0.0]]).unwrap();
    let part = |first: f64, to: f64| [first * (1.0 - to) * 0.5, first * to * 0.2];
    let ([a, b], [c, d]) = (part(0.75 * 0.1, 0.2), part(0.25 * 0.8, 0.9));
    let all = a + b + c + d;
    all_near(&figures(&found), &[(a + b) / all, (c + d) / all, (a + c) / all, (b + d) / all], 1e-14);
    assert!((found.ln_evidence.unwrap() - all.ln()).abs() < 1e-14);
}

/// A function of what stands before the first instant has no answer there either.
#[test]
fn functions_of_a_variable_before_the_first_instant_have_no_answer() {
    let model = model_of(
        "program Walk { variables { X, X^-1, Z : real; } decomposition { P(initial(X)) P(X | X^-1) P(Z | X) }
         forms { P(initial(X)) = normal(1, 2); P(X | X^-1) = normal(X^-1, 1); P(Z | X) = normal(X, 1); } }",
    );
    let rows = [vec![2.0], vec![3.0]];
    let found = asked(&model, "smooth P(X - X^-1 | Z)", &["Z"], &rows).unwrap();
    assert_eq!(found.answer.len(), 1);
    let found = asked(&model, "smooth P(X^-1 > 1 | Z)", &["Z"], &rows).unwrap();
    assert!(found.answer.iter().all(|row| row.values[0].1 == "2"), "{found:?}");
}
