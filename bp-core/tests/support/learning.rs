//! Common parts of the tests of learning.
//!
//! In: programs and tables as text. Out: learned programs, and their answers. Invariant: the learned model and the
//! learned text give the same answers.

use super::{model_of, question};
use bp_core::compiler::answer::ask;
use bp_core::compiler::data::read_table;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::learn::{Case, Columns, Learned, Learner, sizes};
use bp_core::compiler::model::Model;
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::{compile, graft, parse};
use std::path::Path;

/// A program of these parts.
pub(crate) fn program(variables: &str, decomposition: &str, forms: &str) -> String {
    format!(
        "program Learning {{ variables {{ {variables} }} decomposition {{ {decomposition} }} forms {{ {forms} }} }}"
    )
}

pub(crate) fn case(model: &Model, values: &[(&str, &str)]) -> Case {
    values.iter().fold(Case::new(model), |case, (name, value)| case.with_value(model, name, value).unwrap())
}

/// A learner after a table, written with commas; variables without a column are hidden.
pub(crate) fn seen(text: &str, table: &str) -> Learner {
    let model = model_of(text);
    let table = read_table(Path::new("data.csv"), table.as_bytes()).unwrap();
    let names = model.variables.ids().map(|id| model.variable_name(id));
    let has = |name: &String| {
        table.columns.iter().any(|column| column == name || column.starts_with(&format!("{name}[")))
    };
    let hidden = names.filter(|name| !has(name)).collect();
    let given = sizes(&model, &table, Inputs::new()).unwrap_or_else(|error| panic!("{error}"));
    let mut learner = Learner::with(&model, &given).unwrap_or_else(|error| panic!("{error}"));
    let columns = Columns { hidden, ..Columns::default() };
    learner.observe_table(&table, &columns).unwrap_or_else(|error| panic!("{error}"));
    learner
}

pub(crate) fn learned(text: &str, table: &str) -> Learned {
    seen(text, table).learned().unwrap_or_else(|error| panic!("{error}"))
}

/// The learned program as text.
pub(crate) fn written(text: &str, learned: &Learned) -> String {
    let mut file = parse(&Source::new("program", text)).unwrap();
    let words = learned.text();
    let source = Source::new("learned", words.as_str());
    let parts = parse(&source).unwrap_or_else(|wrong| panic!("{}", wrong.render(&source, false)));
    graft(&mut file, &parts.programs[0]);
    file.to_string()
}

pub(crate) fn answer(model: &Model, text: &str) -> Vec<f64> {
    let answers =
        ask(model, &question(model, text), &Inputs::new()).unwrap_or_else(|error| panic!("{error}"));
    answers[0].answer.iter().map(|row| row.figure.number().unwrap()).collect()
}

/// The answer of the learned model, which must equal that of the learned text.
#[track_caller]
pub(crate) fn both(text: &str, learned: &Learned, asked: &str) -> Vec<f64> {
    let words = written(text, learned);
    let source = Source::new("learned", words.as_str());
    let model = compile(&source).unwrap_or_else(|wrong| panic!("{words}\n{}", wrong.render(&source, false)));
    let (found, read) = (answer(learned.model(), asked), answer(&model, asked));
    near(&found, &read, 1e-12);
    found
}

#[track_caller]
pub(crate) fn near(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len(), "{found:?} {expected:?}");
    for (p, q) in found.iter().zip(expected) {
        assert!((p - q).abs() <= tolerance, "{found:?}, expected {expected:?}");
    }
}
