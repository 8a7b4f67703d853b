//! `bp check`: checks programs.
//!
//! In: files. Out: a line for each correct file; the errors of the others on stderr. Invariant: every file is checked,
//! whatever errors the earlier ones have.

use crate::failure::Failure;
use crate::program;
use bp_core::compiler::model::Model;
use std::io::Write;
use std::path::PathBuf;

/// Check programs: syntax, names, types, domains and decomposition.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  bp check wet_grass.bp
  bp check models/*.bp
  cat wet_grass.bp | bp check -")]
pub(crate) struct Arguments {
    /// Programs; `-` is stdin.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments, out: &mut impl Write) -> Result<(), Failure> {
    let mut right = true;
    for path in &arguments.files {
        match program::model(path) {
            Ok(model) => writeln!(out, "ok: {}", summary(&model))?,
            Err(failure) => {
                // Results and errors are in the order of the files.
                out.flush()?;
                failure.report();
                right = false;
            }
        }
    }
    if right { Ok(()) } else { Err(Failure::Reported) }
}

fn summary(model: &Model) -> String {
    let counted = |count: usize, what: &str| format!("{count} {what}{}", if count == 1 { "" } else { "s" });
    let index = usize::from(model.plate.is_some());
    let mut parts = vec![
        counted(model.variables.len() - index, "variable"),
        counted(model.factors.len(), "factor"),
        counted(model.questions.len(), "question"),
    ];
    if !model.parameters.is_empty() {
        parts.push(counted(model.parameters.len(), "parameter"));
    }
    format!("program {}: {}", model.name, parts.join(", "))
}
