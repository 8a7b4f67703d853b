//! Errors of programs, data and questions.
//!
//! In: a name and the value that was found; for a wrong program its diagnostics and its text. Out: an [`Error`] that
//! states how to correct it. Invariant: the stages of the compiler report a wrong program as [`Diagnostics`], which
//! becomes an [`Error`] together with the text.

use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::door::Advice;
use crate::memory::{self, bytes_text, count_text};
use crate::source::Source;
use std::fmt::{self, Debug, Formatter};
use std::path::{Path, PathBuf};

/// An error of a program, of data or of a question. It prints for users, also with `{:?}`: a program that ends in an
/// error shows the diagnostics.
#[derive(thiserror::Error)]
pub enum Error {
    /// A wrong program or question, with its text.
    #[error("{}", page(wrong, text))]
    Program {
        /// The text.
        text: Box<Source>,
        /// Its diagnostics.
        wrong: Diagnostics,
    },
    /// A lookup of something that an answer does not have.
    #[error("`{question}`: {message}")]
    Lookup {
        /// The question.
        question: String,
        /// The name, and the existing ones.
        message: String,
    },
    /// A file that cannot be read or written.
    #[error("`{}`: {source}", path.display())]
    File {
        /// The path.
        path: PathBuf,
        /// The reason.
        source: std::io::Error,
    },
    /// An input that is missing or invalid.
    #[error("input `{name}`: {message}")]
    Input {
        /// The input.
        name: String,
        /// The value that was found, and the expected one.
        message: String,
    },
    /// Evidence that a variable of a network cannot have; the variable by its number, before its name is known.
    #[error("variable {variable}: {message}")]
    Evidence {
        /// Its number, from 0.
        variable: usize,
        /// The value that was found, and the expected one.
        message: String,
    },
    /// An invalid number in a form.
    #[error("`{form}`{}: {message}", in_context(context))]
    Number {
        /// The factor and its form, `P(Y | X) = bernoulli(X / 2)`.
        form: String,
        /// The values of the right-hand variables, `X = 3`; empty if there are none.
        context: String,
        /// The number that was found, and the expected one.
        message: String,
    },
    /// A cell of a table that is not a value of its variable.
    #[error("`{}`, row {row}, column `{column}`: `{value}` is {message}", path.display())]
    Cell {
        /// The file.
        path: PathBuf,
        /// The row in it.
        row: usize,
        /// The name of the column.
        column: String,
        /// Its text.
        value: String,
        /// The expected value.
        message: String,
    },
    /// A case that has no answer.
    #[error("`{}`, row {row}: {error}", path.display())]
    Row {
        /// The file.
        path: PathBuf,
        /// The row in it.
        row: usize,
        /// The reason.
        error: Box<Error>,
    },
    /// Evidence of probability zero.
    #[error("{0}")]
    Impossible(Impossible),
    /// Evidence that no draw met, although no factor excludes it.
    #[error("none of {draws} draws met the evidence of `{question}`: it is rare or impossible; {help}")]
    Unmet {
        /// The question.
        question: String,
        /// The number of draws.
        draws: usize,
        /// The suggested remedy.
        help: String,
    },
    /// Evidence of probability zero, and where it was first detected.
    #[error("the evidence has probability zero: {names} cannot have these values, given the rest")]
    Contradiction {
        /// The observed variables in that table, by number.
        variables: Vec<usize>,
        /// The same, by name.
        names: String,
    },
    /// A question that no exact route answers.
    #[error("`{question}` has no exact answer here: {reason}")]
    Unplanned {
        /// The question.
        question: String,
        /// The reason.
        reason: String,
    },
    /// The strategy that the user chose does not answer.
    #[error("`{by}` does not answer `{question}`: {reason}")]
    Refused {
        /// The name of the strategy.
        by: &'static str,
        /// The question.
        question: String,
        /// The reason.
        reason: String,
    },
    /// A model that cannot be written as a network file.
    #[error("`{name}` cannot be written as a network file: {reason}")]
    Unwritable {
        /// The model.
        name: String,
        /// The reason.
        reason: String,
    },
    /// A question to another program that cannot be answered.
    #[error("subroutine `{path}`: {error}")]
    Subroutine {
        /// Program and question.
        path: String,
        /// The reason.
        error: Box<Error>,
    },
    /// An answer that does not fit in memory.
    #[error(
        "`{name}` needs {} cells ({}), but at most {} are allowed{}; {help}",
        apart(*cells, *most)[0], bytes_text(*cells * 8.0), apart(*cells, *most)[1], free_text()
    )]
    TooLarge {
        /// The object that is too large.
        name: String,
        /// Its size.
        cells: f64,
        /// The limit.
        most: f64,
        /// The suggested remedy.
        help: String,
    },
    /// Work that was interrupted before there was an answer.
    #[error("interrupted before there was an answer")]
    Interrupted,
    /// An answer that would take too long.
    #[error(
        "`{question}` takes about {} products, but at most {} are computed; {help}",
        apart(*products, *most)[0], apart(*products, *most)[1]
    )]
    TooLong {
        /// The question.
        question: String,
        /// The number of summed products.
        products: f64,
        /// The limit.
        most: f64,
        /// The suggested remedy.
        help: String,
    },
}

/// Two counts as text, with all digits if fewer would make them equal.
fn apart(one: f64, other: f64) -> [String; 2] {
    let texts = [one, other].map(count_text);
    if texts[0] == texts[1] { [one, other].map(|count| format!("{count:.0}")) } else { texts }
}

/// The free memory, as a remark.
fn free_text() -> String {
    memory::free().map_or_else(String::new, |bytes| format!("; {} of memory are free", bytes_text(bytes)))
}

/// Evidence of probability zero: some factor is exactly 0.
#[derive(Clone, PartialEq, Debug)]
pub struct Impossible {
    /// The question.
    pub question: String,
    /// The reason, if a single observation or factor excludes it.
    pub reason: Option<String>,
}

impl From<String> for Impossible {
    fn from(question: String) -> Self {
        Self { question, reason: None }
    }
}

impl fmt::Display for Impossible {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self { question, reason } = self;
        let reason = reason.as_deref().unwrap_or("the observations exclude each other");
        let what = if question.contains('|') { "the evidence of " } else { "" };
        write!(f, "{what}`{question}` has probability zero: {reason}")
    }
}

/// The rendered diagnostics of a program, without the first word.
fn page(wrong: &Diagnostics, text: &Source) -> String {
    let page = wrong.render(text, false);
    page.strip_prefix("error: ").unwrap_or(&page).trim_end().to_owned()
}

/// As it prints: `unwrap` and a `main` that ends in an error show readable messages.
impl Debug for Error {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{self}")
    }
}

impl Error {
    /// The diagnostics of a program or a question, with its text.
    pub fn program(text: &Source, wrong: impl Into<Diagnostics>) -> Self {
        Error::Program { text: Box::new(text.clone()), wrong: wrong.into() }
    }

    /// The errors of a wrong program, each with its span, labels and optional help, and the text of the spans.
    pub fn diagnostics(&self) -> Option<(&Source, &[Diagnostic])> {
        match self {
            Error::Program { text, wrong } => Some((text, &wrong.0)),
            _ => None,
        }
    }

    /// An invalid input.
    pub fn input(name: impl Into<String>, message: impl Into<String>) -> Self {
        Error::Input { name: name.into(), message: message.into() }
    }

    /// Evidence that none of this many draws met.
    pub(crate) fn unmet(question: String, draws: usize) -> Self {
        let help = format!(
            "make more draws (`{}`), observe with some noise, or take an exact strategy (`{}` lists what each one offers)",
            Advice::Draws,
            Advice::Explain
        );
        Error::Unmet { question, draws, help }
    }

    /// Whether it concerns the evidence of one case only: another case may have an answer.
    pub fn is_of_one_case(&self) -> bool {
        match self {
            Error::Impossible(_)
            | Error::Contradiction { .. }
            | Error::Unmet { .. }
            | Error::Number { .. } => true,
            Error::Row { error, .. } => error.is_of_one_case(),
            _ => false,
        }
    }

    /// A file that cannot be read or written.
    pub fn file(path: &Path, source: std::io::Error) -> Self {
        Error::File { path: path.to_owned(), source }
    }
}

/// The context of a number, as a part of a sentence.
fn in_context(context: &str) -> String {
    if context.is_empty() { String::new() } else { format!(", where {context}") }
}
