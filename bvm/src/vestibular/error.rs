//! Errors of balance: recordings of inertial sensors.
//!
//! In: nothing. Out: [`BalanceError`], which names the file, the row and the column. Invariant: wrong data never panic.

use std::path::PathBuf;

/// An error in a recording of an inertial sensor.
#[derive(Debug, thiserror::Error)]
pub enum BalanceError {
    /// A file that cannot be opened or read.
    #[error("cannot read `{}`: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// A file that cannot be written; nothing of it is left behind.
    #[error("cannot write `{}`: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// A file whose content cannot be used.
    #[error("`{}`: {reason}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What was found and what was expected.
        reason: String,
    },
    /// An option that does not fit.
    #[error("{0}")]
    Option(String),
}
