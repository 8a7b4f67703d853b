//! The options of inference that the commands share.
//!
//! In: the command line. Out: options of the planner and of sampling. Invariant: every command that asks questions has the
//! same options.

use bp_core::compiler::plan::{Options, Strategy};
use bp_core::compiler::sample::Sampling;
use bp_core::program::Program;

/// The choice of a strategy.
#[derive(clap::Args)]
pub(crate) struct Planning {
    /// Inference strategy: sums, join_tree, gaussian, conjugate, mixture, chain, weighting, gibbs, particles or extended_kalman; by default the cheapest exact one, else an estimate.
    #[arg(long, value_name = "STRATEGY", value_parser = strategy)]
    by: Option<Strategy>,
    /// Estimate an exact answer of more products than this, if possible.
    #[arg(long, value_name = "PRODUCTS", value_parser = products)]
    budget: Option<u64>,
}

impl Planning {
    /// The options of the planner.
    pub(crate) fn options(&self) -> Options {
        Options { by: self.by, budget: self.budget, ..Options::default() }
    }
}

/// The choice of a strategy, and the draws of an estimate.
#[derive(clap::Args)]
pub(crate) struct Inference {
    #[command(flatten)]
    planning: Planning,
    /// Number of draws, if the answer has to be estimated.
    #[arg(long, value_name = "N", default_value_t = Sampling::default().particles, value_parser = particles)]
    particles: usize,
    /// Random seed; the same seed gives the same answer.
    #[arg(long, value_name = "N", default_value_t = Sampling::default().seed)]
    seed: u64,
}

impl Inference {
    /// The options of the planner.
    pub(crate) fn options(&self) -> Options {
        self.planning.options()
    }

    /// The options of sampling.
    pub(crate) fn sampling(&self) -> Sampling {
        Sampling { particles: self.particles, seed: self.seed }
    }

    /// The program with these options.
    pub(crate) fn of(&self, program: Program) -> Program {
        program.planned(self.options()).draws(self.particles).seed(self.seed)
    }
}

/// A number of draws.
fn particles(text: &str) -> Result<usize, String> {
    let count = text.parse().ok().filter(|count| (1..=100_000_000).contains(count));
    count.ok_or_else(|| "expected a number of draws, from 1 to 100000000".to_owned())
}

/// A number of products, `1000000` or `1e6`.
fn products(text: &str) -> Result<u64, String> {
    let number = text.parse::<f64>().ok().filter(|number| (1.0..=1e18).contains(number));
    number
        .map(|number| number as u64)
        .ok_or_else(|| "expected a number of products, such as `1e6`".to_owned())
}

/// A strategy by its name.
fn strategy(text: &str) -> Result<Strategy, String> {
    let names = Strategy::ALL.map(Strategy::name);
    Strategy::of_name(text).ok_or_else(|| format!("expected one of {}", names.join(", ")))
}
