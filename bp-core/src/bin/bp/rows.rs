//! Data as a plate on the command line: `--rows`, `--fill`.
//!
//! In: tables whose rows are elements of sets. Out: their data for a program; a table with its missing cells filled.
//! Invariant: a filled table has all cells of the one that was read, and a column of how sure each filled value is.

use crate::ask::Arguments;
use crate::data::{self, Separator};
use crate::failure::Failure;
use crate::numbers::six_digits;
use crate::output;
use crate::program::warn;
use bp_core::compiler::data::{PlateData, Records};
use bp_core::compiler::error::Error;
use bp_core::compiler::model::Model;
use bp_core::program::settings::{Settings, names};
use bp_core::program::{Posterior, Program, Rows};
use std::io::Write;
use std::path::{Path, PathBuf};

/// The options of rows.
#[derive(clap::Args)]
pub(crate) struct RowTables {
    /// A table whose rows are the elements of a set of the program; may be repeated.
    #[arg(long = "rows", value_name = "[SET=]FILE", conflicts_with_all = ["data", "table"])]
    tables: Vec<String>,
    /// Write the table with its missing cells filled: by the mean of a real, the most probable value of others.
    #[arg(long, value_name = "FILE", requires = "tables", conflicts_with_all = ["question", "json"])]
    fill: Option<PathBuf>,
}

impl RowTables {
    /// Whether a table is to be filled.
    pub(crate) fn fills(&self) -> bool {
        self.fill.is_some()
    }

    /// The data of the tables for a program.
    pub(crate) fn read(
        &self,
        model: &Model,
        typed: &[String],
        separator: &Separator,
        ignore: &[String],
    ) -> Result<PlateData, Failure> {
        read(model, &self.tables, typed, separator, ignore)
    }
}

/// The data of tables for a program; notes are shown.
pub(crate) fn read(
    model: &Model,
    tables: &[String],
    typed: &[String],
    separator: &Separator,
    ignore: &[String],
) -> Result<PlateData, Failure> {
    if tables.is_empty() {
        return Ok(PlateData::default());
    }
    let known = names(model);
    let is_known =
        |text: &&String| text.split('=').next().is_some_and(|name| known.contains_key(name.trim()));
    let sized: Vec<String> = typed.iter().filter(is_known).cloned().collect();
    let settings = Settings::read(model, &sized, &known)?;
    let tables = opened(tables, separator)?;
    let rows = PlateData::read(model, tables, ignore, &|name| settings.size(name))?;
    rows.notes.iter().for_each(|note| warn(&format!("note: {note}")));
    Ok(rows)
}

fn opened(tables: &[String], separator: &Separator) -> Result<Vec<(Option<String>, Records)>, Failure> {
    let table = |text: &String| {
        let is_name =
            |name: &str| !name.is_empty() && name.chars().all(|it| it.is_alphanumeric() || it == '_');
        let named = text.split_once('=').filter(|(name, _)| is_name(name));
        let (of, path) = named.map_or((None, text.as_str()), |(of, path)| (Some(of.to_owned()), path));
        Ok((of, data::open(Path::new(path), separator)?))
    };
    tables.iter().map(table).collect()
}

/// Writes the only table with its missing cells filled.
pub(crate) fn fill(arguments: &Arguments, out: &mut impl Write) -> Result<(), Failure> {
    let mut program = arguments.inference.of(Program::open(&arguments.file)?);
    for text in &arguments.settings {
        let (name, value) = text.split_once('=').unwrap_or((text, ""));
        program = program.with(name.trim(), value.trim())?;
    }
    let mut rows = arguments.ignore.iter().fold(Rows::new(), |rows, column| rows.ignore(column));
    for (of, records) in opened(&arguments.rows.tables, &arguments.separator)? {
        rows = rows.and_records(records);
        if let Some(of) = of {
            rows = rows.of(&of);
        }
    }
    let program = program.rows(rows)?;
    let rows = program.plate_data();
    rows.notes.iter().for_each(|note| warn(&format!("note: {note}")));
    let cells: Vec<(usize, usize, usize)> = rows.missing_cells().collect();
    let mut tables: Vec<usize> = cells.iter().map(|(table, ..)| *table).collect();
    tables.sort_unstable();
    tables.dedup();
    let table = match tables.as_slice() {
        [] => {
            return Err(Failure::Words(
                "no cell of a family is missing: there is nothing to fill".to_owned(),
            ));
        }
        [table] => *table,
        _ => {
            let words =
                "cells of several tables are missing, but `--fill` writes one: leave the other families out";
            return Err(Failure::Words(words.to_owned()));
        }
    };
    let mut filled = Filled::of(&rows.tables()[table]);
    for ((_, row, column), posterior) in cells.into_iter().zip(program.missing()?) {
        filled.fill(row, column, &posterior)?;
    }
    let text = filled.text();
    output::write(arguments.rows.fill.as_deref(), text.as_bytes(), out)
}

/// A table that is being filled.
struct Filled<'r> {
    records: &'r Records,
    /// All columns of the file, also those without a name.
    rows: Vec<Vec<String>>,
    /// Columns of how sure filled values are: of which column, their name, their cells.
    added: Vec<(usize, String, Vec<String>)>,
}

impl<'r> Filled<'r> {
    fn of(records: &'r Records) -> Self {
        let cells = |row: usize| records.row(row).map(str::to_owned).collect();
        Self { records, rows: (0..records.len()).map(cells).collect(), added: Vec::new() }
    }

    fn fill(&mut self, row: usize, column: usize, posterior: &Posterior) -> Result<(), Error> {
        let real = posterior.values().is_err();
        let (value, sure, word) = match real {
            true => {
                let mean = twelve_digits(posterior.mean()?);
                (self.number(mean), posterior.deviation()?, "deviation")
            }
            false => {
                let values = posterior.values()?;
                let best = values.into_iter().reduce(|one, other| if other.1 > one.1 { other } else { one });
                let Some((named, p)) = best else { return Ok(()) };
                let value = named.iter().next().map_or_else(String::new, |(_, value)| value.to_string());
                (self.boolean(column, value), p, "probability")
            }
        };
        let place = self.records.place(column);
        self.rows[row][place] = value;
        let added = self.added.iter().position(|(of, ..)| *of == column).unwrap_or_else(|| {
            let name = self.unused(format!("{} {word}", self.records.columns[column].trim()));
            self.added.push((column, name, vec![String::new(); self.rows.len()]));
            self.added.len() - 1
        });
        self.added[added].2[row] = self.number(six_digits(sure));
        Ok(())
    }

    /// A name that no column has: the given one, or with a number.
    fn unused(&self, name: String) -> String {
        let is_used = |name: &String| self.records.names().iter().any(|own| own.trim() == name);
        let numbered = (2..).map(|number| format!("{name} {number}"));
        std::iter::once(name.clone()).chain(numbered).find(|name| !is_used(name)).unwrap_or_default()
    }

    /// A number as the table writes them.
    fn number(&self, text: String) -> String {
        if self.records.has_decimal_commas() { text.replace('.', ",") } else { text }
    }

    /// `true` or `false` as the column writes it; other values as they are.
    fn boolean(&self, column: usize, value: String) -> String {
        const WAYS: [[&str; 2]; 6] =
            [["0", "1"], ["F", "T"], ["f", "t"], ["FALSE", "TRUE"], ["False", "True"], ["0.0", "1.0"]];
        let place = match value.as_str() {
            "false" => 0,
            "true" => 1,
            _ => return value,
        };
        let is_of = |way: &&[&str; 2]| {
            let mut cells = (0..self.records.len()).map(|row| self.records.text(row, column).trim());
            cells.any(|cell| way.contains(&cell))
        };
        WAYS.iter().find(is_of).map_or(value, |way| way[place].to_owned())
    }

    /// As CSV, with the separator of the file.
    fn text(&self) -> String {
        let separator = self.records.separator();
        let names = self.records.names().iter().chain(self.added.iter().map(|(_, name, _)| name));
        let mut text = line(separator, names.map(String::as_str));
        for (row, cells) in self.rows.iter().enumerate() {
            let added = self.added.iter().map(|(.., cells)| cells[row].as_str());
            text.push_str(&line(separator, cells.iter().map(String::as_str).chain(added)));
        }
        text
    }
}

/// A number with twelve digits at most: more of a mean are rounding.
fn twelve_digits(number: f64) -> String {
    format!("{number:.11e}").parse::<f64>().map_or_else(|_| number.to_string(), |rounded| rounded.to_string())
}

/// A row of cells, quoted as RFC 4180 where that is needed.
fn line<'c>(separator: char, cells: impl Iterator<Item = &'c str>) -> String {
    let quoted = |cell: &str| match cell.contains([separator, '"', '\n', '\r']) {
        true => format!("\"{}\"", cell.replace('"', "\"\"")),
        false => cell.to_owned(),
    };
    cells.map(quoted).collect::<Vec<_>>().join(&separator.to_string()) + "\n"
}
