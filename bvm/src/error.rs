//! Errors of the data and of the output.
//!
//! In: the errors of each part. Out: one error, which names the file, the key or the value. Invariant: wrong data
//! never panic, and leave nothing half-written.

use std::path::PathBuf;

/// An error of `bvm`.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// An invalid grid.
    #[error(transparent)]
    Grid(#[from] crate::grid::GridError),
    /// Images and calibrations.
    #[error(transparent)]
    Vision(#[from] crate::vision::VisionError),
    /// Sounds, heads and their calibrations.
    #[error(transparent)]
    Audition(#[from] crate::audition::AuditionError),
    /// Recordings of inertial sensors.
    #[error(transparent)]
    Balance(#[from] crate::vestibular::BalanceError),
    /// Pictures.
    #[error(transparent)]
    Report(#[from] crate::report::ReportError),
    /// A scene that does not exist.
    #[error("{0}")]
    Scene(String),
    /// A mistake in a scene file.
    #[error(transparent)]
    SceneFile(#[from] crate::world::scene::SceneError),
    /// A run that cannot be resumed.
    #[error("cannot resume from `{}`: {reason}", path.display())]
    Checkpoint {
        /// The file.
        path: PathBuf,
        /// The reason.
        reason: String,
    },
    /// Questions to the programs.
    #[error(transparent)]
    Program(#[from] bp_core::compiler::error::Error),
    /// An invalid space.
    #[error(transparent)]
    Space(#[from] bp_core::compiler::space::SpaceError),
    /// A folder that cannot be written.
    #[error("cannot write into the folder `{}`: {source}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// The reason.
        source: std::io::Error,
    },
}
