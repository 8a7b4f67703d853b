//! Warnings about corrections made while a file was read.
//!
//! In: a span and a message. Out: one line for stderr. Invariant: a warning describes the correction; the model is
//! usable.

use crate::source::{Source, Span};

/// A correction of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// The span.
    pub span: Span,
    /// The problem and the correction.
    pub message: String,
}

impl Warning {
    /// A warning at a span.
    pub fn new(span: Span, message: impl Into<String>) -> Self {
        Self { span, message: message.into() }
    }

    /// The warning as one line: `alarm.bif:12:3: warning: …`.
    pub fn line(&self, source: &Source) -> String {
        let (line, column) = source.line_and_column(self.span.start);
        format!("{}:{line}:{column}: warning: {}", source.name, self.message)
    }
}
