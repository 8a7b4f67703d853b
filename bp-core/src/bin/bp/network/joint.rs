//! `bp joint`: the joint posterior of some variables of a network.
//!
//! In: a network, evidence, names of variables. Out: their joint posterior, its entropy, and their mutual information.
//! Invariant: a row for each combination of values, the last variable fastest.

use super::Asked;
use crate::failure::Failure;
use crate::numbers::{bar, six_digits};
use crate::wrap::{columns, filled};
use bp_core::compiler::strategies::join_tree::{Named, entropy, joint};
use serde_json::{Map, Value, json};
use std::io::Write;

/// Compute the joint posterior of some variables, with entropies and mutual information in bits.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  bp joint asia.bif --of lung,bronc
  bp joint asia.bif --of lung,bronc --evidence '{\"dysp\": \"yes\"}' --json")]
pub(crate) struct Arguments {
    #[command(flatten)]
    asked: Asked,
    /// The variables.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', required = true)]
    of: Vec<String>,
    /// Print the answer as JSON.
    #[arg(long)]
    json: bool,
}

/// Limit of rows.
const MOST_CELLS: f64 = 1e6;

pub(crate) fn run(arguments: &Arguments, out: &mut impl Write) -> Result<(), Failure> {
    let (named, evidence) = arguments.asked.read()?;
    let variables: Vec<usize> = super::free(&named, &evidence, &arguments.of)?;
    let extents: Vec<usize> = variables.iter().map(|one| named.network.cardinalities[*one]).collect();
    let cells: f64 = extents.iter().map(|extent| *extent as f64).product();
    if cells > MOST_CELLS {
        return Err(Failure::Words(format!(
            "these variables have {} values together, more than {MOST_CELLS}; name fewer of them",
            six_digits(cells)
        )));
    }
    let found = joint(&named.network, &evidence, &variables).map_err(|error| named.tell(error))?;
    let ln_evidence = found.ln_evidence + named.ln_scale;
    let all = entropy(&found.probabilities);
    let alone: Vec<f64> =
        (0..variables.len()).map(|place| entropy(&marginal(&found.probabilities, &extents, place))).collect();
    // Σ H(X) − H(all): the mutual information of two, the total correlation of more.
    let shared = (alone.iter().sum::<f64>() - all).max(0.0) + 0.0;
    let rows: Vec<(Vec<String>, f64)> = (found.probabilities.iter().enumerate())
        .map(|(row, p)| (values(&named, &variables, &extents, row), *p))
        .collect();
    if arguments.json {
        let object = |names: &[String]| {
            let pairs = variables.iter().zip(names);
            pairs.map(|(one, value)| (named.variable(*one), json!(value))).collect::<Map<String, Value>>()
        };
        let entropies: Map<String, Value> =
            variables.iter().zip(&alone).map(|(one, bits)| (named.variable(*one), json!(bits))).collect();
        let cells: Vec<Value> =
            rows.iter().map(|(names, p)| json!({ "values": object(names), "p": p })).collect();
        let answer = json!({
            "ln_p_evidence": ln_evidence,
            "joint": cells,
            "entropy_bits": all,
            "entropies_bits": entropies,
            "information_bits": shared,
        });
        serde_json::to_writer(&mut *out, &answer).map_err(std::io::Error::from)?;
        return Ok(writeln!(out)?);
    }
    let heads: Vec<String> = variables.iter().map(|one| named.variable(*one)).collect();
    let width = |place: usize| {
        let names = rows.iter().map(|(names, _)| columns(&names[place]));
        names.chain([columns(&heads[place])]).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..heads.len()).map(width).collect();
    let line = |names: &[String]| {
        let cells = names.iter().zip(&widths).map(|(name, width)| filled(name, *width));
        cells.collect::<Vec<String>>().join("  ")
    };
    writeln!(out, "  {}  P", line(&heads))?;
    let left = 78usize.saturating_sub(widths.iter().map(|width| width + 2).sum::<usize>() + 16).clamp(4, 30);
    for (names, p) in &rows {
        let row = format!("  {}  {}  {}", line(names), filled(&six_digits(*p), 11), bar(*p, left));
        writeln!(out, "{}", row.trim_end())?;
    }
    writeln!(out)?;
    for (name, bits) in heads.iter().zip(&alone) {
        writeln!(out, "  H({name}) = {} bits", six_digits(*bits))?;
    }
    if variables.len() > 1 {
        writeln!(out, "  H of all together = {} bits", six_digits(all))?;
        let what = if variables.len() == 2 { "mutual information" } else { "total correlation" };
        writeln!(out, "  {what} = {} bits", six_digits(shared))?;
    }
    writeln!(out, "  ln P(evidence) = {}", six_digits(ln_evidence))?;
    Ok(())
}

/// The names of the values of a row.
fn values(named: &Named, variables: &[usize], extents: &[usize], mut row: usize) -> Vec<String> {
    let mut names = Vec::with_capacity(variables.len());
    for (variable, extent) in variables.iter().zip(extents).rev() {
        names.push(named.value(*variable, row % extent));
        row /= extent;
    }
    names.reverse();
    names
}

/// The marginal of one variable of a joint posterior.
fn marginal(probabilities: &[f64], extents: &[usize], place: usize) -> Vec<f64> {
    let inner: usize = extents[place + 1..].iter().product();
    let mut marginal = vec![0.0; extents[place]];
    for (number, p) in probabilities.iter().enumerate() {
        marginal[number / inner % extents[place]] += p;
    }
    marginal
}
