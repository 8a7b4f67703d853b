//! A question asked of many cases: the rows of a table.
//!
//! In: a model, a question, a table whose columns are named as variables. Out: the answers of each case. Invariant: a
//! value that a case gives takes the place of what the question leaves open; one that is missing is not known in that
//! case. The question is compiled once for each set of variables that are missing together.

use crate::failure::Failure;
use crate::settings::Settings;
use bp_core::answer::{Answer, CompiledQuestion, compile};
use bp_core::data::{MISSING, Table, read_table};
use bp_core::error::Error;
use bp_core::exec::Inputs;
use bp_core::ids::VariableId;
use bp_core::model::{Evidence, Known, Model, Question, Reduction, Value};
use bp_core::sample::Sampling;
use std::collections::{BTreeSet, HashMap};
use std::fs::File;
use std::path::Path;

/// The variables whose values a question leaves open.
pub(crate) fn open(question: &Question) -> BTreeSet<VariableId> {
    let mut open = BTreeSet::new();
    each_open(&mut question.clone(), &mut |id, _| {
        open.insert(id);
        Filled::Not
    });
    open
}

/// The question where some of its open variables are given under their own names, and some are not known after all.
pub(crate) fn filled(
    model: &Model,
    question: &Question,
    given: &BTreeSet<VariableId>,
    missing: &BTreeSet<VariableId>,
) -> Question {
    let mut question = question.clone();
    each_open(&mut question, &mut |id, _| match (missing.contains(&id), given.contains(&id)) {
        (true, _) => Filled::Missing,
        (_, true) => Filled::With(Value::Given(model.variable_name(id))),
        _ => Filled::Not,
    });
    question
}

/// Asks a question whose open variables may be given under their own names; the answers say which values were.
pub(crate) fn ask(
    model: &Model,
    question: &CompiledQuestion<'_>,
    inputs: &Inputs<'_, f64>,
    sampling: Sampling,
) -> Result<Vec<Answer>, Error> {
    let mut said = question.question().clone();
    each_open(&mut said, &mut |id, value| {
        let name = model.variable_name(id);
        match (value, inputs.find(&name)) {
            (Some(Value::Given(given)), Some([number])) if *given == name => {
                Filled::With(match model.variables[id].domain.is_finite() {
                    true => Value::Ordinal(*number as usize),
                    false => Value::Real(*number),
                })
            }
            _ => Filled::Not,
        }
    });
    let texts: Vec<String> = said.asks.iter().map(|ask| model.ask_text(ask)).collect();
    let mut answers = question.ask_with(inputs, sampling).map_err(|error| match error {
        Error::Impossible(asked) => {
            let at = question.question().asks.iter().position(|ask| model.ask_text(ask) == asked);
            Error::Impossible(at.map_or(asked, |at| texts[at].clone()))
        }
        other => other,
    })?;
    for (answer, text) in answers.iter_mut().zip(texts) {
        answer.question = text;
    }
    Ok(answers)
}

/// What becomes of an open variable.
enum Filled {
    Not,
    With(Value),
    Missing,
}

/// Visits each open variable, with the value that the question names, and fills it.
fn each_open(question: &mut Question, fill: &mut dyn FnMut(VariableId, Option<&Value>) -> Filled) {
    let mut visit = |known: &mut Vec<Known>| {
        known.retain_mut(|known| {
            let filled = match &known.evidence {
                Evidence::Each => fill(known.variable, None),
                Evidence::Hard(value @ Value::Given(_)) => fill(known.variable, Some(value)),
                _ => Filled::Not,
            };
            if let Filled::With(value) = filled {
                known.evidence = Evidence::Hard(value);
                return true;
            }
            matches!(filled, Filled::Not)
        });
    };
    for ask in &mut question.asks {
        visit(&mut ask.known);
        if let Reduction::Divergence { from } = &mut ask.reduction {
            visit(from);
        }
    }
    for item in question.asks.iter_mut().flat_map(|ask| &mut ask.searched) {
        let Some(value @ Value::Given(_)) = &item.at else { continue };
        match fill(item.variable, Some(value)) {
            Filled::Not => {}
            Filled::With(value) => item.at = Some(value),
            Filled::Missing => item.at = None,
        }
    }
}

/// Answers the questions for each row of a file.
pub(crate) fn answers(
    model: &Model,
    questions: &[Question],
    path: &Path,
    settings: &Settings,
    sampling: Sampling,
) -> Result<Vec<(usize, Vec<Answer>)>, Failure> {
    let file = File::open(path).map_err(|error| Error::file(path, error))?;
    let table = read_table(path, file)?;
    let columns = columns(model, questions, &table, settings)?;
    let mut compiled: HashMap<BTreeSet<VariableId>, Vec<CompiledQuestion<'_>>> = HashMap::new();
    let mut answers = Vec::with_capacity(table.rows.len());
    for (row, cells) in table.rows.iter().enumerate() {
        let mut inputs = settings.inputs();
        let mut missing = BTreeSet::new();
        for (id, column) in &columns {
            let Some(text) = cells[*column].as_deref().filter(|text| !MISSING.contains(text)) else {
                missing.insert(*id);
                continue;
            };
            let name = model.variable_name(*id);
            let value = settings.value(model, *id, &name, text).map_err(|_| Error::Cell {
                path: table.path.clone(),
                row: table.line(row),
                column: table.columns[*column].clone(),
                value: text.to_owned(),
                message: format!(
                    "not a value of `{name}`, which is `{}`",
                    model.domain_text(&model.variables[*id].domain)
                ),
            })?;
            inputs = inputs.number(&name, value);
        }
        let in_row =
            |error| Error::Row { path: table.path.clone(), row: table.line(row), error: Box::new(error) };
        if !compiled.contains_key(&missing) {
            let given: BTreeSet<VariableId> = columns.iter().map(|(id, _)| *id).collect();
            let ready =
                questions.iter().map(|question| compile(model, &filled(model, question, &given, &missing)));
            compiled.insert(missing.clone(), ready.collect::<Result<_, _>>().map_err(in_row)?);
        }
        // Each case has draws of its own; an odd factor gives each row a seed of its own.
        let seed = sampling.seed.wrapping_add((row as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let mut told = Vec::new();
        for question in &compiled[&missing] {
            told.extend(ask(model, question, &inputs, Sampling { seed, ..sampling }).map_err(in_row)?);
        }
        answers.push((table.line(row), told));
    }
    Ok(answers)
}

/// The column of each open variable; one that is set needs none.
fn columns(
    model: &Model,
    questions: &[Question],
    table: &Table,
    settings: &Settings,
) -> Result<Vec<(VariableId, usize)>, Failure> {
    let open: BTreeSet<VariableId> = questions.iter().flat_map(open).collect();
    let mut columns = Vec::new();
    for id in open {
        let name = model.variable_name(id);
        match table.columns.iter().position(|column| *column == name) {
            Some(column) => columns.push((id, column)),
            None if settings.has(&name) => {}
            None => {
                let known: Vec<_> = table.columns.iter().map(|column| format!("`{column}`")).collect();
                let message = format!(
                    "no column has its name, and it is not set; the columns of `{}` are {}",
                    table.path.display(),
                    known.join(", ")
                );
                return Err(Error::input(name, message).into());
            }
        }
    }
    Ok(columns)
}
