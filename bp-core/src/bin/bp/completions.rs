//! `bp completions`: shell completions.
//!
//! In: the name of a shell. Out: its script. Invariant: made from the same description as `--help`.

use crate::failure::Failure;
use clap_complete::Shell;
use std::io::Write;

/// Print completions for a shell.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  bp completions bash > ~/.local/share/bash-completion/completions/bp
  bp completions zsh > ~/.zfunc/_bp    (a folder of $fpath)
  bp completions fish > ~/.config/fish/completions/bp.fish")]
pub(crate) struct Arguments {
    /// The shell.
    shell: Shell,
}

pub(crate) fn run(
    arguments: &Arguments,
    mut command: clap::Command,
    out: &mut impl Write,
) -> Result<(), Failure> {
    // Completed before it is written: a closed pipe is not an error of the script.
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut command, "bp", &mut script);
    Ok(out.write_all(&script)?)
}
