//! Learning: from a program and a table of cases to a program with numbers.
//!
//! In: a program with `unknown` forms or an `identification`, a table (CSV). Out: a [`Learned`]: the program, its text,
//! and a report. Invariant: everything else stays as the author wrote it, comments included.

use super::Program;
use super::source::TableSource;
use crate::data::Records;
use crate::error::Error;
use crate::exec::Inputs;
use crate::learn::{self, Columns, Learner, Report, Settings, sizes};
use crate::source::Source;
use crate::syntax::{compile, graft, parse};
use std::ops::Deref;
use std::path::Path;
use std::sync::Arc;

/// A table of cases, with options for reading it: `Learning::from("mails.csv").hidden("Kind")`, or columns in memory.
///
/// ```
/// use bp_core::prelude::*;
/// # fn main() -> Result<(), bp_core::Error> {
/// let lawn = Program::parse(
///     "program Lawn {
///          variables { Rain, Wet : bool; }
///          decomposition { P(Rain) P(Wet | Rain) }
///          forms { P(Rain) = unknown; P(Wet | Rain) = bernoulli(if Rain { 0.9 } else { 0.1 }); }
///      }",
/// )?;
/// let seen = Learning::new().column("Rain", [true, true, false, true]).column("Wet", [true, false, true, true]);
/// // Three of four days are rainy; `unknown` counts each value once more.
/// assert_eq!(lawn.learn(seen)?.ask("P(Rain)")?.p(true)?, (3.0 + 1.0) / (4.0 + 2.0));
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Learning {
    source: TableSource,
    columns: Columns,
    settings: Settings,
}

impl<P: AsRef<Path>> From<P> for Learning {
    fn from(path: P) -> Self {
        Self { source: TableSource::file(path.as_ref()), ..Self::default() }
    }
}

impl Default for Learning {
    fn default() -> Self {
        Self::of_records(Records::in_memory())
    }
}

impl Learning {
    /// A table without columns, to which columns are added.
    pub fn new() -> Self {
        Self::default()
    }

    /// A table that has been read.
    pub fn of_records(records: Records) -> Self {
        let source = TableSource::records(records);
        Self { source, columns: Columns::default(), settings: Settings::default() }
    }

    /// Another column in memory, with a cell for each case; an empty one is not observed. It has no effect on a file.
    #[must_use]
    pub fn column<T: ToString>(mut self, name: &str, cells: impl IntoIterator<Item = T>) -> Self {
        if let TableSource::Records(records) = &mut self.source {
            records.add_column(name, &cells.into_iter().map(|cell| cell.to_string()).collect::<Vec<_>>());
        }
        self
    }

    /// A hidden variable.
    #[must_use]
    pub fn hidden(mut self, variable: &str) -> Self {
        self.columns.hidden.push(variable.to_owned());
        self
    }

    /// An ignored column.
    #[must_use]
    pub fn ignore(mut self, column: &str) -> Self {
        self.columns.ignore.push(column.to_owned());
        self
    }

    /// The column of weights.
    #[must_use]
    pub fn weight(mut self, column: &str) -> Self {
        self.columns.weight = Some(column.to_owned());
        self
    }

    /// Over time: the column that identifies the sequence of a row.
    #[must_use]
    pub fn sequence(mut self, column: &str) -> Self {
        self.columns.sequence = Some(column.to_owned());
        self
    }

    /// The random seed of the initial values, if there are hidden variables.
    #[must_use]
    pub fn seed(mut self, seed: u64) -> Self {
        self.settings.seed = seed;
        self
    }

    /// Limit of iterations, if there are hidden variables.
    #[must_use]
    pub fn iterations(mut self, most: usize) -> Self {
        self.settings.iterations = most;
        self
    }
}

/// A learned program, which is asked like any other.
#[derive(Clone, Debug)]
pub struct Learned {
    program: Program,
    report: Report,
}

impl Learned {
    /// The program.
    pub fn program(&self) -> &Program {
        &self.program
    }

    /// The report of learning.
    pub fn report(&self) -> &Report {
        &self.report
    }

    /// Its text: the author's, with the learned numbers; `None` for a program without text.
    pub fn text(&self) -> Option<&str> {
        self.program.text()
    }
}

impl Deref for Learned {
    type Target = Program;

    fn deref(&self) -> &Program {
        &self.program
    }
}

pub(super) fn learn(program: &Program, learning: &Learning) -> Result<Learned, Error> {
    let model = program.model();
    let table = learning.source.read()?;
    let given = sizes(model, &table, program.settings.inputs())?;
    let mut learner = Learner::with(model, &given)?;
    learner.observe_table(&table, &learning.columns)?;
    finished(program, learner.learned_with(&learning.settings, &mut |_, _| {})?, &given)
}

/// The program with the learned numbers.
pub(super) fn finished(
    program: &Program,
    learned: learn::Learned,
    given: &Inputs<'_, f64>,
) -> Result<Learned, Error> {
    let source = match &program.opened.source {
        Some(source) => Some(grafted(source, &learned.text())?),
        None => None,
    };
    let opened = super::Opened { source, ..super::Opened::from(learned.model().clone()) };
    let settings = program.given.learned(learned.model(), given);
    let learnt = Program::with_settings(Arc::new(opened), settings, (program.sampling, program.options));
    Ok(Learned { program: learnt, report: learned.report })
}

/// The author's text with the learned numbers.
fn grafted(source: &Source, learned: &str) -> Result<Source, Error> {
    let learned = Source::new("the learned program", learned);
    let forms = parse(&learned).map_err(|wrong| Error::program(&learned, wrong))?;
    let mut file = parse(source).map_err(|wrong| Error::program(source, wrong))?;
    if let Some(forms) = forms.programs.first() {
        graft(&mut file, forms);
    }
    let read_back = Source::new("the learned program", file.to_string());
    compile(&read_back).map_err(|wrong| Error::program(&read_back, wrong))?;
    Ok(read_back)
}
