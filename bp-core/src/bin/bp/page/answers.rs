//! Answers that a page shows without computing them.
//!
//! In: a question, and the values of its controls. Out: its answers as the page's `draw` takes them. Invariant: what has no
//! answer says why.

use bp_core::compiler::answer::{Answer, compile_sized};
use bp_core::compiler::error::Error;
use bp_core::compiler::interactive::{given, opened};
use bp_core::compiler::model::{Model, ParameterKind, Question};
use bp_core::compiler::plan::Options;
use bp_core::program::settings::Settings;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// The most rows of an answer.
const MOST_ROWS: usize = 2000;

/// The values of controls, by name.
pub(crate) type Values = BTreeMap<String, f64>;

/// The answers of a question, as it is written, or with these values of its controls.
pub(crate) fn answers(model: &Model, question: &Question, values: Option<&Values>) -> Value {
    let text: Vec<String> = question.asks.iter().map(|ask| model.ask_text(ask)).collect();
    match found(model, question, values) {
        Ok(answers) => answers.iter().map(shown).collect(),
        Err(error) => json!([{ "text": text.join("; "), "error": error.to_string() }]),
    }
}

fn found(model: &Model, question: &Question, values: Option<&Values>) -> Result<Vec<Answer>, Error> {
    let settings = Settings::new(model);
    let mut inputs = settings.inputs();
    let mut question = question.clone();
    if let Some(values) = values {
        question = given(model, &opened(model, &question).0, |name| values.get(name).copied())?;
        for parameter in model.parameters.values().filter(|parameter| parameter.kind != ParameterKind::Size) {
            if let Some(number) = values.get(&parameter.name) {
                inputs = inputs.number(&parameter.name, *number);
            }
        }
    }
    compile_sized(model, &question, Options::default())?.ask(&inputs)
}

fn shown(answer: &Answer) -> Value {
    let row = |row: &bp_core::compiler::answer::Row| json!({ "values": row.values, "figure": row.figure });
    let rows: Vec<Value> = answer.answer.iter().take(MOST_ROWS).map(row).collect();
    let mut notes = Vec::new();
    if answer.estimate.is_some() {
        notes.push(format!("An estimate, by {}.", answer.strategy.name().replace('_', " ")));
    }
    if let Some(ln) = answer.ln_evidence {
        notes.push(format!("ln P(evidence) = {ln:.6}"));
    }
    if answer.answer.len() > rows.len() {
        notes.push(format!("The first {MOST_ROWS} of {} rows.", answer.answer.len()));
    }
    json!({ "text": answer.question, "rows": rows, "note": notes.join(" ") })
}
