//! `bp marginals`: the posterior of every variable.
//!
//! In: a network or a program, and evidence. Out: a table, or JSON. Invariant: an observed variable has probability 1
//! at its value.

use super::{Asked, certainty};
use crate::failure::Failure;
use crate::planning::Inference;
use bp_core::compiler::answer::{Answer, Figure};
use serde_json::{Map, Value, json};
use std::io::Write;

/// The posterior of every variable, and ln P(evidence).
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  bp marginals asia.bif
  bp marginals asia.bif --evidence '{\"smoke\": \"yes\"}' --json
  bp marginals asia.bif --likelihood '{\"xray\": [0.8, 0.2]}'
  bp marginals alarm.bif --only HISTORY,CVP
  bp marginals coin.bp --set bias=0.3

Of the reals of a program, means and deviations are printed.")]
pub(crate) struct Arguments {
    #[command(flatten)]
    asked: Asked,
    /// Only these variables: irrelevant parts of the network are left out of the work.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    only: Vec<String>,
    #[command(flatten)]
    inference: Inference,
    /// Print the answer as JSON.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments, out: &mut impl Write) -> Result<(), Failure> {
    let (program, evidence) = arguments.asked.program()?;
    let found = arguments.inference.of(program).marginals_of(&arguments.only, &evidence)?;
    match arguments.json {
        true => {
            serde_json::to_writer(&mut *out, &object(found.answer())).map_err(std::io::Error::from)?;
            Ok(writeln!(out)?)
        }
        false => Ok(write!(out, "{}", found.answer().table(true, ""))?),
    }
}

/// The posteriors by variable and value, with the standard errors of those that are estimated; for a real its moments.
fn object(answer: &Answer) -> Value {
    let (mut posteriors, mut errors): (Map<String, Value>, Map<String, Value>) = (Map::new(), Map::new());
    let put = |all: &mut Map<String, Value>, name: &str, value: &str, number: f64| {
        if let Some(values) = all.entry(name).or_insert_with(|| json!({})).as_object_mut() {
            values.insert(value.to_owned(), json!(number));
        }
    };
    for row in &answer.answer {
        let Some((name, value)) = row.values.last() else { continue };
        match row.figure {
            Figure::Probability { p } => put(&mut posteriors, name, value, p),
            Figure::Estimated { p, error } => {
                put(&mut posteriors, name, value, p);
                put(&mut errors, name, value, error);
            }
            figure => {
                posteriors.entry(name.clone()).or_insert_with(|| json!(figure));
            }
        }
    }
    let mut all = json!({ "posteriors": posteriors });
    if !errors.is_empty() {
        all["errors"] = json!(errors);
    }
    certainty(&mut all, answer);
    all
}
