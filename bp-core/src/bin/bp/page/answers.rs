//! Answers that a page shows without computing them.
//!
//! In: a question, and the values of its controls. Out: its answers as the page's `draw` takes them. Invariant: what has no
//! answer says why.

use bp_core::compiler::answer::{Answer, Observed, ask_over_time, compile_sized};
use bp_core::compiler::error::Error;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::interactive::{Instants, begun, given, opened};
use bp_core::compiler::model::{Model, ParameterKind, Question};
use bp_core::compiler::numbers::{six_digits, two_digits};
use bp_core::compiler::plan::Options;
use bp_core::compiler::sample::Sampling;
use bp_core::program::settings::Settings;
use serde::Deserialize;
use serde_json::{Value, json};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// The most rows of an answer.
const MOST_ROWS: usize = 2000;

/// The values of a real that a question leaves open, in the order in which they are tried: some may be impossible.
const FIRST: [f64; 3] = [0.0, 1.0, 0.5];

/// The most instants of a question over time.
const MOST_INSTANTS: usize = 1000;

/// The values of controls, by name.
pub(crate) type Values = BTreeMap<String, f64>;

/// What a reader of a page has set.
#[derive(Default, Deserialize)]
pub(crate) struct Given {
    /// The values of controls.
    #[serde(default)]
    values: Values,
    /// The observations of each instant.
    #[serde(default)]
    instants: Vec<Values>,
}

/// The answers of a question, as it is written, or with what a reader has set.
pub(crate) fn answers(model: &Model, question: &Question, given: Option<&Given>) -> Value {
    let text: Vec<String> = question.asks.iter().map(|ask| model.ask_text(ask)).collect();
    let tried = match (Instants::of(model, question), given) {
        (Some(instants), _) => over_time(model, question, &instants, given),
        (None, _) if question.asks.iter().any(|ask| ask.when.is_over_time()) => {
            Err(Error::input(text.join("; "), "a page has no columns for its observations"))
        }
        (None, Some(_)) => found(model, question, given),
        (None, None) => {
            // Where it has no tables, one row is shown.
            let tried = [false, true].into_iter().flat_map(|rows| FIRST.map(|real| (rows, real)));
            let mut all = tried.map(|(rows, real)| found(model, &begun(model, question, real, rows), None));
            let first = all.next().expect("internal: some values are tried");
            first.or_else(|error| all.find_map(Result::ok).ok_or(error))
        }
    };
    match tried {
        Ok(answers) => answers.iter().map(shown).collect(),
        Err(error) => json!([{ "text": text.join("; "), "error": error.to_string() }]),
    }
}

fn found(model: &Model, question: &Question, set: Option<&Given>) -> Result<Vec<Answer>, Error> {
    let (open, controls) = opened(model, question);
    let value = |name: &str| set.and_then(|set| set.values.get(name).copied());
    let mut lists: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for control in &controls {
        if let Some(element) = &control.element {
            lists.entry(&element.of).or_default().push(value(&control.name).unwrap_or(control.value));
        }
    }
    let settings = Settings::new(model);
    let mut inputs = parameters(model, settings.inputs(), value);
    for (name, list) in lists {
        inputs = inputs.numbers(name, Cow::Owned(list));
    }
    let question = match set {
        Some(_) => given(model, &open, value)?,
        None => question.clone(),
    };
    compile_sized(model, &question, Options::default())?.ask(&inputs)
}

/// The inputs with the parameters that a reader has set.
fn parameters<'i>(
    model: &Model,
    mut inputs: Inputs<'i, f64>,
    value: impl Fn(&str) -> Option<f64>,
) -> Inputs<'i, f64> {
    for parameter in model.parameters.values().filter(|parameter| parameter.kind != ParameterKind::Size) {
        if let Some(number) = value(&parameter.name) {
            inputs = inputs.number(&parameter.name, number);
        }
    }
    inputs
}

/// The answers over time; without observations that a reader has set each column has its first value at each instant.
fn over_time(
    model: &Model,
    question: &Question,
    instants: &Instants,
    set: Option<&Given>,
) -> Result<Vec<Answer>, Error> {
    let settings = Settings::new(model);
    let inputs = parameters(model, settings.inputs(), |name| set?.values.get(name).copied());
    let at_first = || instants.columns.iter().map(|column| (column.name.clone(), column.value)).collect();
    let observed: Vec<Observed> = match set {
        None => (0..instants.count).map(|_| at_first()).collect(),
        Some(set) => (set.instants.iter().take(MOST_INSTANTS))
            .map(|instant| instant.iter().map(|(name, number)| (name.clone(), *number)).collect())
            .collect(),
    };
    for (name, number) in observed.iter().flatten() {
        if !instants.admits(model, name, *number) {
            return Err(Error::input(name, format!("{number} is not a value of it")));
        }
    }
    ask_over_time(model, question, &observed, &inputs, Sampling::default())
}

fn shown(answer: &Answer) -> Value {
    let covariances = answer.covariances();
    let beside = |at: usize| {
        let own = covariances.iter().rfind(|own| own.first <= at)?;
        Some(own.names.iter().zip(own.matrix.get(at - own.first)?).collect::<Vec<_>>())
    };
    let row = |(at, row): (usize, &bp_core::compiler::answer::Row)| {
        let mut shown = json!({ "values": row.values, "figure": row.figure });
        if let Some(beside) = beside(at) {
            shown["covariances"] = json!(beside);
        }
        shown
    };
    let rows: Vec<Value> = answer.answer.iter().take(MOST_ROWS).enumerate().map(row).collect();
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
        let error = answer
            .estimate
            .as_ref()
            .and_then(|estimate| estimate.ln_evidence_error.filter(|error| *error > 0.0));
        let error = error.map_or_else(String::new, |error| format!(" ± {}", two_digits(error)));
        notes.push(format!("ln P(evidence) = {}{error}", six_digits(ln)));
    }
    if answer.answer.len() > rows.len() {
        notes.push(format!("The first {MOST_ROWS} of {} rows.", answer.answer.len()));
    }
    json!({ "text": answer.question, "rows": rows, "note": notes.join(" ") })
}
