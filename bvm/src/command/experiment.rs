//! `bvm experiment`: all policies in several scenes, with several seeds.
//!
//! In: scenes, policies, seeds. Out: a file for each run, `summary.json`, `summary.csv`, curves, and tables. Invariant:
//! a run that was interrupted is resumed: what is in the folder is not computed again.

use super::explore::SenseName;
use super::{check_folder, print};
use bvm::error::Error;
use bvm::experiment::{Contender, Plan, Summary};
use bvm::exploration::PolicyKind;
use bvm::world::scene::Scene;
use clap::Args;
use clap::builder::TypedValueParser;
use indicatif::{ProgressBar, ProgressStyle};
use std::path::PathBuf;

/// Compare all gaze policies over scenes and random seeds.
#[derive(Args)]
#[command(after_help = "A greedy oracle, which knows what it will hit, and the floor, which sees the\n\
                  whole sphere at each look, are added; figures are relative to them.\n\nExamples:\n  \
                  bvm experiment --seeds 5 --out runs\n  \
                  bvm experiment --scenes fog --policies view,null --out runs --resume")]
pub(crate) struct Arguments {
    /// Scenes, with commas: names or scene files.
    #[arg(long, value_delimiter = ',', value_name = "NAMES", default_values = DEFAULT_SCENES, hide_default_value = true)]
    scenes: Vec<String>,
    /// Policies, with commas; all without this.
    #[arg(
        long,
        value_delimiter = ',',
        value_name = "NAMES",
        hide_possible_values = true,
        value_parser = super::explore::policy_parser().map(Contender::Policy)
    )]
    policies: Vec<Contender>,
    /// Number of random seeds, from 1.
    #[arg(long, value_name = "NUMBER", default_value_t = 20, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    seeds: u64,
    /// Looks of a run.
    #[arg(long, default_value_t = 40, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    steps: u32,
    /// The senses, separated by commas.
    #[arg(
        long,
        value_name = "NAMES",
        value_enum,
        value_delimiter = ',',
        default_value = "depth",
        hide_possible_values = true,
        help = "The senses, separated by commas: depth, the fast head;\nor some of stereo, audio and imu"
    )]
    senses: Vec<SenseName>,
    /// Number of threads; all cores without this.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
    /// Output folder.
    #[arg(long)]
    out: PathBuf,
    /// Keep the runs that are in the folder.
    #[arg(long)]
    resume: bool,
    /// Print the figures as JSON.
    #[arg(long)]
    json: bool,
}

/// The scenes of the experiment: all that are built in but the sealed box.
const DEFAULT_SCENES: [&str; 11] = [
    "furnished",
    "empty",
    "office",
    "corridor",
    "speaker_behind",
    "two_speakers",
    "passer_by",
    "door",
    "hands",
    "glass_and_black",
    "fog",
];

pub(crate) fn run(arguments: &Arguments) -> Result<(), Error> {
    let senses = SenseName::whole(&arguments.senses)?;
    check_folder(&arguments.out)?;
    if !arguments.resume {
        Plan::clear(&arguments.out)?;
    }
    let scenes: Vec<Scene> =
        arguments.scenes.iter().map(|name| Scene::find(name)).collect::<Result<_, _>>()?;
    let all = || PolicyKind::ALL.map(Contender::Policy).to_vec();
    let contenders = if arguments.policies.is_empty() { all() } else { arguments.policies.clone() };
    let (seeds, steps) = ((1..=arguments.seeds).collect(), arguments.steps as usize);
    let plan = Plan { scenes, contenders, seeds, steps, senses };
    let bar = ProgressBar::new(plan.runs().len() as u64);
    let style = ProgressStyle::with_template("[{bar:40}] {pos}/{len} runs, {eta} left");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    let work = || plan.execute(&arguments.out, arguments.resume, || bar.inc(1));
    let runs = match arguments.threads {
        None => work(),
        Some(threads) => {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads as usize).build();
            pool.expect("internal: a pool of threads").install(work)
        }
    }?;
    bar.finish_and_clear();
    let summary = Summary::of(&runs);
    let files = summary.write(&arguments.out)?;
    if arguments.json {
        print(&serde_json::to_string(&summary).expect("internal: figures are numbers"));
        return Ok(());
    }
    summary.scenes().iter().for_each(|scene| print(&summary.table(scene)));
    print(
        "log-loss   mean -ln P of what is true, nats for each visible cell, ± standard error\n\
         precis     share of true surfaces among the cells taken for occupied\n\
         recall     share of the surfaces in sight that are taken for occupied\n\
         reach      H(O) of visible cells after the last look: 100 % before the first\n\
         \x20          look, 0 % for a head that sees the whole sphere at each look\n\
         area       the same on average over all looks\n\
         50, 90 %   looks to that part of the oracle's reduction; – if most seeds never do\n\
         µs         median time of a decision\n\
         s          seconds, turns included: to 90 %, until a moving body was in the map\n\
         \x20          where it was, until a bearing pointed to a source\n",
    );
    files.iter().for_each(|file| print(&format!("wrote {}", file.display())));
    Ok(())
}
