//! The subcommands of `bvm`, one file each.
//!
//! In: parsed arguments. Out: printed lines and files. Invariant: invalid input is refused before long computations
//! begin.

pub(crate) mod balance;
pub(crate) mod calibrate;
pub(crate) mod experiment;
pub(crate) mod explore;
pub(crate) mod listen;
pub(crate) mod look;
pub(crate) mod replay;
pub(crate) mod synth;

use bvm::error::Error;
use std::io::Write;
use std::path::Path;

/// Prints a line; a closed pipe is not an error.
fn print(line: &str) {
    let _ = writeln!(std::io::stdout().lock(), "{line}");
}

/// Checks that a folder can be written into, before the computation begins.
fn check_folder(folder: &Path) -> Result<(), Error> {
    let cannot = |source| Error::Folder { path: folder.to_owned(), source };
    let existed = folder.exists();
    std::fs::create_dir_all(folder).map_err(cannot)?;
    bp_core::compiler::files::check_folder(folder).map_err(cannot)?;
    // A run that is refused later must not leave an empty folder behind.
    if existed { Ok(()) } else { std::fs::remove_dir(folder).map_err(cannot) }
}
