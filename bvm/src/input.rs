//! Reading of input files with bounded length.
//!
//! In: a path, and the most bytes to read. Out: the bytes or the text, decompressed if the file is gzip; or the error
//! with its file. Invariant: no more than the bound is read, so that an endless input is refused.

use crate::vision::VisionError;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// The most bytes of a picture, a field of numbers or a table of readings: 256 MiB.
pub(crate) const MOST_BYTES: u64 = bp_core::compiler::files::MOST_BYTES;

/// The most bytes of a calibration, which is a page of text: 1 MiB.
pub(crate) const MOST_OF_CALIBRATION: u64 = 1 << 20;

/// The bytes of a file.
pub(crate) fn bytes(path: &Path, most: u64) -> Result<Vec<u8>, VisionError> {
    let failed = |source| VisionError::Read { path: path.to_path_buf(), source };
    let file = File::open(path).map_err(failed)?;
    let bytes = bp_core::compiler::files::bounded(file.take(most + 1)).map_err(failed)?;
    if bytes.len() as u64 > most {
        return Err(VisionError::TooLong { path: path.to_path_buf(), most_mib: most >> 20 });
    }
    Ok(bytes)
}

/// The text of a file.
pub(crate) fn text(path: &Path, most: u64) -> Result<String, VisionError> {
    String::from_utf8(bytes(path, most)?).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        VisionError::NoText { path: path.to_path_buf(), at }
    })
}
