//! Answers a question for many cases: the rows of a table.
//!
//! In: a model, a question, a table whose columns are named as variables. Out: the answers of each case. Invariant: the
//! cells of a case are the values that the question leaves open; a missing cell is not known in that case. The question
//! is compiled once for each set of missing variables.

use crate::failure::Failure;
use bp_core::answer::{Answer, CompiledQuestion, compile_by, filled, open};
use bp_core::data::{Table, Values};
use bp_core::ids::VariableId;
use bp_core::model::{Model, Question};
use bp_core::plan::Strategy;
use bp_core::program::settings::Settings;
use bp_core::sample::Sampling;
use std::collections::{BTreeSet, HashMap};

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
        // Each case has its own draws; an odd factor gives each row its own seed.
        let seed = sampling.seed.wrapping_add((row as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let mut told = Vec::new();
        for question in &compiled[&missing] {
            let sampling = Sampling { seed, ..sampling };
            told.extend(question.ask_filled(&inputs, sampling).map_err(in_row)?);
        }
        answers.push((table.line(row), told));
    }
    Ok(answers)
}

/// The column of each open variable; none for one that is set.
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
