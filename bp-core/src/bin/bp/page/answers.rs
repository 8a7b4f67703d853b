//! Answers that a page shows without computing them.
//!
//! In: a question, and the values of its controls. Out: its answers as the page's `draw` takes them. Invariant: what has no
//! answer says why.

use bp_core::compiler::answer::{Answer, compile_sized};
use bp_core::compiler::error::Error;
use bp_core::compiler::interactive::{begun, given, opened};
use bp_core::compiler::model::{Model, ParameterKind, Question};
use bp_core::compiler::numbers::{six_digits, two_digits};
use bp_core::compiler::plan::Options;
use bp_core::program::settings::Settings;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// The most rows of an answer.
const MOST_ROWS: usize = 2000;

/// The values of a real that a question leaves open, in the order in which they are tried: some may be impossible.
const FIRST: [f64; 3] = [0.0, 1.0, 0.5];

/// The values of controls, by name.
pub(crate) type Values = BTreeMap<String, f64>;

/// The answers of a question, as it is written, or with these values of its controls.
pub(crate) fn answers(model: &Model, question: &Question, values: Option<&Values>) -> Value {
    let text: Vec<String> = question.asks.iter().map(|ask| model.ask_text(ask)).collect();
    let tried = match values {
        Some(_) => found(model, question, values),
        None => {
            let first = |real: f64| found(model, &begun(model, question, real), None);
            first(FIRST[0]).or_else(|error| FIRST[1..].iter().find_map(|real| first(*real).ok()).ok_or(error))
        }
    };
    match tried {
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
    if let Some(estimate) = &answer.estimate {
        notes.push(format!(
            "An estimate, by {}: {} draws, effective sample size {:.0}, seed {}.",
            answer.strategy.name().replace('_', " "),
            estimate.particles,
            estimate.effective,
            estimate.seed
        ));
        notes.extend(estimate.warning.iter().map(|warning| format!("Note: {warning}.")));
    }
    // Without evidence it is 0, up to rounding.
    if let Some(ln) = answer.ln_evidence.filter(|_| answer.question.contains('|')) {
        let error = answer.estimate.as_ref().and_then(|estimate| estimate.ln_evidence_error);
        let error = error.map_or_else(String::new, |error| format!(" ± {}", two_digits(error)));
        notes.push(format!("ln P(evidence) = {}{error}", six_digits(ln)));
    }
    if answer.answer.len() > rows.len() {
        notes.push(format!("The first {MOST_ROWS} of {} rows.", answer.answer.len()));
    }
    json!({ "text": answer.question, "rows": rows, "note": notes.join(" ") })
}
