//! What ends a command, and how it is told.
//!
//! In: diagnostics, errors, or a pipe that was closed. Out: words on stderr and an exit code. Invariant: nothing here
//! panics, not even where stderr is closed too.

use bp_core::diagnostic::Diagnostics;
use bp_core::error::Error;
use bp_core::source::Source;
use std::io::{ErrorKind, IsTerminal, Write};
use std::process::ExitCode;

/// What ends a command.
pub(crate) enum Failure {
    /// A wrong program or question, and the text that it is wrong in.
    Wrong(Diagnostics, Source),
    /// Wrong data, or a file that cannot be read or written.
    Data(Error),
    /// What is wrong, in words.
    Words(String),
    /// Told already.
    Told,
    /// Stdout cannot be written.
    Output(std::io::Error),
}

impl Failure {
    /// Tells it on stderr.
    pub(crate) fn tell(self) -> ExitCode {
        let words = match self {
            Failure::Wrong(wrong, source) => wrong.render(&source, colour(&std::io::stderr())),
            Failure::Data(Error::Program { text, wrong }) => wrong.render(&text, colour(&std::io::stderr())),
            Failure::Data(error) => format!("error: {error}\n"),
            Failure::Words(words) => format!("error: {words}\n"),
            Failure::Told => String::new(),
            Failure::Output(error) if error.kind() == ErrorKind::BrokenPipe => return ExitCode::SUCCESS,
            Failure::Output(error) => format!("error: stdout cannot be written: {error}\n"),
        };
        // Where stderr is closed there is nobody to be told.
        let _ = std::io::stderr().write_all(words.as_bytes());
        ExitCode::FAILURE
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Failure::Data(error)
    }
}

impl From<std::io::Error> for Failure {
    fn from(error: std::io::Error) -> Self {
        Failure::Output(error)
    }
}

/// Whether a stream shows colours.
pub(crate) fn colour(stream: &impl IsTerminal) -> bool {
    stream.is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}
