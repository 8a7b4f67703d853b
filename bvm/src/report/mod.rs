//! The pictures of a run.
//!
//! In: numbers (entropies over time, values per direction, occupancies per cell) in the grid's storage order.
//! Out: a [`Picture`], which can be placed next to another and written as PNG. No code here computes a
//! probability. Invariant: a file appears whole or not at all, and every error names the file or the
//! quantity.

mod bands;
mod bars;
mod cameras;
mod colour;
mod curves;
mod frame;
mod heat;
mod lines;
mod panorama;
mod picture;
mod reduction;
#[cfg(test)]
mod tests;
mod text;
mod top_view;

pub use bands::{Band, bands};
pub use bars::{Bars, bars};
pub use cameras::cameras;
pub use colour::ColourMap;
pub use curves::{Series, entropy_curves};
pub use heat::{Heat, heat};
pub use lines::{Line, lines};
pub use panorama::{Panorama, Window, panorama};
pub use picture::{Picture, write_atomically};
pub use reduction::{first_occupied_range, mean, slice_around_horizon, strongest};
pub use top_view::{TopView, top_view};

use std::path::PathBuf;
use thiserror::Error;

/// An error of the report.
#[derive(Debug, Error)]
pub enum ReportError {
    /// The file could not be written; nothing of it is left behind.
    #[error("cannot write `{}`: {source}", path.display())]
    Write {
        /// The file that was to be written.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// The number of values of a quantity does not match the grid or another quantity.
    #[error("`{what}` has {found} values, expected {expected}")]
    Length {
        /// The quantity.
        what: String,
        /// The expected number of values.
        expected: usize,
        /// The number found.
        found: usize,
    },
    /// A quantity cannot be drawn: nothing in it is finite, or it starts at zero and cannot be normalised.
    #[error("`{what}` cannot be drawn: {why}")]
    Values {
        /// The quantity.
        what: String,
        /// The reason.
        why: &'static str,
    },
}

/// Refuses a quantity whose number of values is not `expected`.
fn expect_length(what: &str, found: usize, expected: usize) -> Result<(), ReportError> {
    if found == expected {
        return Ok(());
    }
    Err(ReportError::Length { what: what.to_string(), expected, found })
}
