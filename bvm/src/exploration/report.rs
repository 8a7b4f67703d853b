//! The report of a run: pictures and figures.
//!
//! In: the episodes of some policies in one world. Out: PNG pictures and `run.json`. Invariant: each file is written whole
//! or not at all; the map shown is that of the first policy.

use super::{Episode, PolicyKind, Score, Step};
use crate::error::Error;
use crate::frame::wrap_angle;
use crate::head::Account;
use crate::map::OCCUPIED;
use crate::report::{
    ColourMap, Panorama, Picture, Series, TopView, Window, entropy_curves, first_occupied_range, mean,
    panorama, top_view, write_atomically,
};
use crate::vision::EvidenceKind;
use crate::world::World;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Margin by which a cell must be more likely occupied than not to be drawn as the first occupied one.
const MARGIN: f32 = OCCUPIED - 0.5;

/// A run, as in `run.json`.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Axes and angles of the map.
    frame: &'static str,
    scene: String,
    seed: u64,
    steps: usize,
    /// The evidence from a range reading.
    evidence: EvidenceKind,
    grid: crate::grid::GridConfiguration,
    policies: Vec<PolicyReport>,
    /// The scene, and what the senses gave.
    #[serde(skip_serializing_if = "Option::is_none")]
    run: Option<Account>,
}

#[derive(Clone, Debug, Serialize)]
struct PolicyReport {
    policy: PolicyKind,
    /// Σ H(O, V) before the first step, nats.
    initial_entropy: f64,
    /// Σ H(O, V) after the last step, as a share of the initial one.
    final_entropy_share: f64,
    /// Σ H(O) after the last step, as a share of the initial one.
    final_occupancy_entropy_share: f64,
    /// Mean share of the initial Σ H(O, V) over the run: the area under its curve.
    area_under_entropy: f64,
    /// Mean share of the initial Σ H(O) over the run.
    area_under_occupancy_entropy: f64,
    /// The map after the last look compared with the truth.
    #[serde(flatten)]
    score: Score,
    /// Largest error of the estimated yaw, degrees.
    worst_yaw_error_degrees: f64,
    steps: Vec<Step>,
}

impl Report {
    /// Collects the figures of a run in a scene.
    pub fn new(scene: &str, seed: u64, evidence: EvidenceKind, episodes: &[Episode]) -> Self {
        let policies = episodes.iter().map(|episode| {
            let share = |value: &dyn Fn(&Step) -> f64, initial: f64| {
                let shares: Vec<f64> = episode.steps.iter().map(|step| value(step) / initial).collect();
                let mean = shares.iter().sum::<f64>() / shares.len().max(1) as f64;
                (shares.last().copied().unwrap_or(1.0), mean)
            };
            let (last, area) = share(&|step| step.entropy, episode.initial[0]);
            let (last_occupancy, area_occupancy) = share(&|step| step.occupancy_entropy, episode.initial[1]);
            let error = |step: &Step| wrap_angle(step.true_yaw - step.estimated_yaw).abs().to_degrees();
            PolicyReport {
                policy: episode.policy,
                initial_entropy: episode.initial[0],
                final_entropy_share: last,
                final_occupancy_entropy_share: last_occupancy,
                area_under_entropy: area,
                area_under_occupancy_entropy: area_occupancy,
                score: episode.score,
                worst_yaw_error_degrees: episode.steps.iter().map(error).fold(0.0, f64::max),
                steps: episode.steps.clone(),
            }
        });
        let grid = episodes.first().map(|episode| *episode.map.grid().configuration());
        Self {
            frame: crate::frame::DESCRIPTION,
            scene: scene.to_owned(),
            seed,
            evidence,
            steps: episodes.first().map_or(0, |episode| episode.steps.len()),
            grid: grid.unwrap_or_else(crate::grid::GridConfiguration::default_exploration),
            policies: policies.collect(),
            run: None,
        }
    }

    /// The same with the account of a scene.
    pub fn with(self, account: Account) -> Self {
        Self { run: Some(account), ..self }
    }

    /// A table of the policies, under 80 columns.
    pub fn table(&self) -> String {
        let mut table = format!(
            "{:<17}{:>7}{:>8}{:>11}{:>10}{:>7}{:>8}{:>11}\n",
            "gaze", "last H", "mean H", "mean H(O)", "log-loss", "false", "found", "yaw error"
        );
        for policy in &self.policies {
            table += &format!(
                "{:<17}{:>6.1}%{:>7.1}%{:>10.1}%{:>10.4}{:>7}{:>7.1}%{:>10.2}°\n",
                policy.policy.name(),
                100.0 * policy.final_entropy_share,
                100.0 * policy.area_under_entropy,
                100.0 * policy.area_under_occupancy_entropy,
                policy.score.log_loss,
                policy.score.false_occupied,
                100.0 * policy.score.found,
                policy.worst_yaw_error_degrees
            );
        }
        table
            + "
H          entropy of the map (H(O): without motion), after the last look and on
           average over all looks, in percent of the entropy before the first
log-loss   mean -ln P of what is true, nats for each cell that can be seen
false      free cells taken for occupied, but for those just before a surface
found      cells with a surface in sight that are taken for occupied
yaw error  largest difference between the estimated yaw and the true one"
    }

    /// Writes the folder; returns the paths, in order.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, folder: &Path, world: &World, episodes: &[Episode]) -> Result<Vec<PathBuf>, Error> {
        std::fs::create_dir_all(folder)
            .map_err(|source| Error::Folder { path: folder.to_owned(), source })?;
        let mut files: Vec<(&str, Picture)> = vec![
            (
                "entropy.png",
                curves("Entropy of the map, by gaze policy", episodes, |episode| {
                    let rest = episode.steps.iter().map(|step| step.entropy);
                    std::iter::once(episode.initial[0]).chain(rest).collect()
                })?,
            ),
            (
                "entropy_of_occupancy.png",
                curves("Entropy of occupancy alone", episodes, |episode| {
                    let rest = episode.steps.iter().map(|step| step.occupancy_entropy);
                    std::iter::once(episode.initial[1]).chain(rest).collect()
                })?,
            ),
        ];
        if let Some(episode) = episodes.first() {
            files.extend(pictures(world, episode)?);
        }
        let mut paths = Vec::new();
        for (name, picture) in files {
            let path = folder.join(name);
            picture.write(&path)?;
            paths.push(path);
        }
        let path = folder.join("run.json");
        let json = serde_json::to_string_pretty(self).expect("internal: figures are numbers");
        write_atomically(&path, json.as_bytes())?;
        paths.push(path);
        Ok(paths)
    }
}

fn curves(
    title: &str,
    episodes: &[Episode],
    values: impl Fn(&Episode) -> Vec<f64>,
) -> Result<Picture, Error> {
    let series: Vec<Series> = episodes
        .iter()
        .map(|episode| Series { name: episode.policy.name().to_owned(), values: values(episode), band: None })
        .collect();
    Ok(entropy_curves(title, &series)?)
}

fn pictures(world: &World, episode: &Episode) -> Result<Vec<(&'static str, Picture)>, Error> {
    let grid = episode.map.grid();
    let path: Vec<(f64, f64)> =
        episode.steps.iter().map(|step| (step.gaze.azimuth, step.gaze.elevation)).collect();
    let draw = |title: &str, quantity: &str, values: &[f64], colours, limits, gaze_path: &[(f64, f64)]| {
        panorama(
            grid,
            &Panorama { title, quantity, values, colours, limits, window: Window::default(), gaze_path },
        )
    };
    let configuration = grid.configuration();
    let near = Some([configuration.rho_max_m, configuration.rho_min_m]);
    let ranges = first_occupied_range(grid, episode.map.occupancy(), MARGIN)?;
    let entropies = mean(grid, episode.map.entropy())?;
    let truth = |point: [f64; 3]| world.plan(point, episode.time_s);
    let what = TopView {
        occupancy: episode.map.occupancy(),
        truth: Some(&truth),
        heading: episode.heading.yaw,
        field: crate::world::sensors::DepthCamera::default().field_degrees[0].to_radians(),
        band: 10f64.to_radians(),
    };
    Ok(vec![
        (
            "occupancy_panorama.png",
            draw("First occupied cell", "range (m)", &ranges, ColourMap::Sequential, near, &[])?,
        ),
        (
            "entropy_panorama.png",
            draw(
                "Mean entropy along each line of sight",
                "H (nats)",
                &entropies,
                ColourMap::Sequential,
                None,
                &[],
            )?,
        ),
        (
            "gaze_path.png",
            draw("Gazes of the head", "H (nats)", &entropies, ColourMap::Sequential, None, &path)?,
        ),
        ("top_view.png", top_view(grid, &what)?),
    ])
}
