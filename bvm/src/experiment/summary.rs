//! The figures of an experiment: means over seeds for each scene and participant.
//!
//! In: runs. Out: [`Summary`], as JSON, CSV, a table, and curves. Invariant: a figure relative to the oracle or the floor
//! compares runs of the same scene and seed.

use super::contender::Contender;
use super::run::{Measured, Run};
use super::statistics::{Mean, mean};
use crate::error::Error;
use crate::report::{Band, bands, write_atomically};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The figures of a participant in a scene, over the seeds.
#[derive(Clone, Debug, Serialize)]
pub struct Figures {
    /// The scene.
    pub scene: String,
    /// The participant.
    pub contender: Contender,
    /// Number of seeds.
    pub seeds: usize,
    /// Mean −ln P of the true state of a visible cell after the last look, nats.
    pub log_loss: Mean,
    /// Precision of occupied cells after the last look.
    pub precision: Mean,
    /// Recall of surfaces after the last look.
    pub recall: Mean,
    /// Free cells taken for occupied after the last look.
    pub false_occupied: Mean,
    /// Σ H(O) over visible cells after the last look, as a share: 1 before the first look, 0 at the floor's end.
    pub reachable: Mean,
    /// The mean of that share over the looks: the area under its curve.
    pub area: Mean,
    /// The same over the seconds of the run.
    pub area_over_time: Mean,
    /// Σ H(O, V) over the map after the last look (Eq. 5), as a share of the first.
    pub entropy: Mean,
    /// Looks after which half of the oracle's reduction of reachable entropy was reached; the mean of the seeds that
    /// reached it.
    pub looks_to_half: Mean,
    /// Looks to 90 % of it.
    pub looks_to_most: Mean,
    /// Seconds to 90 % of it.
    pub seconds_to_most: Mean,
    /// Seconds until the map had a moving body where it was; the mean of the seeds that found one.
    pub seconds_to_body: Mean,
    /// Seconds until a bearing pointed to a source; the mean of the seeds that found one.
    pub seconds_to_source: Mean,
    /// Share of the seeds that reached 90 % of it.
    pub reached: f64,
    /// How far the head turned, rad.
    pub travel_rad: Mean,
    /// Median time of a decision, µs. It depends on the machine.
    pub decision_us: Mean,
}

/// All figures.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Looks of a run.
    pub steps: usize,
    /// One for each scene and participant.
    pub figures: Vec<Figures>,
    #[serde(skip)]
    curves: Vec<Curves>,
}

/// The curves of a participant in a scene, one for each seed.
#[derive(Clone, Debug)]
struct Curves {
    scene: String,
    contender: Contender,
    shares: Vec<Vec<f64>>,
    losses: Vec<Vec<f64>>,
}

/// A column of the CSV file.
type Column = (&'static str, fn(&Figures) -> Mean);

/// The runs of each participant in each scene.
type Groups<'r> = BTreeMap<(&'r str, Contender), Vec<&'r Run>>;

/// The reachable entropy of a run as a share, for each look.
fn shares(run: &Run, floor: &Run) -> Vec<f64> {
    let first = run.reachable_at_first();
    let least = floor.looks.last().map_or(0.0, |look| look.reachable);
    run.looks.iter().map(|look| (look.reachable - least) / (first - least)).collect()
}

impl Summary {
    /// The figures of runs; participants without an oracle and a floor in the same scene and seed are left out.
    pub fn of(runs: &[Run]) -> Self {
        let mut groups: Groups<'_> = BTreeMap::new();
        for run in runs {
            groups.entry((&run.scene, run.contender)).or_default().push(run);
        }
        let (mut figures, mut curves) = (Vec::new(), Vec::new());
        for ((scene, contender), runs) in &groups {
            let all: Vec<Relative> = runs
                .iter()
                .copied()
                .filter_map(|run| {
                    let oracle = beside(&groups, run, Contender::Oracle)?;
                    let floor = beside(&groups, run, Contender::Floor)?;
                    Some(Relative::of(run, oracle, floor))
                })
                .collect();
            let over = |of: &dyn Fn(&Relative) -> f64| mean(&all.iter().map(of).collect::<Vec<_>>());
            let last = |of: fn(&Measured) -> f64| over(&|one| one.run.looks.last().map_or(0.0, of));
            let reached =
                |of: &dyn Fn(&Relative) -> Option<f64>| mean(&all.iter().filter_map(of).collect::<Vec<_>>());
            let got_there = all.iter().filter(|one| one.most.is_some()).count();
            figures.push(Figures {
                scene: (*scene).to_owned(),
                contender: *contender,
                seeds: all.len(),
                log_loss: last(|look| look.log_loss),
                precision: last(|look| look.precision),
                recall: last(|look| look.recall),
                false_occupied: last(|look| look.false_occupied as f64),
                reachable: over(&|one| one.shares.last().copied().unwrap_or(1.0)),
                area: over(&|one| one.shares.iter().sum::<f64>() / one.shares.len().max(1) as f64),
                area_over_time: over(&|one| one.area_over_time()),
                entropy: over(&|one| {
                    one.run.looks.last().map_or(1.0, |look| look.entropy / one.run.initial[0])
                }),
                looks_to_half: reached(&|one| one.half.map(|look| look as f64 + 1.0)),
                looks_to_most: reached(&|one| one.most.map(|look| look as f64 + 1.0)),
                seconds_to_most: reached(&|one| one.most.map(|look| one.run.looks[look].seconds)),
                seconds_to_body: reached(&|one| one.run.found.body_s),
                seconds_to_source: reached(&|one| one.run.found.source_s),
                reached: got_there as f64 / all.len().max(1) as f64,
                travel_rad: last(|look| look.travel_rad),
                decision_us: over(&|one| one.run.decision_us),
            });
            curves.push(Curves {
                scene: (*scene).to_owned(),
                contender: *contender,
                shares: all.iter().map(|one| one.shares.clone()).collect(),
                losses: all
                    .iter()
                    .map(|one| one.run.looks.iter().map(|look| look.log_loss).collect())
                    .collect(),
            });
        }
        Self { steps: runs.first().map_or(0, |run| run.steps), figures, curves }
    }

    /// A table of one scene, at most 80 columns wide.
    pub fn table(&self, scene: &str) -> String {
        let mut table = format!(
            "{scene}\n{:<17}{:>15}{:>7}{:>7}{:>7}{:>7}{:>6}{:>6}{:>8}\n",
            "policy", "log-loss", "precis", "recall", "reach", "area", "50 %", "90 %", "µs"
        );
        let mut rows: Vec<&Figures> = self.figures.iter().filter(|one| one.scene == scene).collect();
        rows.sort_by(|a, b| a.log_loss.mean.total_cmp(&b.log_loss.mean));
        for one in rows {
            let looks = |mean: &Mean, shown: bool| match shown && mean.mean > 0.0 {
                true => format!("{:.0}", mean.mean),
                false => "–".to_owned(),
            };
            table += &format!(
                "{:<17}{:>7.4} {:<7}{:>7.3}{:>7.3}{:>6.1}%{:>6.1}%{:>6}{:>6}{:>8.0}\n",
                one.contender.name(),
                one.log_loss.mean,
                one.log_loss.standard_error.map_or(String::new(), |error| format!("±{error:.4}")),
                one.precision.mean,
                one.recall.mean,
                100.0 * one.reachable.mean,
                100.0 * one.area.mean,
                looks(&one.looks_to_half, true),
                looks(&one.looks_to_most, one.reached > 0.5),
                one.decision_us.mean,
            );
        }
        table + &self.times(scene)
    }

    /// The seconds of each participant, as lines below the table.
    fn times(&self, scene: &str) -> String {
        let mut lines = format!("{:<17}{:>12}{:>14}{:>14}\n", "", "s to 90 %", "s to body", "s to source");
        for one in self.figures.iter().filter(|one| one.scene == scene) {
            let seconds = |mean: &Mean| match mean.mean > 0.0 {
                true => format!("{:.1}", mean.mean),
                false => "–".to_owned(),
            };
            let [most, body, source] =
                [&one.seconds_to_most, &one.seconds_to_body, &one.seconds_to_source].map(seconds);
            lines += &format!("{:<17}{most:>12}{body:>14}{source:>14}\n", one.contender.name());
        }
        lines
    }

    /// The scenes, in order.
    pub fn scenes(&self) -> Vec<&str> {
        let mut scenes: Vec<&str> = self.figures.iter().map(|one| one.scene.as_str()).collect();
        scenes.dedup();
        scenes
    }

    /// Writes `summary.json`, `summary.csv`, and for each scene the curves of reachable entropy and of log-loss.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, folder: &Path) -> Result<Vec<PathBuf>, Error> {
        let mut paths = Vec::new();
        let mut write = |name: String, bytes: &[u8]| {
            let path = folder.join(name);
            write_atomically(&path, bytes)?;
            paths.push(path);
            Ok::<(), Error>(())
        };
        write(
            "summary.json".to_owned(),
            serde_json::to_string_pretty(self).expect("internal: numbers").as_bytes(),
        )?;
        write("summary.csv".to_owned(), self.csv().as_bytes())?;
        for scene in self.scenes() {
            let of = |values: fn(&Curves) -> &Vec<Vec<f64>>| -> Vec<Band> {
                let own = self.curves.iter().filter(|curves| curves.scene == scene);
                own.map(|curves| band(curves.contender.name(), values(curves))).collect()
            };
            let seeds = self.figures.iter().filter(|one| one.scene == scene).map(|one| one.seeds).max();
            let what = match seeds.unwrap_or(0) {
                1 => format!("{scene}: one seed"),
                seeds => format!("{scene}: mean of {seeds} seeds, 95 % confidence"),
            };
            for (name, quantity, curves) in [
                ("reachable", "H(O) of visible cells (1: first, 0: floor)", of(|curves| &curves.shares)),
                ("log_loss", "log-loss per visible cell (nats)", of(|curves| &curves.losses)),
            ] {
                let picture = bands(&what, ["look", quantity], &curves);
                let path = folder.join(format!("{scene}_{name}.png"));
                picture.write(&path)?;
                paths.push(path);
            }
        }
        Ok(paths)
    }

    fn csv(&self) -> String {
        let columns: [Column; 14] = [
            ("log_loss", |one| one.log_loss),
            ("precision", |one| one.precision),
            ("recall", |one| one.recall),
            ("false_occupied", |one| one.false_occupied),
            ("reachable", |one| one.reachable),
            ("area", |one| one.area),
            ("area_over_time", |one| one.area_over_time),
            ("entropy", |one| one.entropy),
            ("looks_to_half", |one| one.looks_to_half),
            ("looks_to_most", |one| one.looks_to_most),
            ("seconds_to_most", |one| one.seconds_to_most),
            ("seconds_to_body", |one| one.seconds_to_body),
            ("seconds_to_source", |one| one.seconds_to_source),
            ("travel_rad", |one| one.travel_rad),
        ];
        let names = columns.iter().map(|(name, _)| format!("{name},{name}_se")).collect::<Vec<_>>().join(",");
        let mut csv = format!("scene,policy,seeds,{names},reached,decision_us\n");
        for one in &self.figures {
            let numbers = columns.iter().map(|(_, of)| of(one));
            let numbers = numbers.map(|mean| {
                format!(
                    "{},{}",
                    mean.mean,
                    mean.standard_error.map_or(String::new(), |error| error.to_string())
                )
            });
            csv += &format!(
                "{},{},{},{},{},{}\n",
                one.scene,
                one.contender.name(),
                one.seeds,
                numbers.collect::<Vec<_>>().join(","),
                one.reached,
                one.decision_us.mean
            );
        }
        csv
    }
}

/// The run of another participant in the same scene with the same seed.
fn beside<'r>(groups: &Groups<'r>, run: &'r Run, contender: Contender) -> Option<&'r Run> {
    let others = groups.get(&(run.scene.as_str(), contender))?;
    others.iter().copied().find(|other| other.seed == run.seed)
}

/// A run beside the oracle and the floor.
struct Relative<'r> {
    run: &'r Run,
    shares: Vec<f64>,
    /// The look, from 0, at which half, and 90 %, of the oracle's reduction was reached.
    half: Option<usize>,
    most: Option<usize>,
}

impl<'r> Relative<'r> {
    fn of(run: &'r Run, oracle: &Run, floor: &Run) -> Self {
        let shares_of = |run: &Run| shares(run, floor);
        let own = shares_of(run);
        let best = 1.0 - shares_of(oracle).last().copied().unwrap_or(1.0);
        let reached = |part: f64| own.iter().position(|share| 1.0 - share >= part * best);
        let (half, most) = (reached(0.5), reached(0.9));
        Self { run, shares: own, half, most }
    }

    /// The mean share over the seconds of the run: each look's share holds until the next.
    fn area_over_time(&self) -> f64 {
        let times: Vec<f64> = self.run.looks.iter().map(|look| look.seconds).collect();
        let Some((first, last)) = times.first().zip(times.last()) else { return 1.0 };
        let held = times.windows(2).zip(&self.shares).map(|(pair, share)| (pair[1] - pair[0]) * share);
        (first + held.sum::<f64>()) / last
    }
}

/// The mean of some curves at each look with its confidence interval.
fn band(name: &str, curves: &[Vec<f64>]) -> Band {
    let looks = curves.iter().map(Vec::len).min().unwrap_or(0);
    let at = |look: usize| mean(&curves.iter().map(|curve| curve[look]).collect::<Vec<_>>());
    let points = (0..looks).map(|look| {
        let mean = at(look);
        let half_width = mean.half_width.unwrap_or(0.0);
        [(look + 1) as f64, mean.mean, mean.mean - half_width, mean.mean + half_width]
    });
    Band { name: name.to_owned(), points: points.collect() }
}
