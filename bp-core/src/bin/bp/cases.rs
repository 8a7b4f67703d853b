//! A question asked of many cases: the rows of a table.
//!
//! In: a model, a question, a table whose columns are named as variables. Out: the answers of each case. Invariant: a
//! value that a case gives takes the place of what the question leaves open; one that is missing is not known in that
//! case. The question is compiled once for each set of variables that are missing together.

use crate::failure::Failure;
use crate::settings::Settings;
use bp_core::answer::{Answer, CompiledQuestion, compile_by};
use bp_core::data::{Table, Values};
use bp_core::error::Error;
use bp_core::exec::Inputs;
use bp_core::ids::VariableId;
use bp_core::model::{Evidence, Known, Model, Question, Statistic, Value};
use bp_core::plan::Strategy;
use bp_core::sample::Sampling;
use std::collections::{BTreeSet, HashMap};

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
                let domain = &model.variables[id].domain;
                Filled::With(match domain.ordinal_among(*number, None).filter(|_| domain.is_finite()) {
                    Some(ordinal) => Value::Ordinal(ordinal),
                    None => Value::Real(*number),
                })
            }
            _ => Filled::Not,
        }
    });
    let texts: Vec<String> = said.asks.iter().map(|ask| model.ask_text(ask)).collect();
    let mut answers = question.ask_with(inputs, sampling).map_err(|error| match error {
        Error::Impossible(mut impossible) => {
            let mut asks = question.question().asks.iter();
            if let Some(at) = asks.position(|ask| model.ask_text(ask) == impossible.question) {
                impossible.question.clone_from(&texts[at]);
            }
            Error::Impossible(impossible)
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
        if let Statistic::Divergence { from, .. } = &mut ask.statistic {
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
    table: &Table,
    settings: &Settings,
    (sampling, by): (Sampling, Option<Strategy>),
) -> Result<Vec<(usize, Vec<Answer>)>, Failure> {
    let columns = columns(model, questions, table, settings)?;
    let mut compiled: HashMap<BTreeSet<VariableId>, Vec<CompiledQuestion<'_>>> = HashMap::new();
    let mut answers = Vec::with_capacity(table.len());
    for row in 0..table.len() {
        let mut inputs = settings.inputs();
        let mut missing = BTreeSet::new();
        for (id, column, values) in &columns {
            match table.cell(row, *column, values)? {
                Some(value) => inputs = inputs.number(&model.variable_name(*id), value.number),
                None => drop(missing.insert(*id)),
            }
        }
        let in_row = |error| table.wrong_row(row, error);
        if !compiled.contains_key(&missing) {
            let given: BTreeSet<VariableId> = columns.iter().map(|(id, ..)| *id).collect();
            let ready = questions
                .iter()
                .map(|question| compile_by(model, &filled(model, question, &given, &missing), by));
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
fn columns<'m>(
    model: &'m Model,
    questions: &[Question],
    table: &Table,
    settings: &Settings,
) -> Result<Vec<(VariableId, usize, Values<'m>)>, Failure> {
    let open: BTreeSet<VariableId> = questions.iter().flat_map(open).collect();
    let mut columns = Vec::new();
    for id in open {
        let name = model.variable_name(id);
        if table.column(&name).is_some() || !settings.has(&name) {
            let values = Values::new(model, id, &|size| settings.size(size));
            columns.push((id, table.needed(&name)?, values));
        }
    }
    Ok(columns)
}
