//! Balance: an inertial sensor's orientation, and the motion that a person would feel.
//!
//! In: motions whose truth is known by hand, the recordings and the cases of `shared`, where they are there. Out: estimates,
//! compared with the truth, with the programs by the compiler's own filters, and with published figures.

mod cases;
mod programs;
mod published;
mod recordings;
mod three_dimensions;
mod two_modes;

use bvm::vestibular::reader::{Format, Reader};
use bvm::vestibular::{Fault, Instant, Settings, Stream, Verdict};
use std::path::{Path, PathBuf};

/// A folder of `shared`, next to the repository, or in the folder named by `BP_SHARED`.
pub(crate) fn shared(folder: &str) -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).map(|up| up.join("shared"));
    let path = std::env::var_os("BP_SHARED").map(PathBuf::from).or_else(beside)?.join(folder);
    if path.is_dir() {
        return Some(path);
    }
    println!("skipped: no folder {}", path.display());
    None
}

/// The estimates of a text.
pub(crate) fn estimates(text: &str, format: Format) -> Result<(Vec<Instant>, Verdict), String> {
    let reader = Reader::new(Path::new("imu.csv"), text.as_bytes(), format);
    let mut reader = reader.map_err(|error| error.to_string())?;
    let mut stream = Stream::new(Settings::default());
    let mut instants = Vec::new();
    while let Some(row) = reader.next_row().map_err(|error| error.to_string())? {
        instants.extend(stream.feel(row).map_err(|fault| match fault {
            Fault::Clock(reason) => reason,
            Fault::Program(error) => error.to_string(),
        })?);
    }
    instants.extend(stream.finish().unwrap());
    Ok((instants, stream.verdict(reader.units().stated)))
}
