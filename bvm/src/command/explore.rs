//! `bvm explore`: active exploration of the simulated world.
//!
//! In: a number of steps and a seed. Out: a folder of pictures, `run.json`, and a table. Invariant: the same seed gives
//! the same figures.

use super::look::EvidenceName;
use super::{check_folder, print};
use bvm::error::Error;
use bvm::exploration::{Report, Rule, explore};
use bvm::world::World;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use std::path::PathBuf;

/// Explore a simulated room by entropy, and compare gaze strategies.
#[derive(Args)]
#[command(after_help = "A look: sense, predict, estimate, choose a gaze, turn. A random and a sweeping\n\
                  gaze run beside it in the same world.\n\nExamples:\n  bvm explore\n  bvm explore --steps 60 --seed 7 --out run\n  bvm explore --evidence hard\n  \
                  bvm explore --json | jq '.rules[0].final_entropy_share'")]
pub(crate) struct Arguments {
    /// Number of looks.
    #[arg(long, default_value_t = 40, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    steps: u32,
    /// Random seed of world and noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Evidence of a reading for its line of sight.
    #[arg(
        long,
        value_name = "NAME",
        value_enum,
        default_value = "virtual",
        hide_possible_values = true,
        help = "Evidence of a reading: a likelihood for each cell of\nits line of sight, from the sensor's deviation\n(virtual), or the cell that it lies in, as in the\npaper (hard)"
    )]
    evidence: EvidenceName,
    /// Output folder.
    #[arg(long, default_value = "bvm-run")]
    out: PathBuf,
    /// Print the figures as JSON.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Error> {
    check_folder(&arguments.out)?;
    let steps = arguments.steps as usize;
    let bar = ProgressBar::new((Rule::ALL.len() * steps) as u64);
    let style = ProgressStyle::with_template("{msg:>16} [{bar:40}] {pos}/{len} looks, {eta} left");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    let (evidence, mut episodes) = (arguments.evidence.into(), Vec::new());
    for rule in Rule::ALL {
        bar.set_message(rule.name());
        episodes.push(explore(rule, evidence, steps, arguments.seed, || bar.inc(1))?);
    }
    bar.finish_and_clear();
    let report = Report::new(arguments.seed, evidence, &episodes);
    let files = report.write(&arguments.out, &World::embedded(arguments.seed), &episodes)?;
    if arguments.json {
        print(&serde_json::to_string(&report).expect("internal: figures are numbers"));
        return Ok(());
    }
    print(&report.table());
    print("");
    files.iter().for_each(|file| print(&format!("wrote {}", file.display())));
    Ok(())
}
