//! Common parts of the tests of distributions: enumeration, and random programs.
//!
//! In: a model. Out: its joint distribution, by enumeration. Invariant: nothing here uses plans or kernels.

#![allow(dead_code)]

pub(crate) mod brute;
pub(crate) mod learning;
pub(crate) mod node;
pub(crate) mod random;

use bp_core::compiler::exec::{Inputs, interpret};
use bp_core::compiler::ids::VariableId;
use bp_core::compiler::kernel::OutputKey;
use bp_core::compiler::lower::lower;
use bp_core::compiler::model::{Ask, Model, Question};
use bp_core::compiler::plan::{Options, Rewrites, Route, plan};
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::{compile, parse_question};
use std::collections::BTreeMap;

/// Two numbers, within a distance.
#[track_caller]
pub(crate) fn near(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found}, expected {expected}");
}

/// Two numbers up to rounding: relative where they are above 1.
#[track_caller]
pub(crate) fn close(found: f64, expected: f64) {
    near(found, expected, 1e-12 * expected.abs().max(1.0));
}

/// Two lists of numbers, each within a distance.
#[track_caller]
pub(crate) fn all_near(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len(), "{found:?}, expected {expected:?}");
    let all = found.iter().zip(expected).all(|(p, q)| (p - q).abs() <= tolerance);
    assert!(all, "{found:?}, expected {expected:?}");
}

/// Two lists of numbers up to rounding.
#[track_caller]
pub(crate) fn all_close(found: &[f64], expected: &[f64]) {
    all_near(found, expected, 1e-12);
}

/// The answer to a question up to rounding: relative where it is above a thousandth.
#[track_caller]
pub(crate) fn agrees(found: f64, expected: f64, question: &str) {
    let near = (found - expected).abs() <= 1e-12 * expected.abs().max(1e-3);
    assert!(near, "{question}: {found}, expected {expected}");
}

/// The model of a text.
pub(crate) fn model_of(text: &str) -> Model {
    let source = Source::new("test", text);
    compile(&source).unwrap_or_else(|wrong| panic!("{text}\n{}", wrong.render(&source, false)))
}

/// A question as a user types it.
pub(crate) fn question(model: &Model, text: &str) -> Question {
    let source = Source::new("question", text);
    parse_question(&source, model).unwrap_or_else(|wrong| panic!("{}", wrong.render(&source, false)))
}

/// A program of `tests/programs`.
pub(crate) fn program(name: &str) -> String {
    let path = format!("{}/../tests/programs/{name}.bp", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(path).unwrap()
}

/// The value of each variable.
pub(crate) type Values = BTreeMap<VariableId, usize>;

/// The answer to one ask, cell by cell.
pub(crate) type Table = Vec<(Values, f64)>;

/// Answers by plan, lower and interpreter, ask by ask; and ln P(evidence) of each, where it is wanted.
pub(crate) fn interpreted(
    model: &Model,
    question: &Question,
    options: Options,
) -> Vec<(Ask, Table, Option<f64>)> {
    let plan = plan(model, question, options).unwrap_or_else(|error| panic!("{error}"));
    let mut answers = Vec::new();
    for route in &plan.routes {
        let Route::Exact(exact) = route else { panic!("a closed form for a discrete program") };
        let lowered = lower(model, exact, "test").unwrap_or_else(|error| panic!("{error}"));
        let outputs = interpret(&lowered.kernel, &Inputs::new()).unwrap_or_else(|error| panic!("{error}"));
        let ln_evidence = options.ln_evidence.then(|| outputs.get(OutputKey::LnEvidence)[0]);
        for output in &lowered.outputs {
            let Some(ask) = &output.ask else { continue };
            let cells = outputs.get(output.key);
            let counts: Vec<usize> = (output.variables.iter())
                .map(|variable| model.variables[*variable].domain.count().unwrap())
                .collect();
            assert_eq!(cells.len(), counts.iter().product::<usize>(), "{}", output.name);
            let table = (cells.iter().enumerate())
                .map(|(position, p)| {
                    let mut rest = position;
                    let mut values = Values::new();
                    for (variable, count) in output.variables.iter().zip(&counts).rev() {
                        values.insert(*variable, rest % count);
                        rest /= count;
                    }
                    (values, *p)
                })
                .collect();
            answers.push((ask.clone(), table, ln_evidence));
        }
    }
    answers
}

/// All rules but one.
pub(crate) fn without() -> [(&'static str, Rewrites); 7] {
    let all = Rewrites::default();
    [
        ("none left out", all),
        ("barren", Rewrites { barren: false, ..all }),
        ("dirac", Rewrites { dirac: false, ..all }),
        ("solve", Rewrites { solve: false, ..all }),
        ("scan", Rewrites { scan: false, ..all }),
        ("order", Rewrites { order: false, ..all }),
        ("cancel", Rewrites { cancel: false, ..all }),
    ]
}
