//! Observations over time, from a table.
//!
//! In: a question over time, and a table with a row for each instant. Out: what was observed at each, by name. Invariant:
//! an empty cell was not observed; columns of what the question does not know are left out; a wrong cell is told with
//! its file, row and column.

use crate::data::Table;
use crate::error::Error;
use crate::ids::VariableId;
use crate::model::{Domain, Model, Question};
use std::io::{Error as Wrong, ErrorKind};

/// What was observed at each instant: names of the question's known variables (of a family `Z[2]`), and values.
///
/// # Errors
/// No column is known to the question, or a cell is no value of its variable.
pub fn read_instants(
    model: &Model,
    question: &Question,
    table: &Table,
) -> Result<Vec<Vec<(String, f64)>>, Error> {
    let wrong = |message: String| Error::file(&table.path, Wrong::new(ErrorKind::InvalidData, message));
    let known: Vec<VariableId> =
        question.asks.iter().flat_map(|ask| &ask.known).map(|known| known.variable).collect();
    let variable_of = |column: &String| {
        let name = column.split('[').next().unwrap_or(column).trim();
        known.iter().copied().find(|variable| model.variable_name(*variable) == name)
    };
    let columns: Vec<(usize, &String, VariableId)> = (table.columns.iter().enumerate())
        .filter_map(|(position, column)| Some((position, column, variable_of(column)?)))
        .collect();
    if columns.is_empty() && !known.is_empty() {
        let names: Vec<String> =
            known.iter().map(|variable| format!("`{}`", model.variable_name(*variable))).collect();
        let found: Vec<String> = table.columns.iter().map(|column| format!("`{column}`")).collect();
        let message = format!(
            "no column is observed by the question: it knows {}, the columns are {}",
            names.join(", "),
            found.join(", ")
        );
        return Err(wrong(message));
    }
    let mut instants = Vec::with_capacity(table.rows.len());
    for (row, cells) in table.rows.iter().enumerate() {
        let mut instant = Vec::new();
        for (position, column, variable) in &columns {
            let Some(text) = &cells[*position] else { continue };
            let domain = &model.variables[*variable].domain;
            let value = match domain {
                Domain::Real | Domain::Vector(_) => {
                    text.parse().ok().filter(|number: &f64| number.is_finite())
                }
                Domain::Boolean if text == "0" || text == "1" => text.parse().ok(),
                Domain::Set(_) => text.parse::<usize>().ok().map(|element| element as f64),
                _ => domain.ordinal_of(text).map(|ordinal| ordinal as f64),
            };
            let value = value.ok_or_else(|| {
                let (line, domain) = (table.line(row), model.domain_text(domain));
                wrong(format!("row {line}: `{text}` is not a value of `{column}`, which is `{domain}`"))
            })?;
            instant.push(((*column).clone(), value));
        }
        instants.push(instant);
    }
    Ok(instants)
}
