//! Tables with commas between their columns.
//!
//! In: a file whose first row names the columns. Out: a [`Table`]. Invariant: every row has as many cells as there are
//! columns; an empty cell is missing.
//!
//! RFC 4180: cells may stand in quotes, which are doubled inside.

use crate::error::Error;
use std::io::{Error as Wrong, ErrorKind, Read};
use std::path::{Path, PathBuf};

/// What is written where nothing was seen, besides an empty cell.
pub const MISSING: [&str; 2] = ["NA", "?"];

/// A table of words.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Table {
    /// Where it comes from.
    pub path: PathBuf,
    /// The names of the columns.
    pub columns: Vec<String>,
    /// The cells, row by row; `None` where nothing is written.
    pub rows: Vec<Vec<Option<String>>>,
}

impl Table {
    /// The row of the file in which a row of the table stands: the names of the columns are row 1.
    pub fn line(&self, row: usize) -> usize {
        row + 2
    }
}

/// Reads a table.
///
/// # Errors
/// The file cannot be read, is not UTF-8, names no column or one twice, or has a row that is too short or too long.
pub fn read_table(path: &Path, from: impl Read) -> Result<Table, Error> {
    let wrong = |message: String| Error::file(path, Wrong::new(ErrorKind::InvalidData, message));
    let mut reader = ::csv::ReaderBuilder::new().trim(::csv::Trim::All).flexible(true).from_reader(from);
    let told = |error: ::csv::Error| match error.into_kind() {
        ::csv::ErrorKind::Io(error) => Error::file(path, error),
        ::csv::ErrorKind::Utf8 { pos, .. } => {
            let row = pos.map_or(1, |pos| pos.record() + 1);
            wrong(format!("row {row} is not UTF-8 text"))
        }
        other => wrong(format!("{other:?}")),
    };
    let columns: Vec<String> = reader.headers().map_err(told)?.iter().map(clean).collect();
    if columns.iter().all(String::is_empty) {
        return Err(wrong("row 1 must name the columns, but it is empty".to_owned()));
    }
    if let Some((at, twice)) = columns.iter().enumerate().find(|(at, column)| columns[..*at].contains(column))
    {
        return Err(wrong(format!(
            "row 1 names the column `{twice}` twice, the second time as column {}",
            at + 1
        )));
    }
    let mut table = Table { path: path.to_owned(), columns, rows: Vec::new() };
    for record in reader.records() {
        let record = record.map_err(told)?;
        let (found, expected) = (record.len(), table.columns.len());
        if found != expected {
            let row = table.line(table.rows.len());
            return Err(wrong(format!("row {row} has {found} cells, but there are {expected} columns")));
        }
        let cells = record.iter().map(|cell| (!cell.is_empty()).then(|| cell.to_owned()));
        table.rows.push(cells.collect());
    }
    Ok(table)
}

/// A name without the byte order mark that some programs put first.
fn clean(name: &str) -> String {
    name.trim_start_matches('\u{feff}').trim().to_owned()
}
