//! `bp convert`: converts a network to another format.
//!
//! In: an input and an output file. Out: the output file, and warnings on stderr about corrections and losses.
//! Invariant: a file is written completely or not at all.

use crate::failure::Failure;
use crate::{output, program};
use bp_core::compiler::diagnostic::Diagnostics;
use bp_core::compiler::io::{self, Format};
use bp_core::compiler::syntax::parse;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Convert a network to another format.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  bp convert alarm.bif alarm.bp
  bp convert wet_grass.bp wet_grass.net
  bp convert grid.uai - --to bif

Formats, by the end of the name: bp, bif, xmlbif (xml, bifxml, xbif), uai, net
(hugin). Each is also read compressed, as `alarm.bif.gz`.
UAI has no names: variables and values become their indices.")]
pub(crate) struct Arguments {
    /// A network or a program; `-` is stdin.
    #[arg(value_name = "IN")]
    from_file: PathBuf,
    /// The file to write; `-` is stdout.
    #[arg(value_name = "OUT")]
    to_file: PathBuf,
    /// Format of IN; by default from the file name.
    #[arg(long, value_name = "FORMAT", value_parser = named)]
    from: Option<Format>,
    /// Format of OUT; by default from the file name.
    #[arg(long, value_name = "FORMAT", value_parser = named)]
    to: Option<Format>,
}

fn named(name: &str) -> Result<Format, String> {
    Format::named(name).ok_or_else(|| format!("the formats are {}", names()))
}

fn names() -> String {
    Format::ALL.map(|format| format!("`{}`", format.endings()[0])).join(", ")
}

fn format(path: &Path, given: Option<Format>, option: &str) -> Result<Format, Failure> {
    if given.is_none() {
        program::format_of(path)?;
    }
    given.or_else(|| Format::of(path)).ok_or_else(|| {
        let message = format!(
            "the name `{}` does not determine its format; give `{option}` and one of",
            path.display()
        );
        Failure::Words(format!("{message} {}", names()))
    })
}

pub(crate) fn run(arguments: &Arguments, out: &mut impl Write) -> Result<(), Failure> {
    let from = format(&arguments.from_file, arguments.from, "--from")?;
    let to = format(&arguments.to_file, arguments.to, "--to")?;
    if Format::is_packed(&arguments.to_file) {
        let name = arguments.to_file.display();
        return Err(Failure::Words(format!(
            "`{name}`: `.gz` is read, not written; leave it out, and run gzip"
        )));
    }
    let text = match (from, to) {
        // A program may contain more than its tables.
        (Format::Program, Format::Program) => formatted(&arguments.from_file)?,
        _ => {
            let network = program::network(&arguments.from_file, from)?;
            if to == Format::Uai && from != Format::Uai {
                let name = arguments.to_file.display();
                program::warn(&format!(
                    "{name}: warning: UAI has no names; variables and values are their indices"
                ));
            }
            for warning in io::lost(&network, to)? {
                program::warn(&format!("{}: warning: {warning}", arguments.to_file.display()));
            }
            io::write(&network, to)?
        }
    };
    let path = (!program::is_stdin(&arguments.to_file)).then_some(arguments.to_file.as_path());
    output::write(path, text.as_bytes(), out)
}

fn formatted(path: &Path) -> Result<String, Failure> {
    let source = io::open_as(path, Format::Program)?.source;
    let wrong: Diagnostics = match parse(&source) {
        Ok(file) => return Ok(file.to_string()),
        Err(wrong) => wrong,
    };
    Err(Failure::Wrong(wrong, source))
}
