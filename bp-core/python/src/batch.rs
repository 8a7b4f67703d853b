//! The posteriors of many cases: columns in, columns out.
//!
//! In: a program, and a table with a column for each observed variable. Out: a column for each number, and the reason of
//! each row that has none. Invariant: rows have the order of the cases, and run in parallel without the interpreter lock.

use crate::error::{raised, wrong};
use crate::table::Table;
use crate::work::patiently_until;
use arrow_array::{ArrayRef, Float64Array, RecordBatch, StringArray};
use arrow_schema::{DataType, Field, Schema};
use bp_core::compiler::data;
use bp_core::prelude::{Batch, Cases, Error, Program};
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3_arrow::PyTable;
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::{Duration, Instant};

/// The least and the largest number of rows that are answered between two looks for an interrupt, and the time that this
/// may take.
const ROWS: [usize; 2] = [1 << 6, 1 << 16];
const GLANCE: Duration = Duration::from_millis(100);

/// The number of rows, names, columns, and (row, reason) of the rows without an answer.
pub(crate) type Columns<'py> = (usize, Vec<String>, Vec<Bound<'py, PyArray1<f64>>>, Vec<(usize, String)>);

/// Columns that are not finished.
#[derive(Default)]
struct Found {
    names: Vec<String>,
    columns: Vec<Vec<f64>>,
    reasons: Vec<(usize, String)>,
    rows: usize,
}

impl Found {
    /// Adds the rows of a batch; all parts of a table have the same columns.
    fn add(&mut self, batch: Batch) {
        if self.names.is_empty() {
            self.columns = vec![Vec::new(); batch.columns.len()];
            self.names = batch.columns;
        }
        let rows = self.rows + batch.rows.len();
        self.columns.iter_mut().for_each(|column| column.resize(rows, f64::NAN));
        for (row, found) in (self.rows..).zip(batch.rows) {
            match found {
                Ok(numbers) => {
                    self.columns.iter_mut().zip(numbers).for_each(|(column, number)| column[row] = number);
                }
                Err(error) => self.reasons.push((row, error.to_string())),
            }
        }
        self.rows = rows;
    }
}

/// The posteriors of each case of a table.
///
/// # Errors
/// A table that cannot be read or does not fit, with row and column.
pub(crate) fn batch<'py>(
    py: Python<'py>,
    program: &Program,
    table: &Bound<'py, PyAny>,
    only: &[String],
    ignored: &[String],
) -> PyResult<Columns<'py>> {
    let (own, only, ignored) = (program.clone(), only.to_vec(), ignored.to_vec());
    let found = match table.extract::<PathBuf>() {
        Ok(path) => patiently_until(py, move |_| {
            let mut found = Found::default();
            let cases = match ignored.is_empty() {
                true => Cases::from(path),
                false => Cases::of_records(data::open(&path, None)?.without(&ignored)?),
            };
            found.add(own.batch(cases.only(only))?);
            Ok(found)
        })?,
        Err(_) => {
            let table = Table::of(py, Some(program.model()), table, &ignored)?;
            patiently_until(py, move |unwanted| answered(&own, &table, [&only, &ignored], unwanted))?
        }
    };
    let found = found.map_err(raised)?;
    let columns = found.columns.into_iter().map(|column| PyArray1::from_vec(py, column));
    Ok((found.rows, found.names, columns.collect(), found.reasons))
}

/// The answers of a table, part by part: while a part is answered by all threads, another thread adds the answers before it
/// and reads the cases after it.
fn answered(
    program: &Program,
    table: &Table,
    [only, ignored]: [&[String]; 2],
    unwanted: &AtomicBool,
) -> Result<Found, Error> {
    let (mut found, rows, mut most) = (Found::default(), table.len(), ROWS[0]);
    let mut read = most.min(rows);
    let mut cases = table.part(0, read)?.without(ignored)?;
    let mut before: Option<Batch> = None;
    loop {
        let (begun, more) = (Instant::now(), most.min(rows - read));
        let answer = || program.batch(Cases::of_records(cases).only(only));
        let mut beside = || {
            before.take().into_iter().for_each(|batch| found.add(batch));
            table.part(read, more)?.without(ignored)
        };
        let (batch, next) = match more {
            0 => (answer(), beside()),
            _ => std::thread::scope(|scope| {
                let beside = scope.spawn(beside);
                (answer(), beside.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
            }),
        };
        let batch = batch?;
        if more == 0 {
            found.add(batch);
            return Ok(found);
        }
        (before, cases, read) = (Some(batch), next?, read + more);
        if begun.elapsed() < GLANCE {
            most = (4 * most).min(ROWS[1]);
        }
        if unwanted.load(Relaxed) {
            return Err(Error::Interrupted);
        }
    }
}

/// Columns as a table of Arrow, which has `__arrow_c_stream__`: float64 for each column, null where it is NaN, and text for
/// `error`, from the reasons by row. The numbers are copied.
#[pyfunction]
#[pyo3(name = "_stream")]
pub(crate) fn stream(
    rows: usize,
    columns: Vec<(String, PyReadonlyArray1<'_, f64>)>,
    reasons: HashMap<usize, String>,
) -> PyResult<PyTable> {
    let mut fields: Vec<Field> =
        columns.iter().map(|(name, _)| Field::new(name, DataType::Float64, true)).collect();
    let known = |number: &f64| (!number.is_nan()).then_some(*number);
    let mut arrays: Vec<ArrayRef> = Vec::new();
    for (_, column) in &columns {
        arrays.push(Arc::new(column.as_array().iter().map(known).collect::<Float64Array>()));
    }
    fields.push(Field::new("error", DataType::Utf8, true));
    let errors = (0..rows).map(|row| reasons.get(&row));
    arrays.push(match reasons.is_empty() {
        true => Arc::new(StringArray::new_null(rows)),
        false => Arc::new(errors.collect::<StringArray>()),
    });
    let schema = Arc::new(Schema::new(fields));
    let batch =
        RecordBatch::try_new(Arc::clone(&schema), arrays).map_err(|error| wrong(error.to_string()))?;
    PyTable::try_new(vec![batch], schema)
}
