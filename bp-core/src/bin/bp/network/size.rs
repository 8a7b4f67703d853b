//! `bp cost`: the cost of a network, before anything runs.
//!
//! In: a network and optionally evidence. Out: width, cells and bytes of one tree, and of the plan. Invariant: only the
//! plan is computed.

use super::Asked;
use crate::failure::Failure;
use crate::numbers::{count, six_digits};
use bp_core::compiler::strategies::join_tree::{Cost, Marginals, Tree};
use serde_json::json;
use std::io::Write;

/// Estimate the cost of all marginals: width of the join tree, cells and bytes.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  bp cost link.bif
  bp cost link.bif --evidence '{\"N59_d_g\": \"N\"}' --json")]
pub(crate) struct Arguments {
    #[command(flatten)]
    asked: Asked,
    /// Print the answer as JSON.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments, out: &mut impl Write) -> Result<(), Failure> {
    let (named, evidence) = arguments.asked.read()?;
    let network = &named.network;
    let given: Vec<usize> = evidence.hard.iter().map(|(variable, _)| *variable).collect();
    let weighed: Vec<usize> = evidence.likelihoods.iter().map(|(variable, _)| *variable).collect();
    let every: Vec<usize> = (0..network.cardinalities.len()).collect();
    let tree = Tree::cost_of(network, &given);
    let (cost, trees) = Marginals::plan(network, &given, &weighed, &every);
    if arguments.json {
        let one = |cost: Cost| json!({ "width": cost.width, "cells": cost.cells, "flops": cost.flops(), "bytes": cost.bytes });
        let mut answer = one(cost);
        answer["variables"] = json!(every.len());
        answer["trees"] = json!(trees);
        answer["one_tree"] = one(tree);
        serde_json::to_writer(&mut *out, &answer).map_err(std::io::Error::from)?;
        return Ok(writeln!(out)?);
    }
    writeln!(out, "  {} variables, {} tables", every.len(), network.tables.len())?;
    let line = |what: &str, cost: Cost| {
        let bytes = ["B", "kB", "MB", "GB", "TB", "PB"];
        let unit = (cost.bytes.max(1.0).log10() / 3.0).floor().clamp(0.0, 5.0);
        let amount =
            if unit == 0.0 { count(cost.bytes) } else { format!("{:.1}", cost.bytes / 1000f64.powf(unit)) };
        if cost.width == 0 && cost.cells > 1.0 {
            return format!("  {what:<22}  more than {} cells: too many to count", six_digits(cost.cells));
        }
        let [cells, flops] = [cost.cells, cost.flops()].map(count);
        let unit = bytes[unit as usize];
        format!(
            "  {what:<22}  width {:>3}  {cells:>11} cells  {flops:>11} flops  {amount} {unit}",
            cost.width
        )
    };
    writeln!(out, "{}", line("one join tree", tree))?;
    let what = match trees {
        1 => "what is run: that".to_owned(),
        several => format!("what is run: {several} trees"),
    };
    writeln!(out, "{}", line(&what, cost))?;
    Ok(())
}
