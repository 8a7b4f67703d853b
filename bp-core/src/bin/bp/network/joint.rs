//! `bp joint`: the joint posterior of some variables of a network.
//!
//! In: a network, evidence, names of variables. Out: their joint posterior, its entropy, and their mutual information.
//! Invariant: a row for each combination of values, the last variable fastest.

use super::{Asked, certainty, number};
use crate::answered::write_json;
use crate::failure::Failure;
use crate::numbers::{bar, six_digits};
use crate::planning::Inference;
use crate::wrap::{columns, filled};
use bp_core::compiler::answer::{Part, PartLaw, ordinals};
use bp_core::compiler::operators;
use bp_core::program::Posterior;
use serde_json::{Map, Value, json};
use std::f64::consts::LN_2;
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
    #[command(flatten)]
    inference: Inference,
    /// The variables.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', required = true)]
    of: Vec<String>,
    /// Print the answer as JSON.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments, out: &mut impl Write) -> Result<(), Failure> {
    let (program, evidence) = arguments.asked.program()?;
    super::free(&evidence, &arguments.of)?;
    let found = arguments.inference.of(program).joint(&arguments.of, &evidence)?;
    let model = found.model();
    let Some(part) = found.answer().parts.first() else { return Ok(write!(out, "{}", found.answer())?) };
    let Some(probabilities) = part.probabilities() else { return reals(arguments, &found, part, out) };
    let variables: Vec<String> = part.of.iter().map(|slot| slot.name(model)).collect();
    let extents: Vec<usize> = part.of.iter().map(|slot| slot.count).collect();
    let ln_evidence = found.ln_evidence();
    let all = entropy(&probabilities);
    let alone: Vec<f64> =
        (0..variables.len()).map(|place| entropy(&marginal(&probabilities, &extents, place))).collect();
    // Σ H(X) − H(all): the mutual information of two, the total correlation of more.
    let shared = (alone.iter().sum::<f64>() - all).max(0.0) + 0.0;
    let names = |row: usize| {
        let ordinals = part.of.iter().zip(ordinals(&part.of, row));
        ordinals.map(|(slot, at)| model.value_name(slot.variable, at)).collect::<Vec<String>>()
    };
    let rows: Vec<(Vec<String>, f64)> =
        probabilities.iter().enumerate().map(|(row, p)| (names(row), *p)).collect();
    if arguments.json {
        let object = |names: &[String]| {
            let pairs = variables.iter().zip(names);
            pairs.map(|(one, value)| (one.clone(), json!(value))).collect::<Map<String, Value>>()
        };
        let entropies: Map<String, Value> =
            variables.iter().zip(&alone).map(|(one, bits)| (one.clone(), json!(bits))).collect();
        let cells: Vec<Value> =
            rows.iter().map(|(names, p)| json!({ "values": object(names), "p": p })).collect();
        let mut answer = json!({
            "joint": cells,
            "entropy_bits": all,
            "entropies_bits": entropies,
            "information_bits": shared,
        });
        certainty(&mut answer, found.answer());
        return write_json(&answer, out);
    }
    let heads = variables;
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
    if heads.len() > 1 {
        writeln!(out, "  H of all together = {} bits", six_digits(all))?;
        let what = if heads.len() == 2 { "mutual information" } else { "total correlation" };
        writeln!(out, "  {what} = {} bits", six_digits(shared))?;
    }
    if let Some(ln_evidence) = ln_evidence {
        writeln!(out, "  ln P(evidence) = {}", six_digits(ln_evidence))?;
    }
    Ok(())
}

/// Reals together: the means and deviations, and of a normal law the covariances.
fn reals(arguments: &Arguments, found: &Posterior, part: &Part, out: &mut impl Write) -> Result<(), Failure> {
    let PartLaw::Normal { mean, covariance } = &part.law else {
        return match arguments.json {
            true => write_json(found.answer(), out),
            false => Ok(write!(out, "{}", found.answer())?),
        };
    };
    let names: Vec<String> = part.of.iter().map(|slot| slot.name(found.model())).collect();
    let bits = found.entropy()? / LN_2;
    if arguments.json {
        let rows: Vec<&[f64]> = covariance.chunks(names.len()).collect();
        let mut answer = json!({
            "variables": names,
            "mean": mean,
            "covariance": rows,
            "entropy_bits": number(bits),
        });
        certainty(&mut answer, found.answer());
        return write_json(&answer, out);
    }
    write!(out, "{}", found.answer())?;
    Ok(writeln!(out, "\n  H of all together = {} bits", six_digits(bits))?)
}

/// H = −Σ p log₂ p, in bits.
fn entropy(probabilities: &[f64]) -> f64 {
    operators::entropy(probabilities.iter().copied()) / LN_2
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
