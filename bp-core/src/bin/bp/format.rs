//! `bp fmt`: formats programs.
//!
//! In: files. Out: the same files, or, for stdin, the text on stdout. Invariant: a file is replaced completely or not
//! at all, and never if it does not parse.

use crate::failure::Failure;
use crate::program::{self, is_stdin};
use bp_core::compiler::error::Error;
use bp_core::compiler::files;
use bp_core::compiler::syntax::parse;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Format programs in place.
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
    /// Only list the files that would change; exit status 1 if there are any.
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
                failure.report();
                right = false;
            }
        }
    }
    if right { Ok(()) } else { Err(Failure::Reported) }
}

/// Whether the text is, or now is, formatted.
fn one(path: &Path, check: bool, out: &mut impl Write) -> Result<bool, Failure> {
    let source = program::read(path)?;
    let formatted = match parse(&source) {
        Ok(file) => file.to_string(),
        Err(wrong) => return Err(Failure::Wrong(wrong, source)),
    };
    let changes = formatted != source.text;
    if check && changes {
        writeln!(out, "{} would change", source.name)?;
    } else if !check && (is_stdin(path) || files::is_stream(path)) {
        out.write_all(formatted.as_bytes())?;
    } else if changes {
        files::write(path, formatted.as_bytes()).map_err(|error| Error::file(path, error))?;
        writeln!(out, "{} formatted", source.name)?;
    }
    Ok(!(check && changes))
}
