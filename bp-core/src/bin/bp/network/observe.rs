//! `bp observe`: the most informative observation.
//!
//! In: a network, evidence, and target variables. Out: the other variables, the most informative first. Invariant:
//! information is in bits, and at most the entropy of either side.

use super::{Asked, number};
use crate::failure::Failure;
use crate::numbers::{bar, six_digits};
use crate::planning::Inference;
use crate::wrap::{columns, filled};
use bp_core::program::Observation;
use serde_json::{Value, json};
use std::f64::consts::LN_2;
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
    #[command(flatten)]
    inference: Inference,
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
    let (program, evidence) = arguments.asked.program()?;
    super::free(&evidence, &arguments.about)?;
    super::free(&evidence, &arguments.among)?;
    if let Some(name) = arguments.among.iter().find(|name| arguments.about.contains(name)) {
        return Err(Failure::Words(format!("`{name}` is both a target (--about) and a candidate (--among)")));
    }
    let program = arguments.inference.of(program);
    let (now, mut found) = program.observations(&arguments.about, &arguments.among, &evidence)?;
    let now = now / LN_2;
    for one in &mut found {
        (one.information, one.entropy) = (one.information / LN_2, one.entropy / LN_2);
    }
    if arguments.json {
        let one = |one: &Observation| {
            json!({
                "variable": one.variable,
                "information_bits": number(one.information),
                "entropy_bits": number(one.entropy),
            })
        };
        let list: Vec<Value> = found.iter().map(one).collect();
        let answer = json!({ "about": arguments.about, "entropy_bits": number(now), "observations": list });
        serde_json::to_writer(&mut *out, &answer).map_err(std::io::Error::from)?;
        return Ok(writeln!(out)?);
    }
    writeln!(
        out,
        "  {}: entropy {} bits; information of each observation in bits:\n",
        arguments.about.join(", "),
        six_digits(now)
    )?;
    let names: Vec<String> = found.iter().map(|one| one.variable.clone()).collect();
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
