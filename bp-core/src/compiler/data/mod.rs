//! Tables of data: the reader that every command uses.
//!
//! In: a file of rows, separated by commas, semicolons or tabs. Out: [`Records`], and each of its cells as a value of a
//! variable. Invariant: every row has a cell for each column; an error names file, row, column and cell.
//!
//! `docs/formats.md`, section "Data files", describes the format.

mod cells;
mod plate;
mod read;
#[cfg(test)]
mod tests;
mod values;

pub use cells::Cells;
pub use plate::PlateData;
pub use read::{open, read_table};
pub use values::{MISSING, Value, Values, is_missing};

use crate::door::Advice;
use crate::error::Error;
use crate::guess::{listed, near};
use std::io::{Error as Wrong, ErrorKind};
use std::path::{Path, PathBuf};

/// A table of cells.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Records {
    /// The source of the data.
    pub path: PathBuf,
    /// The names of the columns, each once.
    pub columns: Vec<String>,
    /// Notes for the user on the reader's decisions: another separator, an ignored column.
    pub notes: Vec<String>,
    /// The text of all cells, concatenated.
    cells: String,
    /// The end of each cell.
    ends: Vec<u32>,
    /// The names of all columns of the file, also of those without a name.
    names: Vec<String>,
    /// The character between two cells of a row.
    separator: u8,
    /// Number of cells in a row of the file.
    width: usize,
    /// The cell of each column.
    positions: Vec<usize>,
    /// The line of the file in which each row begins, from 1.
    lines: Vec<u32>,
    /// An example of a number with a decimal comma, if there are any.
    decimal_comma: Option<String>,
}

impl Records {
    /// Number of rows, without the header.
    pub fn len(&self) -> usize {
        self.lines.len()
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.lines.is_empty()
    }

    /// The line of the file in which a row begins: messages call it the row. The header is row 1.
    pub fn line(&self, row: usize) -> usize {
        self.lines[row] as usize
    }

    /// The text of a cell.
    pub fn text(&self, row: usize, column: usize) -> &str {
        self.cell_text(row * self.width + self.positions[column])
    }

    /// The names of all columns of the file; empty for those without a name.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The cells of all columns of the file in a row.
    pub fn row(&self, row: usize) -> impl Iterator<Item = &str> {
        (row * self.width..(row + 1) * self.width).map(move |cell| self.cell_text(cell))
    }

    /// The place of a column among all columns of the file.
    pub fn place(&self, column: usize) -> usize {
        self.positions[column]
    }

    /// The character between two cells of a row, in ASCII.
    pub fn separator(&self) -> char {
        self.separator.into()
    }

    /// Whether numbers have decimal commas.
    pub fn has_decimal_commas(&self) -> bool {
        self.decimal_comma.is_some()
    }

    fn cell_text(&self, cell: usize) -> &str {
        let begin = cell.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.cells[begin as usize..self.ends[cell] as usize]
    }

    /// The value of a cell; `None` if it is missing.
    ///
    /// # Errors
    /// The cell is not a value of the variable.
    pub fn cell(&self, row: usize, column: usize, values: &Values<'_>) -> Result<Option<Value>, Error> {
        let text = self.text(row, column);
        values
            .read_written(text, self.decimal_comma.as_deref())
            .map_err(|message| self.wrong(row, column, message))
    }

    /// An error about a cell: "`data.csv`, row 3, column `X`: `7` is …".
    pub fn wrong(&self, row: usize, column: usize, message: impl Into<String>) -> Error {
        Error::Cell {
            path: self.path.clone(),
            row: self.line(row),
            column: shown(&self.columns[column]),
            value: shown(self.text(row, column)),
            message: message.into(),
        }
    }

    /// An error about a row.
    pub fn wrong_row(&self, row: usize, error: Error) -> Error {
        Error::Row { path: self.path.clone(), row: self.line(row), error: Box::new(error) }
    }

    /// A table without columns, to which columns are added.
    pub fn in_memory() -> Self {
        Self { path: "columns in memory".into(), separator: b',', ..Self::default() }
    }

    /// A table in memory, in one pass: `write` appends the text of a cell, by row and column, from 0; nothing is a missing
    /// value. Messages call it `name`, and its rows by their numbers from `first`.
    ///
    /// # Errors
    /// Two columns of one name; more text, or more rows, than a table holds (4 GiB).
    pub fn of_columns(
        name: &str,
        columns: Vec<String>,
        (first, rows): (usize, usize),
        mut write: impl FnMut(usize, usize, &mut String),
    ) -> Result<Self, Error> {
        let mut table = Self { path: name.into(), separator: b',', width: columns.len(), ..Self::default() };
        if let Some(at) = (1..columns.len()).find(|at| columns[..*at].contains(&columns[*at])) {
            return Err(wrong(&table.path, format!("two columns have the name `{}`", shown(&columns[at]))));
        }
        let too_long = |table: &Self| wrong(&table.path, "it holds more than 4 GiB of text".to_owned());
        for row in 0..rows {
            for column in 0..columns.len() {
                write(row, column, &mut table.cells);
                let end = u32::try_from(table.cells.len()).map_err(|_| too_long(&table))?;
                table.ends.push(end);
            }
            table.lines.push(u32::try_from(first + row).map_err(|_| too_long(&table))?);
        }
        table.names.clone_from(&columns);
        table.positions = (0..columns.len()).collect();
        table.columns = columns;
        Ok(table)
    }

    /// Adds a column of texts, one for each row; beyond its end, and in rows that only it has, cells are missing.
    pub fn add_column(&mut self, name: &str, texts: &[String]) {
        let rows = self.len().max(texts.len());
        let mut wider = Self { cells: String::new(), ends: Vec::new(), lines: Vec::new(), ..self.clone() };
        for row in 0..rows {
            let own = (0..self.width).map(|at| match row < self.len() {
                true => self.cell_text(row * self.width + at),
                false => "",
            });
            let line = self.lines.get(row).map_or(row + 2, |line| *line as usize);
            wider.push(line, own.chain([texts.get(row).map_or("", String::as_str)]));
        }
        wider.columns.push(name.to_owned());
        wider.names.push(name.to_owned());
        wider.positions.push(self.width);
        wider.width += 1;
        *self = wider;
    }

    /// The table without some columns.
    ///
    /// # Errors
    /// There is no column of a name.
    pub fn without(mut self, ignored: &[String]) -> Result<Self, Error> {
        for name in ignored {
            let at = self.needed(name)?;
            self.columns.remove(at);
            self.positions.remove(at);
        }
        Ok(self)
    }

    /// The column of this name.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column == name)
    }

    /// The column of this name, which must exist.
    ///
    /// # Errors
    /// There is none; the error suggests a similar name.
    pub fn needed(&self, name: &str) -> Result<usize, Error> {
        self.column(name).ok_or_else(|| {
            let columns = self.columns.iter().map(String::as_str);
            let help = match near(name, columns.clone()) {
                Some(near) if near.len() != name.len() => {
                    format!("did you mean `{near}`? The column is named as the variable: `{}`", shown(name))
                }
                Some(name) => format!("did you mean `{name}`?"),
                None if columns.clone().all(|name| name.trim().parse::<f64>().is_ok()) => {
                    "row 1 has the names of the columns, but here it has numbers".to_owned()
                }
                None => format!("the columns are {}", listed(columns, "and")),
            };
            wrong(&self.path, format!("there is no column `{}`; {help}", shown(name)))
        })
    }

    /// An error about a column that matches none of these names.
    pub fn unknown<'n>(&self, column: usize, names: impl IntoIterator<Item = &'n str> + Clone) -> Error {
        let help = match near(&self.columns[column], names.clone()) {
            Some(name) => format!("did you mean `{name}`?"),
            None => format!("the variables are {}", listed(names, "and")),
        };
        let name = shown(&self.columns[column]);
        wrong(
            &self.path,
            format!(
                "column `{name}` names no variable; {help} (`{}` leaves a column out)",
                Advice::IgnoreAny
            ),
        )
    }
}

/// An error about a whole file.
fn wrong(path: &Path, message: String) -> Error {
    Error::file(path, Wrong::new(ErrorKind::InvalidData, message))
}

/// The text of a cell for a message: on one line, and shortened.
fn shown(text: &str) -> String {
    const MOST: usize = 60;
    let mut shown: String = text.chars().take(MOST).flat_map(printable).collect();
    if text.chars().nth(MOST).is_some() {
        shown.push('…');
    }
    shown
}

fn printable(letter: char) -> Vec<char> {
    match letter.is_control() {
        true => letter.escape_default().collect(),
        false => vec![letter],
    }
}
