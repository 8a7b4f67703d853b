//! Tables from which a program learns, or whose rows are elements of its sets.
//!
//! In: tables of Python and the roles of their columns. Out: what `bp_core` learns from. Invariant: a path is read by `bp_core`; a
//! table in memory is read for the variables of the program.

use crate::error::{raised, wrong};
use crate::table::Table;
use crate::value::Names;
use bp_core::prelude::{Learning, Program, Records, Rows};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use std::path::PathBuf;

/// The roles of columns.
pub(crate) struct Columns<'c> {
    pub(crate) hidden: Names,
    pub(crate) ignore: Names,
    pub(crate) weight: Option<&'c str>,
    pub(crate) sequence: Option<&'c str>,
}

/// What a program learns from: a table, the roles of its columns, the seed and the most iterations of EM.
///
/// # Errors
/// A table that cannot be read.
pub(crate) fn of(
    py: Python<'_>,
    program: &Program,
    table: &Bound<'_, PyAny>,
    columns: Columns<'_>,
    (seed, iterations): (Option<u64>, Option<usize>),
) -> PyResult<Learning> {
    let Columns { hidden, ignore, weight, sequence } = columns;
    let mut learning = match table.extract::<PathBuf>() {
        Ok(path) => Learning::from(path),
        Err(_) => Learning::of_records(records(py, program, table, &ignore)?),
    };
    learning = hidden.0.iter().fold(learning, |learning, name| learning.hidden(name));
    learning = ignore.0.iter().fold(learning, |learning, name| learning.ignore(name));
    learning = weight.into_iter().fold(learning, Learning::weight);
    learning = sequence.into_iter().fold(learning, Learning::sequence);
    learning = seed.into_iter().fold(learning, Learning::seed);
    Ok(iterations.into_iter().fold(learning, Learning::iterations))
}

/// The rows of tables; `of` names the sets of the first of them.
///
/// # Errors
/// More sets than tables; a table that cannot be read.
pub(crate) fn rows(
    py: Python<'_>,
    program: &Program,
    tables: &Bound<'_, PyTuple>,
    of: Vec<Option<String>>,
    ignore: Names,
) -> PyResult<Rows> {
    if of.len() > tables.len() {
        let (sets, given) = (of.len(), tables.len());
        return Err(wrong(format!("`of` names {sets} sets, but the number of tables is {given}")));
    }
    let mut rows = Rows::new();
    for (at, table) in tables.iter().enumerate() {
        rows = match table.extract::<PathBuf>() {
            Ok(path) => rows.and(path),
            Err(_) => rows.and_records(records(py, program, &table, &ignore)?),
        };
        rows = of.get(at).cloned().flatten().iter().fold(rows, |rows, set| rows.of(set));
    }
    Ok(ignore.0.iter().fold(rows, |rows, column| rows.ignore(column)))
}

/// A table in memory, for the variables of a program; the cells of ignored columns are not read.
fn records(
    py: Python<'_>,
    program: &Program,
    table: &Bound<'_, PyAny>,
    ignored: &Names,
) -> PyResult<Records> {
    Table::of(py, Some(program.model()), table, &ignored.0)?.records().map_err(raised)
}
