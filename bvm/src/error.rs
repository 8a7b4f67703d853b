//! What can be wrong with the data that the map is given, and with where its report goes.
//!
//! In: the errors of each part. Out: one error, which names the file, the key or the value. Invariant: wrong data
//! never panic, and leave nothing half-written.

use std::path::PathBuf;

/// What can be wrong.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A grid that cannot be.
    #[error(transparent)]
    Grid(#[from] crate::grid::GridError),
    /// Images and calibrations.
    #[error(transparent)]
    Vision(#[from] crate::vision::VisionError),
    /// Pictures.
    #[error(transparent)]
    Report(#[from] crate::report::ReportError),
    /// Questions to the programs.
    #[error(transparent)]
    Program(#[from] bp_core::error::Error),
    /// A space that cannot be.
    #[error(transparent)]
    Space(#[from] bp_core::space::SpaceError),
    /// A folder that cannot be written.
    #[error("cannot write into the folder `{}`: {source}", path.display())]
    Folder {
        /// Which.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}
