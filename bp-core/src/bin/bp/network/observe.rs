//! `bp observe`: the most informative observation.
//!
//! In: a network, evidence, and target variables. Out: the other variables, the most informative first. Invariant:
//! information is in bits, and at most the entropy of either side.

use super::Asked;
use crate::failure::Failure;
use crate::numbers::{bar, six_digits};
use crate::wrap::{columns, filled};
use bp_core::compiler::strategies::join_tree::{Observation, entropy, joint, observations};
use serde_json::{Value, json};
use std::io::Write;

/// Rank what to observe next by its mutual information with some targets.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  bp observe asia.bif --about lung
  bp observe asia.bif --about lung,tub --among xray,dysp,smoke
  bp observe alarm.bif --about HYPOVOLEMIA --json \\
      --evidence '{\"HRBP\": \"HIGH\"}'")]
pub(crate) struct Arguments {
    #[command(flatten)]
    asked: Asked,
    /// Targets: one variable, or several together.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', required = true)]
    about: Vec<String>,
    /// Candidates for observation; by default all other variables.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    among: Vec<String>,
    /// Print the answer as JSON.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments, out: &mut impl Write) -> Result<(), Failure> {
    let (named, evidence) = arguments.asked.read()?;
    let targets = super::free(&named, &evidence, &arguments.about)?;
    let candidates = match arguments.among.is_empty() {
        true => named.shown(),
        false => super::free(&named, &evidence, &arguments.among)?,
    };
    let told = |error| named.tell(error);
    let network = &named.network;
    let now = entropy(&joint(network, &evidence, &targets).map_err(told)?.probabilities);
    let found = observations(network, &evidence, &targets, &candidates).map_err(told)?;
    if arguments.json {
        let one = |one: &Observation| {
            json!({
                "variable": named.variable(one.variable),
                "information_bits": one.information,
                "entropy_bits": one.entropy,
            })
        };
        let list: Vec<Value> = found.iter().map(one).collect();
        let answer = json!({ "about": arguments.about, "entropy_bits": now, "observations": list });
        serde_json::to_writer(&mut *out, &answer).map_err(std::io::Error::from)?;
        return Ok(writeln!(out)?);
    }
    writeln!(
        out,
        "  {}: entropy {} bits; information of each observation in bits:\n",
        arguments.about.join(", "),
        six_digits(now)
    )?;
    let names: Vec<String> = found.iter().map(|one| named.variable(one.variable)).collect();
    let width = names.iter().map(|name| columns(name)).max().unwrap_or(0).min(40);
    let left = 76usize.saturating_sub(width + 16).clamp(4, 30);
    for (one, name) in found.iter().zip(&names) {
        let share = if now > 0.0 { one.information / now } else { 0.0 };
        let row = format!(
            "  {}  {}  {}",
            filled(name, width),
            filled(&six_digits(one.information), 11),
            bar(share, left)
        );
        writeln!(out, "{}", row.trim_end())?;
    }
    Ok(())
}
