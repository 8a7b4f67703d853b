//! `bp mpe`: the most probable assignment of all variables.
//!
//! In: a network and evidence. Out: a table, or JSON. Invariant: observed variables have their values.

use super::Asked;
use crate::failure::Failure;
use crate::numbers::six_digits;
use crate::wrap::{columns, filled};
use bp_core::compiler::strategies::join_tree::most_probable;
use serde_json::{Map, Value, json};
use std::io::Write;

/// Find the most probable assignment of all variables (MPE), and its ln P.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  bp mpe asia.bif
  bp mpe asia.bif --evidence '{\"dysp\": \"yes\"}' --json")]
pub(crate) struct Arguments {
    #[command(flatten)]
    asked: Asked,
    /// Print the answer as JSON.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments, out: &mut impl Write) -> Result<(), Failure> {
    let (named, evidence) = arguments.asked.read()?;
    let (values, ln_joint) = most_probable(&named.network, &evidence).map_err(|error| named.tell(error))?;
    let ln_joint = ln_joint + named.ln_scale;
    let shown = named.shown();
    let pairs = || shown.iter().map(|one| (named.variable(*one), named.value(*one, values[*one])));
    if arguments.json {
        let assignment: Map<String, Value> =
            pairs().map(|(name, value)| (name, Value::String(value))).collect();
        let answer = json!({ "ln_p": ln_joint, "assignment": assignment });
        serde_json::to_writer(&mut *out, &answer).map_err(std::io::Error::from)?;
        return Ok(writeln!(out)?);
    }
    let width = pairs().map(|(name, _)| columns(&name)).max().unwrap_or(0);
    for (name, value) in pairs() {
        writeln!(out, "  {}  {value}", filled(&name, width))?;
    }
    writeln!(out, "\n  ln P = {}", six_digits(ln_joint))?;
    Ok(())
}
