//! The subcommands of `bvm`, one file each.
//!
//! In: parsed arguments. Out: what the command prints and writes. Invariant: what can be refused is refused before
//! anything long is begun.

pub(crate) mod calibrate;
pub(crate) mod explore;
pub(crate) mod look;
pub(crate) mod replay;

use bvm::error::Error;
use std::io::Write;
use std::path::Path;

/// Prints a line; a reader that has gone away is no error.
fn print(line: &str) {
    let _ = writeln!(std::io::stdout().lock(), "{line}");
}

/// Makes sure, before the work begins, that a folder can be written into.
fn check_folder(folder: &Path) -> Result<(), Error> {
    let cannot = |source| Error::Folder { path: folder.to_owned(), source };
    let existed = folder.exists();
    std::fs::create_dir_all(folder).map_err(cannot)?;
    bp_core::files::check_folder(folder).map_err(cannot)?;
    // What is refused later must not leave an empty folder behind.
    if existed { Ok(()) } else { std::fs::remove_dir(folder).map_err(cannot) }
}
