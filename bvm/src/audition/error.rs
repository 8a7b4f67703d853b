//! Errors of hearing: sounds, heads, calibrations.
//!
//! In: nothing. Out: [`AuditionError`], which names the file and the reason. Invariant: wrong data never panic.

use std::path::PathBuf;

/// An error in a sound, a set of impulse responses, or a calibration.
#[derive(Debug, thiserror::Error)]
pub enum AuditionError {
    /// A file that cannot be opened or read.
    #[error("cannot read `{}`: {source}", path.display())]
    Read {
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
    /// An input file that is too long, or cannot be read.
    #[error(transparent)]
    Input(Box<crate::vision::VisionError>),
    /// A head whose data contradict their description.
    #[error("{0}")]
    Head(String),
}
