//! Tables of data on the command line: `--data`, `--cases`, `--separator`.
//!
//! In: a path, and optionally the separator. Out: a table. Invariant: decisions of the reader are reported on stderr.

use crate::failure::Failure;
use crate::program::warn;
use bp_core::compiler::data::{self, Records};
use std::path::Path;

/// The separator option.
#[derive(clap::Args)]
pub(crate) struct Separator {
    /// Column separator: `comma`, `semicolon`, `tab`, or any single character;
    /// by default detected from the first rows.
    #[arg(long, value_name = "SEPARATOR", value_parser = separator)]
    separator: Option<u8>,
}

fn separator(text: &str) -> Result<u8, String> {
    match text.as_bytes() {
        b"comma" => Ok(b','),
        b"semicolon" => Ok(b';'),
        b"tab" | b"\\t" => Ok(b'\t'),
        [one] if one.is_ascii() && !one.is_ascii_alphanumeric() && !b"\"\n\r".contains(one) => Ok(*one),
        _ => Err("expected `comma`, `semicolon`, `tab`, or one character such as `|`".to_owned()),
    }
}

/// Reads a table.
pub(crate) fn open(path: &Path, separator: &Separator) -> Result<Records, Failure> {
    let table = data::open(path, separator.separator)?;
    for note in &table.notes {
        warn(&format!("{}: note: {note}", path.display()));
    }
    Ok(table)
}
