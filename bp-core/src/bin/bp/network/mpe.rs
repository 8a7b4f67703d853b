//! `bp mpe`: the most probable assignment of all variables.
//!
//! In: a network and evidence. Out: a table, or JSON. Invariant: observed variables have their values.

use super::Asked;
use crate::answered::write_json;
use crate::failure::Failure;
use crate::numbers::six_digits;
use crate::planning::Inference;
use crate::wrap::{columns, filled};
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
    #[command(flatten)]
    inference: Inference,
    /// Print the answer as JSON.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments, out: &mut impl Write) -> Result<(), Failure> {
    let (program, evidence) = arguments.asked.program()?;
    let found = arguments.inference.of(program).most_probable(&evidence)?;
    let ln_joint = found.number()?;
    let pairs = || found.answer().answer.iter().flat_map(|row| row.values.clone());
    if arguments.json {
        let assignment: Map<String, Value> =
            pairs().map(|(name, value)| (name, Value::String(value))).collect();
        let mut answer = json!({ "ln_p": ln_joint, "assignment": assignment });
        if let Some(estimate) = found.estimate() {
            answer["estimate"] = json!(estimate);
        }
        return write_json(&answer, out);
    }
    let width = pairs().map(|(name, _)| columns(&name)).max().unwrap_or(0);
    for (name, value) in pairs() {
        writeln!(out, "  {}  {value}", filled(&name, width))?;
    }
    writeln!(out, "\n  ln P = {}", six_digits(ln_joint))?;
    if let Some(estimate) = found.estimate() {
        let (draws, seed) = (estimate.particles, estimate.seed);
        writeln!(out, "\n  the assignment is an estimate: the most frequent of {draws} draws (seed {seed})")?;
    }
    Ok(())
}
