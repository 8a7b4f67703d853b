//! `bp marginals`: the posterior of every variable of a network.
//!
//! In: a network and evidence. Out: a table, or JSON. Invariant: an observed variable has its value with probability 1.

use super::Asked;
use crate::failure::Failure;
use crate::numbers::{bar, six_digits};
use crate::wrap::{columns, filled};
use bp_core::strategies::join_tree::Marginals;
use serde_json::{Map, Value, json};
use std::io::Write;

/// Compute the posterior of every variable, and ln P(evidence).
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  bp marginals asia.bif
  bp marginals asia.bif --evidence '{\"smoke\": \"yes\"}' --json
  bp marginals asia.bif --likelihood '{\"xray\": [0.8, 0.2]}'
  bp marginals alarm.bif --only HISTORY,CVP")]
pub(crate) struct Arguments {
    #[command(flatten)]
    asked: Asked,
    /// Only these variables; irrelevant parts of the network are skipped.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    only: Vec<String>,
    /// Print the answer as JSON.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments, out: &mut impl Write) -> Result<(), Failure> {
    let (named, evidence) = arguments.asked.read()?;
    let wanted: Vec<usize> = match arguments.only.is_empty() {
        true => named.shown(),
        false => arguments.only.iter().map(|name| named.number_of(name)).collect::<Result<_, _>>()?,
    };
    let given: Vec<usize> = evidence.hard.iter().map(|(variable, _)| *variable).collect();
    let weighed: Vec<usize> = evidence.likelihoods.iter().map(|(variable, _)| *variable).collect();
    let marginals = Marginals::new(&named.network, &given, &weighed, &wanted)?;
    let mut session = marginals.session();
    session.ask(&evidence).map_err(|error| named.tell(error))?;
    let ln_evidence = session.ln_evidence() + named.ln_scale;
    if arguments.json {
        let mut posteriors = Map::new();
        for variable in &wanted {
            let values = session.posterior(*variable, &evidence).into_iter().enumerate();
            let values: Map<String, Value> =
                values.map(|(value, p)| (named.value(*variable, value), json!(p))).collect();
            posteriors.insert(named.variable(*variable), Value::Object(values));
        }
        let answer = json!({ "ln_p_evidence": ln_evidence, "posteriors": posteriors });
        serde_json::to_writer(&mut *out, &answer).map_err(std::io::Error::from)?;
        return Ok(writeln!(out)?);
    }
    let widest =
        |names: &mut dyn Iterator<Item = String>| names.map(|name| columns(&name)).max().unwrap_or(0).min(28);
    let first = widest(&mut wanted.iter().map(|one| named.variable(*one)));
    let second = widest(&mut wanted.iter().flat_map(|one| {
        (0..named.network.cardinalities[*one]).map(|value| named.value(*one, value)).collect::<Vec<_>>()
    }));
    for variable in &wanted {
        for (value, p) in session.posterior(*variable, &evidence).into_iter().enumerate() {
            let name = if value == 0 { named.variable(*variable) } else { String::new() };
            let (name, value) = (filled(&name, first), filled(&named.value(*variable, value), second));
            let left = 78usize.saturating_sub(first + second + 18).clamp(4, 30);
            writeln!(
                out,
                "{}",
                format!("  {name}  {value}  {}  {}", filled(&six_digits(p), 11), bar(p, left)).trim_end()
            )?;
        }
    }
    writeln!(out, "\n  ln P(evidence) = {}", six_digits(ln_evidence))?;
    Ok(())
}
