//! What was mended while a file was read.
//!
//! In: a span and words. Out: one line for stderr. Invariant: a warning says what was done; the model that comes with it
//! can be used.

use crate::source::{Source, Span};

/// Something in a file that was not as it should be, and what was made of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// Where.
    pub span: Span,
    /// What was found and what was done.
    pub message: String,
}

impl Warning {
    /// A warning at a place.
    pub fn new(span: Span, message: impl Into<String>) -> Self {
        Self { span, message: message.into() }
    }

    /// The warning as one line: `alarm.bif:12:3: warning: …`.
    pub fn line(&self, source: &Source) -> String {
        let (line, column) = source.line_and_column(self.span.start);
        format!("{}:{line}:{column}: warning: {}", source.name, self.message)
    }
}
