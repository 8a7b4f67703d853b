//! Observations over time, from a table.
//!
//! In: a question over time, and a table with a row for each instant. Out: what was observed at each, by name. Invariant:
//! a missing cell was not observed; columns of what the question does not know are left out.

use crate::data::{Table, Values};
use crate::error::Error;
use crate::exec::Inputs;
use crate::guess::listed;
use crate::ids::VariableId;
use crate::model::{Evidence, Known, Model, Question, Value};
use std::io::{Error as Wrong, ErrorKind};

/// What was observed at each instant: names of the question's known variables (of a family `Z[2]`), and values. `inputs`
/// gives the sizes on which domains depend.
///
/// # Errors
/// No column is known to the question, or one is given a value by the question as well; a cell is not a value of its
/// variable.
pub fn read_instants(
    model: &Model,
    question: &Question,
    table: &Table,
    inputs: &Inputs<'_, f64>,
) -> Result<Vec<Vec<(String, f64)>>, Error> {
    let wrong = |message: String| Error::file(&table.path, Wrong::new(ErrorKind::InvalidData, message));
    let known: Vec<&Known> = question.asks.iter().flat_map(|ask| &ask.known).collect();
    // A value that the question gives holds at every instant.
    let is_fixed =
        |known: &&Known| matches!(known.evidence, Evidence::Hard(Value::Ordinal(_) | Value::Real(_)));
    let fixed: Vec<VariableId> =
        known.iter().filter(|known| is_fixed(known)).map(|known| known.variable).collect();
    let known: Vec<VariableId> = known.iter().map(|known| known.variable).collect();
    let variable_of = |column: &String| {
        let name = column.split('[').next().unwrap_or(column).trim();
        known.iter().copied().find(|variable| model.variable_name(*variable) == name)
    };
    let columns: Vec<(usize, &String, Values<'_>)> = (table.columns.iter().enumerate())
        .filter_map(|(position, column)| {
            let values = Values::new(model, variable_of(column)?, &|name| inputs.find_size(name));
            Some((position, column, values))
        })
        .collect();
    let twice =
        columns.iter().find(|(_, column, _)| variable_of(column).is_some_and(|it| fixed.contains(&it)));
    if let Some((_, column, _)) = twice {
        let message =
            format!("the question gives `{column}` a value, and so does a column: leave one of the two out");
        return Err(wrong(message));
    }
    if columns.is_empty() && known.iter().any(|variable| !fixed.contains(variable)) {
        let names: Vec<String> = known.iter().map(|variable| model.variable_name(*variable)).collect();
        let message = format!(
            "no column is observed by the question: it knows {}, the columns are {}",
            listed(names.iter().map(String::as_str), "and"),
            listed(table.columns.iter().map(String::as_str), "and")
        );
        return Err(wrong(message));
    }
    let mut instants = Vec::with_capacity(table.len());
    for row in 0..table.len() {
        let mut instant = Vec::new();
        for (position, column, values) in &columns {
            if let Some(value) = table.cell(row, *position, values)? {
                instant.push(((*column).clone(), value.number));
            }
        }
        instants.push(instant);
    }
    Ok(instants)
}
