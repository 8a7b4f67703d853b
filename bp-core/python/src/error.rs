//! Errors as Python exceptions.
//!
//! In: an [`Error`] of `bp_core` or `bvm`. Out: an exception of `bayesian_programs.errors`. Invariant: its text is the
//! text that the command `bp` prints; the place is also there as attributes.

use bp_core::compiler::diagnostic::Diagnostic;
use bp_core::compiler::source::{Source, Span};
use bp_core::prelude::Error;
use pyo3::exceptions::{PyKeyboardInterrupt, PyOSError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::io::ErrorKind;

/// The exception of an error.
pub(crate) fn raised(error: Error) -> PyErr {
    Python::attach(|py| exception(py, &error).unwrap_or_else(|failed| failed))
}

/// The exception of an error of the map.
pub(crate) fn raised_by_map(error: impl Into<bvm::error::Error>) -> PyErr {
    match error.into() {
        bvm::error::Error::Program(error) => raised(error),
        error => Python::attach(|py| of_class(py, "InputError", &error.to_string(), &PyDict::new(py)))
            .unwrap_or_else(|failed| failed),
    }
}

/// An exception about an argument, in the words of this package.
pub(crate) fn wrong(message: impl AsRef<str>) -> PyErr {
    Python::attach(|py| of_class(py, "InputError", message.as_ref(), &PyDict::new(py)))
        .unwrap_or_else(|failed| failed)
}

/// The exception of an error, as a value: for a row without an answer.
fn exception(py: Python<'_>, error: &Error) -> PyResult<PyErr> {
    let about = PyDict::new(py);
    let class = match error {
        Error::Interrupted => return Ok(PyKeyboardInterrupt::new_err(error.to_string())),
        Error::Program { text, wrong } => {
            let all: Vec<_> = wrong.iter().map(|one| diagnostic(py, text, one)).collect::<PyResult<_>>()?;
            about.set_item("diagnostics", all)?;
            about.set_item("text", &text.text)?;
            "ProgramError"
        }
        Error::File { path, source } => match source.kind() {
            ErrorKind::NotFound | ErrorKind::PermissionDenied | ErrorKind::IsADirectory => {
                let number = source.raw_os_error().unwrap_or(2);
                // Python chooses `FileNotFoundError` and the like by the number.
                return Ok(PyOSError::new_err((number, source.to_string(), path.clone())));
            }
            _ => {
                about.set_item("path", path)?;
                "DataError"
            }
        },
        Error::Cell { path, row, column, value, .. } => {
            about.set_item("path", path)?;
            about.set_item("row", row)?;
            about.set_item("column", column)?;
            about.set_item("value", value)?;
            "DataError"
        }
        Error::Row { path, row, .. } => {
            about.set_item("path", path)?;
            about.set_item("row", row)?;
            if error.is_of_one_case() { "ImpossibleEvidence" } else { "DataError" }
        }
        Error::Input { name, .. } => {
            about.set_item("name", name)?;
            "InputError"
        }
        Error::Lookup { .. } => "AnswerError",
        Error::Impossible(_) | Error::Contradiction { .. } | Error::Unmet { .. } => "ImpossibleEvidence",
        Error::Unplanned { .. } | Error::Refused { .. } | Error::TooLarge { .. } | Error::TooLong { .. } => {
            "NoAnswer"
        }
        _ => "Error",
    };
    of_class(py, class, &error.to_string(), &about)
}

fn of_class(py: Python<'_>, class: &str, message: &str, about: &Bound<'_, PyDict>) -> PyResult<PyErr> {
    let class = py.import("bayesian_programs.errors")?.getattr(class)?;
    Ok(PyErr::from_value(class.call((message,), Some(about))?))
}

/// A diagnostic: its message and help, and lines and columns from 1, of its span and of its labels.
fn diagnostic<'py>(py: Python<'py>, text: &Source, one: &Diagnostic) -> PyResult<Bound<'py, PyDict>> {
    let found = PyDict::new(py);
    let place = |span: Span| (text.line_and_column(span.start), text.line_and_column(span.end));
    let ((line, column), (end_line, end_column)) = place(one.span);
    found.set_item("message", &one.message)?;
    found.set_item("help", &one.help)?;
    found.set_item("line", line)?;
    found.set_item("column", column)?;
    found.set_item("end_line", end_line)?;
    found.set_item("end_column", end_column)?;
    let label = |(span, remark): &(Span, String)| (place(*span).0, place(*span).1, remark.clone());
    found.set_item("labels", one.labels.iter().map(label).collect::<Vec<_>>())?;
    Ok(found)
}
