//! The output of a page.
//!
//! In: a finished page. Out: a file, or stdout. Invariant: a file is written completely or not at all, since the page
//! is finished before; nothing is written if the question is wrong.

use crate::failure::Failure;
use bp_core::compiler::error::Error;
use bp_core::compiler::files;
use std::io::Write;
use std::path::Path;

/// Writes a page to a file, or to stdout.
pub(crate) fn write(path: Option<&Path>, page: &[u8], out: &mut impl Write) -> Result<(), Failure> {
    match path.filter(|path| !is_stdout(path)) {
        // The same stream as all other output, in order.
        None => Ok(out.write_all(page)?),
        Some(path) => files::write(path, page).map_err(|error| Error::file(path, error).into()),
    }
}

/// Whether a path means stdout.
pub(crate) fn is_stdout(path: &Path) -> bool {
    ["-", "/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"].iter().any(|stdout| path == Path::new(stdout))
}
