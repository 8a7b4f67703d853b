//! Answers questions over time for the rows of a table: instants, of one sequence or of several.
//!
//! In: questions, a table, settings. Out: the answers of each sequence, under its name. Invariant: the observations of
//! an instant are in the question or in a column: a value that is set has no instant, and is refused; an error in one
//! sequence does not affect the others.

use crate::cases::{self, Answered};
use crate::failure::Failure;
use bp_core::compiler::answer::{OtherColumns, ask_over_time_by, read_sequences};
use bp_core::compiler::data::Records;
use bp_core::compiler::error::Error;
use bp_core::compiler::learn::sizes;
use bp_core::compiler::model::{Finding, Model, Question, Value};
use bp_core::compiler::plan::Options;
use bp_core::compiler::sample::Sampling;
use bp_core::program::settings::Settings;

pub(crate) fn answers(
    model: &Model,
    questions: &[Question],
    table: &Records,
    others: &OtherColumns,
    settings: &Settings,
    (sampling, options): (Sampling, Options),
) -> Result<Vec<(String, Answered)>, Failure> {
    questions.iter().try_for_each(|question| refuse_set(model, question, settings))?;
    let inputs = sizes(model, table, settings.inputs())?;
    let mut all: Vec<(String, Answered)> = Vec::new();
    for question in questions {
        let sequences = read_sequences(model, question, table, others, &inputs)?;
        for (number, (name, instants)) in sequences.into_iter().enumerate() {
            // Each sequence has its own draws; multiplying by an odd constant gives each a different seed.
            let seed = sampling.seed.wrapping_add((number as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15));
            let answers =
                ask_over_time_by(model, question, &instants, &inputs, Sampling { seed, ..sampling }, options);
            let answers = answers.map(|answers| cases::seeded(answers, sampling));
            let answers = match (answers, &others.sequence) {
                (Err(error), None) => return Err(error.into()),
                (Err(error), Some(column)) if !error.is_of_one_case() => {
                    return Err(Failure::Words(format!("{column} {name}: {error}")));
                }
                (answers, _) => answers,
            };
            match (all.get_mut(number), answers) {
                (None, answers) => all.push((name, answers)),
                (Some((_, Ok(before))), Ok(answers)) => before.extend(answers),
                (Some((_, before)), Err(error)) if before.is_ok() => *before = Err(error),
                (Some(_), _) => {}
            }
        }
        if others.sequence.is_none() && all.is_empty() {
            // An empty table has no instants, which the question refuses.
            ask_over_time_by(model, question, &[], &inputs, sampling, options)?;
        }
    }
    Ok(all)
}

/// Refuses a set value for a known variable of the question.
fn refuse_set(model: &Model, question: &Question, settings: &Settings) -> Result<(), Error> {
    for known in question.asks.iter().flat_map(|ask| ask.known.iter().chain(ask.statistic.from())) {
        let variable = model.variable_name(known.variable);
        let given = match &known.evidence {
            Finding::Hard(Value::Given(name)) => name,
            _ => &variable,
        };
        if settings.has(given) {
            let message = format!(
                "it is set, but over time each instant has its own value: give a column `{variable}`, or write the value \
                 in the question: it then holds at every instant"
            );
            return Err(Error::input(given, message));
        }
    }
    Ok(())
}
