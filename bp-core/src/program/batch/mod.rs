//! The posteriors of many cases, as a table of numbers.
//!
//! In: a program, and a table with a column for each observed variable. Out: a [`Batch`]: a row of numbers for each case.
//! Invariant: rows have the order of the cases; the columns depend on the names of those of the table, not on its cells; a case
//! without an answer has its reason; cases that observe the same variables have one plan.

mod each;
mod tree;
mod wanted;

use super::Program;
use super::source::TableSource;
use crate::data::Records;
use crate::error::Error;
use rayon::prelude::*;
use std::path::Path;
use wanted::Wanted;

/// A table of cases: `Cases::from("cases.csv")`, `Cases::from("cases.csv").only(["lung"])`, or columns in memory.
///
/// ```
/// use bp_core::prelude::*;
/// # fn main() -> Result<(), bp_core::Error> {
/// let lawn = Program::parse(
///     "program Lawn {
///          variables { Rain, Wet : bool; }
///          decomposition { P(Rain) P(Wet | Rain) }
///          forms { P(Rain) = bernoulli(0.2); P(Wet | Rain) = bernoulli(if Rain { 0.9 } else { 0.1 }); }
///      }",
/// )?;
/// let found = lawn.batch(Cases::new().column("Wet", ["true", ""]).only(["Rain"]))?;
/// assert_eq!(found.columns, ["ln_p_evidence", "Rain=false", "Rain=true"]);
/// // P(Rain | Wet) = 0.2 · 0.9 / (0.2 · 0.9 + 0.8 · 0.1); the second row observes nothing.
/// let rain = |row: usize| found.rows[row].as_ref().map(|numbers| numbers[2]).unwrap();
/// assert!((rain(0) - 0.18 / 0.26).abs() < 1e-15 && (rain(1) - 0.2).abs() < 1e-15);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Cases {
    source: TableSource,
    only: Vec<String>,
}

impl<P: AsRef<Path>> From<P> for Cases {
    fn from(path: P) -> Self {
        Self { source: TableSource::file(path.as_ref()), only: Vec::new() }
    }
}

impl Cases {
    /// A table without columns, to which columns are added.
    pub fn new() -> Self {
        Self::of_records(Records::in_memory())
    }

    /// Another column in memory, with a cell for each case; an empty one is not observed. It has no effect on a file.
    #[must_use]
    pub fn column<T: ToString>(mut self, name: &str, cells: impl IntoIterator<Item = T>) -> Self {
        if let TableSource::Records(records) = &mut self.source {
            records.add_column(name, &cells.into_iter().map(|cell| cell.to_string()).collect::<Vec<_>>());
        }
        self
    }

    /// A table that has been read.
    pub fn of_records(records: Records) -> Self {
        Self { source: TableSource::records(records), only: Vec::new() }
    }

    /// The posteriors of these variables only, or of these elements of families (`Z[2]`).
    #[must_use]
    pub fn only<N: Into<String>>(mut self, names: impl IntoIterator<Item = N>) -> Self {
        self.only.extend(names.into_iter().map(Into::into));
        self
    }
}

impl Default for Cases {
    fn default() -> Self {
        Self::new()
    }
}

/// The posteriors of many cases.
#[derive(Debug)]
pub struct Batch {
    /// The names of the numbers: `ln_p_evidence`, then `variable=value` for the probability of each value of a finite
    /// variable, and `variable.mean`, `variable.deviation` for a real. They are known before the first case.
    pub columns: Vec<String>,
    /// For each case its numbers in the order of the columns (NaN where the case has none, as of an observed real, or
    /// ln P(evidence) by Gibbs sampling), or the reason why it has no answer.
    pub rows: Vec<Result<Vec<f64>, Error>>,
}

impl Program {
    /// The posteriors of many cases, the rows of a table with a column for each observed variable:
    /// `batch("cases.csv")`, `batch(Cases::from("cases.csv").only(["lung"]))`.
    ///
    /// # Errors
    /// A table that cannot be read or does not fit, with file, row and column. A case without an answer has its error in
    /// its row.
    pub fn batch(&self, cases: impl Into<Cases>) -> Result<Batch, Error> {
        self.batch_with(&cases.into(), || ())
    }

    /// The same; `done` is called after each case, from any thread.
    ///
    /// # Errors
    /// As [`Program::batch`].
    pub fn batch_with(&self, cases: &Cases, done: impl Fn() + Sync) -> Result<Batch, Error> {
        batch(self, cases, &done)
    }

    /// The names of the columns of [`Program::batch`], which depend on the names of the columns of the cases alone: they may be
    /// known before the first case.
    ///
    /// # Errors
    /// A column that is no variable; a size that is missing.
    pub fn batch_columns(&self, cases: impl Into<Cases>) -> Result<Vec<String>, Error> {
        let cases = cases.into();
        Ok(Wanted::new(self, &*cases.source.read()?, &cases.only)?.columns())
    }
}

/// The posteriors of each case; `done` is called after each, from any thread.
fn batch(program: &Program, cases: &Cases, done: &(dyn Fn() + Sync)) -> Result<Batch, Error> {
    let records = &*cases.source.read()?;
    let wanted = Wanted::new(program, records, &cases.only)?;
    let rows = match wanted.tree()? {
        Some(tree) => tree::rows(&wanted, tree, records, done),
        None => each::rows(&wanted, records, done),
    }?;
    Ok(Batch { columns: wanted.columns(), rows })
}

/// The evidence of each row, read in parallel.
///
/// # Errors
/// The error of the first row that has one.
fn read_all<T: Send>(rows: usize, read: impl Fn(usize) -> Result<T, Error> + Sync) -> Result<Vec<T>, Error> {
    let all: Result<Vec<T>, Error> = (0..rows).into_par_iter().map(&read).collect();
    // In parallel any of several errors may come first.
    all.or_else(|_| (0..rows).map(read).collect())
}
