//! Learning: a program and a table of cases become a program with numbers.
//!
//! In: a program with `unknown` forms or an `identification`, a table (CSV). Out: a [`Learned`]: the program, its text, and a report.
//! Invariant: what is not learned stays as the author wrote it, comments included.

use super::Program;
use crate::data;
use crate::error::Error;
use crate::learn::{Columns, Learner, Report, Settings, sizes};
use crate::source::Source;
use crate::syntax::{compile, graft, parse};
use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A table of cases, and how it is to be read: `Learning::from("mails.csv").hidden("Kind")`.
#[derive(Clone, Debug, Default)]
pub struct Learning {
    path: PathBuf,
    columns: Columns,
    settings: Settings,
}

impl<P: AsRef<Path>> From<P> for Learning {
    fn from(path: P) -> Self {
        Self { path: path.as_ref().to_owned(), ..Self::default() }
    }
}

impl Learning {
    /// A variable that has no column.
    #[must_use]
    pub fn hidden(mut self, variable: &str) -> Self {
        self.columns.hidden.push(variable.to_owned());
        self
    }

    /// A column that is left out.
    #[must_use]
    pub fn ignore(mut self, column: &str) -> Self {
        self.columns.ignore.push(column.to_owned());
        self
    }

    /// The column that says how often each row came.
    #[must_use]
    pub fn weight(mut self, column: &str) -> Self {
        self.columns.weight = Some(column.to_owned());
        self
    }

    /// The column that tells sequences apart, of a program over time.
    #[must_use]
    pub fn sequence(mut self, column: &str) -> Self {
        self.columns.sequence = Some(column.to_owned());
        self
    }

    /// What the start is drawn from, where something is hidden.
    #[must_use]
    pub fn seed(mut self, seed: u64) -> Self {
        self.settings.seed = seed;
        self
    }

    /// The most steps, where something is hidden.
    #[must_use]
    pub fn iterations(mut self, most: usize) -> Self {
        self.settings.iterations = most;
        self
    }
}

/// A program with what was learned; it is asked as any other.
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

    /// From how many cases it was learned, and how well, form by form.
    pub fn report(&self) -> &Report {
        &self.report
    }

    /// Its text: the author's, with what was learned. A program without a text has none.
    pub fn text(&self) -> Option<&str> {
        Some(&self.program.opened.source.as_ref()?.text)
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
    let table = data::open(&learning.path, None)?;
    let given = sizes(model, &table, program.settings.inputs())?;
    let mut learner = Learner::with(model, &given)?;
    learner.observe_table(&table, &learning.columns)?;
    let learned = learner.learned_with(&learning.settings, &mut |_, _| {})?;
    let source = match &program.opened.source {
        Some(source) => Some(grafted(source, &learned.text())?),
        None => None,
    };
    let opened = super::Opened { source, ..super::Opened::from(learned.model().clone()) };
    let settings = program.given.learned(learned.model(), &given);
    let learnt = Program::with_settings(Arc::new(opened), settings, (program.sampling, program.by));
    Ok(Learned { program: learnt, report: learned.report })
}

/// The author's text with what was learned.
fn grafted(source: &Source, learned: &str) -> Result<Source, Error> {
    let learned = Source::new("what was learned", learned);
    let forms = parse(&learned).map_err(|wrong| Error::program(&learned, wrong))?;
    let mut file = parse(source).map_err(|wrong| Error::program(source, wrong))?;
    if let Some(forms) = forms.programs.first() {
        graft(&mut file, forms);
    }
    let read_back = Source::new("what was learned", file.to_string());
    compile(&read_back).map_err(|wrong| Error::program(&read_back, wrong))?;
    Ok(read_back)
}
