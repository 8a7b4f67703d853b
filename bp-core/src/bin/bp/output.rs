//! Where a page goes, and what it is about.
//!
//! In: a finished page. Out: a file, or stdout. Invariant: a file is written whole or not at all, since the page is
//! finished before; nothing is written where the question is wrong.

use crate::failure::Failure;
use crate::program;
use bp_core::error::Error;
use bp_core::io::Network;
use bp_core::model::Question;
use std::io::Write;
use std::path::Path;

/// Writes a page to a file, or to stdout.
pub(crate) fn write(path: Option<&Path>, page: &[u8], out: &mut impl Write) -> Result<(), Failure> {
    let Some(path) = path else { return Ok(out.write_all(page)?) };
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let beside = folder.join(format!(".{name}.{}.new", std::process::id()));
    let written = std::fs::write(&beside, page).and_then(|()| std::fs::rename(&beside, path));
    if written.is_err() {
        // The first error is the one to tell.
        let _ = std::fs::remove_file(&beside);
    }
    written.map_err(|error| Error::file(path, error).into())
}

/// The question that was typed, or else those that the program declares; a picture needs none.
pub(crate) fn questions_of(network: &Network, typed: Option<&str>) -> Result<Vec<Question>, Failure> {
    match typed {
        None if network.model.questions.is_empty() => Ok(Vec::new()),
        typed => program::questions(network, typed),
    }
}
