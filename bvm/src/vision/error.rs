//! Errors of the vision data: files, images, calibrations, pairs.
//!
//! In: nothing. Out: [`VisionError`], one variant per error, which names the file, key, size or value, and what was
//! expected. Invariant: wrong data never panic.

use std::path::PathBuf;

/// An error in the vision data.
#[derive(Debug, thiserror::Error)]
pub enum VisionError {
    /// A file that cannot be opened or read.
    #[error("cannot read `{path}`: {source}")]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// A file that is too long, or has no end.
    #[error("`{path}` is longer than {most_mib} MiB, or has no end: is it the right file?")]
    TooLong {
        /// The file.
        path: PathBuf,
        /// The limit for such a file, MiB.
        most_mib: u64,
    },
    /// A file that is not UTF-8 text.
    #[error("`{path}` is not a text: byte {at} is not UTF-8")]
    NoText {
        /// The file.
        path: PathBuf,
        /// Offset of the first byte that is not text, from 0.
        at: usize,
    },
    /// A file that cannot be written.
    #[error("cannot write `{path}`: {source}")]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// A file whose content cannot be used.
    #[error("`{path}`: {reason}")]
    File {
        /// The file.
        path: PathBuf,
        /// The value that was found and the expected one.
        reason: String,
    },
    /// Pixels that do not make an image: a size of zero, a wrong count, a value outside 0..=255.
    #[error("not an image: {reason}")]
    Pixels {
        /// The value that was found and the expected one.
        reason: String,
    },
    /// A calibration file that is not TOML.
    #[error("`{path}`: the calibration is not valid TOML: {reason}")]
    CalibrationSyntax {
        /// The file.
        path: PathBuf,
        /// The line and the error.
        reason: String,
    },
    /// A calibration key that is missing, unknown or has an impossible value.
    #[error("`{path}`: calibration key `{key}`: {reason}")]
    CalibrationKey {
        /// The file.
        path: PathBuf,
        /// The key at fault.
        key: String,
        /// The value that was found and the expected one.
        reason: String,
    },
    /// The two images of a pair have different sizes.
    #[error(
        "the two images of a pair must have one size: the left is {}x{}, the right is {}x{}",
        left.0, left.1, right.0, right.1
    )]
    PairSizes {
        /// Width and height of the left image, pixels.
        left: (usize, usize),
        /// Width and height of the right image, pixels.
        right: (usize, usize),
    },
    /// A number of disparities that is too large for the width of the images.
    #[error(
        "{value} disparities cannot be searched in images {width} pixels wide: expected at least 1, and fewer than the width"
    )]
    MaxDisparity {
        /// The value asked for, pixels.
        value: usize,
        /// Width of the images, pixels.
        width: usize,
    },
    /// A pair whose search would not fit in memory.
    #[error(
        "searching {levels} disparities in {width}x{height} pixels needs more than {limit} costs; use smaller images"
    )]
    TooLarge {
        /// Width, pixels.
        width: usize,
        /// Height, pixels.
        height: usize,
        /// Number of disparities.
        levels: usize,
        /// Limit of the number of costs.
        limit: usize,
    },
    /// A grid of directions that does not fit the sphere.
    #[error(
        "directions: {axis} has {cells} cells of {step_rad} rad; expected positive steps that cover at most {} rad",
        full_rad
    )]
    Directions {
        /// `azimuth` or `elevation`.
        axis: &'static str,
        /// Number of cells.
        cells: usize,
        /// Width of a cell, radians.
        step_rad: f64,
        /// The whole axis, radians.
        full_rad: f64,
    },
}
