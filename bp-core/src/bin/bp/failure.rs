//! Failures of a command.
//!
//! In: diagnostics, errors, or a closed pipe. Out: a message on stderr and an exit status. Invariant: nothing here
//! panics, even if stderr is closed.

use bp_core::compiler::diagnostic::Diagnostics;
use bp_core::compiler::error::Error;
use bp_core::compiler::reference::about;
use bp_core::compiler::source::Source;
use std::io::{ErrorKind, IsTerminal, Write};
use std::process::ExitCode;

/// A failure of a command.
pub(crate) enum Failure {
    /// A wrong program or question, with its source text.
    Wrong(Diagnostics, Source),
    /// Wrong data, or a file that cannot be read or written.
    Data(Error),
    /// A message.
    Words(String),
    /// Already reported.
    Reported,
    /// Stdout cannot be written.
    Output(std::io::Error),
}

impl Failure {
    /// Prints it on stderr.
    pub(crate) fn report(self) -> ExitCode {
        let words = match self {
            Failure::Wrong(wrong, source) => explained(&wrong, &source),
            Failure::Data(Error::Program { text, wrong }) => explained(&wrong, &text),
            Failure::Data(error) => format!("error: {error}\n{}", see(entry(&error))),
            Failure::Words(words) => format!("error: {words}\n"),
            Failure::Reported => String::new(),
            Failure::Output(error) if error.kind() == ErrorKind::BrokenPipe => return ExitCode::SUCCESS,
            Failure::Output(error) => format!("error: stdout cannot be written: {error}\n"),
        };
        // If stderr is closed, the message is lost.
        let _ = std::io::stderr().write_all(words.as_bytes());
        ExitCode::FAILURE
    }
}

/// Diagnostics, with the entries of the reference that explain them.
fn explained(wrong: &Diagnostics, source: &Source) -> String {
    let mut words = wrong.render(source, colour(&std::io::stderr()));
    let mut entries: Vec<String> = Vec::new();
    for entry in wrong.iter().filter_map(|one| about(&one.message)) {
        if !entries.contains(&entry) {
            entries.push(entry);
        }
    }
    words.push_str(&see(entries));
    words
}

/// The entry that explains an invalid number of a form: that of the form.
fn entry(error: &Error) -> Option<String> {
    match error {
        Error::Number { form, .. } => about(&format!("`{}`", form.split_once(" = ")?.1)),
        Error::Row { error, .. } | Error::Subroutine { error, .. } => entry(error),
        _ => None,
    }
}

fn see(entries: impl IntoIterator<Item = String>) -> String {
    entries.into_iter().map(|entry| format!("see: bp reference {entry}\n")).collect()
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

/// Whether a stream supports colours.
pub(crate) fn colour(stream: &impl IsTerminal) -> bool {
    stream.is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}
