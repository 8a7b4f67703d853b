//! `bp fmt`: a program as this language prints it.
//!
//! In: files. Out: the same files, or, for stdin, the text on stdout. Invariant: a file is replaced whole or not at all,
//! and never where it does not parse.

use crate::failure::Failure;
use crate::program::{self, is_stdin};
use bp_core::error::Error;
use bp_core::syntax::parse;
use std::fs::Permissions;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Formats programs in place.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  bp fmt wet_grass.bp
  bp fmt --check models/*.bp
  bp fmt - < wet_grass.bp")]
pub(crate) struct Arguments {
    /// Programs; `-` reads stdin and writes stdout.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Only tell which files would change; exit code 1 if any would.
    #[arg(long)]
    check: bool,
}

pub(crate) fn run(arguments: &Arguments, out: &mut impl Write) -> Result<(), Failure> {
    let mut right = true;
    for path in &arguments.files {
        match one(path, arguments.check, out) {
            Ok(formatted) => right &= formatted,
            Err(Failure::Output(error)) => return Err(Failure::Output(error)),
            Err(failure) => {
                out.flush()?;
                failure.tell();
                right = false;
            }
        }
    }
    if right { Ok(()) } else { Err(Failure::Told) }
}

/// Whether the text is, or now is, as it should be.
fn one(path: &Path, check: bool, out: &mut impl Write) -> Result<bool, Failure> {
    let source = program::read(path)?;
    let formatted = match parse(&source) {
        Ok(file) => file.to_string(),
        Err(wrong) => return Err(Failure::Wrong(wrong, source)),
    };
    let changes = formatted != source.text;
    if check && changes {
        writeln!(out, "{} would change", source.name)?;
    } else if !check && is_stdin(path) {
        out.write_all(formatted.as_bytes())?;
    } else if changes {
        replace(path, &formatted).map_err(|error| Error::file(path, error))?;
        writeln!(out, "{} formatted", source.name)?;
    }
    Ok(!(check && changes))
}

/// Replaces a file by a text, whole or not at all. What a link points to is replaced, not the link.
fn replace(path: &Path, text: &str) -> std::io::Result<()> {
    let path = path.canonicalize()?;
    let permissions = std::fs::metadata(&path)?.permissions();
    // Renaming would get round the write protection of the file.
    if permissions.readonly() {
        return Err(std::io::Error::new(std::io::ErrorKind::PermissionDenied, "the file is read-only"));
    }
    write_beside(&path, text, Some(permissions))
}

/// Writes a text to a file that may not be there yet, whole or not at all.
pub(crate) fn write_whole(path: &Path, text: &str) -> std::io::Result<()> {
    match path.exists() {
        true => replace(path, text),
        false => write_beside(path, text, None),
    }
}

/// Writes a text beside a file, then gives it the file's name.
fn write_beside(path: &Path, text: &str, permissions: Option<Permissions>) -> std::io::Result<()> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let beside = path.with_file_name(format!(".{name}.{}.new", std::process::id()));
    let written = std::fs::File::create_new(&beside).and_then(|mut file| {
        file.write_all(text.as_bytes())?;
        permissions.map_or(Ok(()), |permissions| file.set_permissions(permissions))?;
        file.sync_all()?;
        std::fs::rename(&beside, path)
    });
    if written.is_err() {
        // The first error is the one to tell.
        let _ = std::fs::remove_file(&beside);
    }
    written
}
