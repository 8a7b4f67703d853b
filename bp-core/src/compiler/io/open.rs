//! Opens files with programs and networks.
//!
//! In: a path (`-` is standard input). Out: the text, or a network with its text. Invariant: errors come with their
//! source text; each correction is reported in one line.

use super::{Format, Network, read};
use crate::error::Error;
use crate::files;
use crate::source::Source;
use std::io::{Error as Wrong, ErrorKind, stdin};
use std::path::Path;

/// A network, its text, and the corrections, one line each.
#[derive(Clone, PartialEq, Debug)]
pub struct Opened {
    /// The network.
    pub network: Network,
    /// The text.
    pub source: Source,
    /// The corrections: `alarm.bif:12:3: warning: …`.
    pub warnings: Vec<String>,
}

/// Opens a program, or a network of any format, by the end of its name.
///
/// # Errors
/// A file that cannot be read, or is of another tool; every mistake in it.
pub fn open(path: &Path) -> Result<Opened, Error> {
    open_as(path, format_of(path)?)
}

/// Opens a network of this format.
///
/// # Errors
/// As [`open`].
pub fn open_as(path: &Path, format: Format) -> Result<Opened, Error> {
    let mut warnings = Vec::new();
    let source = match format {
        Format::Program => text(path)?,
        _ => text_of_any(path, &mut warnings)?,
    };
    let network = read(&source, format).map_err(|wrong| Error::program(&source, wrong))?;
    warnings.extend(network.warnings.iter().map(|warning| warning.line(&source)));
    Ok(Opened { network, source, warnings })
}

/// The format of a file by its name: a program if the extension is unknown.
///
/// # Errors
/// The format of the tool is not supported.
pub fn format_of(path: &Path) -> Result<Format, Error> {
    match Format::refused(path) {
        Some(reason) => Err(wrong(path, format!("it {reason}"))),
        None => Ok(Format::of(path).unwrap_or(Format::Program)),
    }
}

/// Reads a text.
///
/// # Errors
/// A file that cannot be read, or is not UTF-8.
pub fn text(path: &Path) -> Result<Source, Error> {
    let (name, bytes) = bytes(path)?;
    let text = String::from_utf8(bytes).map_err(|error| {
        let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = valid.iter().filter(|byte| **byte == b'\n').count() + 1;
        wrong(path, format!("line {line} is not UTF-8 text"))
    })?;
    Ok(Source::new(name, text))
}

/// Reads a text that need not be UTF-8: older tools write Latin-1.
fn text_of_any(path: &Path, warnings: &mut Vec<String>) -> Result<Source, Error> {
    let (name, bytes) = bytes(path)?;
    let text = String::from_utf8(bytes).unwrap_or_else(|error| {
        warnings.push(format!("{name}: warning: not UTF-8; read as Latin-1"));
        error.as_bytes().iter().copied().map(char::from).collect()
    });
    Ok(Source::new(name, text))
}

/// The name of a file for messages, and its content.
fn bytes(path: &Path) -> Result<(String, Vec<u8>), Error> {
    let fail = |source| Error::file(path, source);
    let (name, bytes) = match path.as_os_str() == "-" {
        false => (path.display().to_string(), files::read(path).map_err(fail)?),
        true => ("stdin".to_owned(), files::bounded(stdin().lock()).map_err(fail)?),
    };
    match files::is_utf16(&bytes) {
        false => Ok((name, bytes)),
        true => Err(wrong(path, "UTF-16 text; save it as UTF-8".to_owned())),
    }
}

fn wrong(path: &Path, message: String) -> Error {
    Error::file(path, Wrong::new(ErrorKind::InvalidData, message))
}
