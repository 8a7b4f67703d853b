//! The experiment: all policies in all scenes with several seeds.
//!
//! In: scenes, policies, seeds. Out: a file for each run, and figures over the seeds. Invariant: a run depends on its
//! scene, policy and seed only, not on the number of threads or on other runs; a run that was written is not repeated.

mod contender;
mod floor;
mod found;
mod run;
mod statistics;
mod summary;

pub use contender::Contender;
pub use found::Found;
pub use run::{Measured, Run};
pub use statistics::{Mean, mean};
pub use summary::{Figures, Summary};

use crate::error::Error;
use crate::head::real::Senses;
use crate::report::write_atomically;
use crate::world::scene::Scene;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// What to run.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The scenes.
    pub scenes: Vec<Scene>,
    /// The policies; the oracle and the floor are added, since figures are relative to them.
    pub contenders: Vec<Contender>,
    /// The random seeds.
    pub seeds: Vec<u64>,
    /// Looks of a run.
    pub steps: usize,
    /// The senses of the whole head; none for the fast head.
    pub senses: Option<Senses>,
}

impl Plan {
    /// All runs, in order.
    pub fn runs(&self) -> Vec<(&Scene, Contender, u64)> {
        let mut contenders = self.contenders.clone();
        contenders.extend([Contender::Oracle, Contender::Floor]);
        contenders.sort();
        contenders.dedup();
        let runs = self.scenes.iter().flat_map(|scene| {
            let of_scene = contenders
                .iter()
                .flat_map(move |contender| self.seeds.iter().map(move |seed| (scene, *contender, *seed)));
            of_scene.collect::<Vec<_>>()
        });
        runs.collect()
    }

    /// The runs of the given policies alone, in the order scene, policy, seed; they run in parallel, and nothing is written.
    /// `wanted` is asked before each run: the runs that it refuses are left out.
    ///
    /// # Errors
    /// An error of a run.
    pub fn measure(&self, wanted: impl Fn() -> bool + Sync) -> Result<Vec<Run>, Error> {
        let Self { scenes, contenders, seeds, steps, senses } = self;
        let mut runs = Vec::new();
        for scene in scenes {
            for contender in contenders {
                runs.extend(seeds.iter().map(|seed| (scene, *contender, *seed)));
            }
        }
        let wanted = runs.into_par_iter().filter(|_| wanted());
        wanted.map(|(scene, contender, seed)| run::run(scene, *senses, contender, seed, *steps)).collect()
    }

    /// Removes what an earlier experiment left in a folder: its runs, summaries and curves. A folder without a
    /// summary is left as it is.
    ///
    /// # Errors
    /// A file that cannot be removed.
    pub fn clear(folder: &Path) -> Result<(), Error> {
        let remove = |folder: &Path, is_own: &dyn Fn(&str) -> bool| -> Result<(), Error> {
            let Ok(entries) = std::fs::read_dir(folder) else { return Ok(()) };
            let names = entries.flatten().filter_map(|entry| entry.file_name().into_string().ok());
            for path in names.filter(|name| is_own(name)).map(|name| folder.join(name)) {
                if path.is_file() {
                    let failed = |source| Error::Folder { path: folder.to_owned(), source };
                    std::fs::remove_file(&path).map_err(failed)?;
                }
            }
            Ok(())
        };
        if !folder.join("summary.json").is_file() {
            return Ok(());
        }
        remove(&folder.join("runs"), &|name| name.ends_with(".json"))?;
        remove(folder, &|name| {
            let is_curve = name.ends_with("_reachable.png") || name.ends_with("_log_loss.png");
            is_curve || matches!(name, "summary.json" | "summary.csv")
        })
    }

    /// Runs what the folder does not have yet; with `resume` false, everything. `done` is called after each run.
    ///
    /// # Errors
    /// A file that cannot be read or written; an error of a run.
    pub fn execute(&self, folder: &Path, resume: bool, done: impl Fn() + Sync) -> Result<Vec<Run>, Error> {
        let folder = folder.join("runs");
        std::fs::create_dir_all(&folder).map_err(|source| Error::Folder { path: folder.clone(), source })?;
        let one = |(scene, contender, seed): &(&Scene, Contender, u64)| {
            let path = file(&folder, &scene.name, *contender, *seed);
            let kept = if resume { Run::read(&path, self.steps) } else { None };
            let run = match kept {
                Some(run) => run,
                None => {
                    let run = run::run(scene, self.senses, *contender, *seed, self.steps)?;
                    let json = serde_json::to_string(&run).expect("internal: figures are numbers");
                    write_atomically(&path, json.as_bytes())?;
                    // As it is read when the experiment is resumed: a number may differ in its last bit.
                    serde_json::from_str(&json).expect("internal: it was just written")
                }
            };
            done();
            Ok(run)
        };
        self.runs().par_iter().map(one).collect()
    }
}

fn file(folder: &Path, scene: &str, contender: Contender, seed: u64) -> PathBuf {
    let scene: String = scene.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect();
    folder.join(format!("{scene}-{}-{seed}.json", contender.name()))
}
