//! The report of a run as one page of HTML, which needs no other file and no network.
//!
//! In: episodes of a world, and what [`Frames`] kept of the first. Out: the page: entropies, the map in three
//! dimensions, panoramas over time, what each sense contributed, and times. Invariant: the data are in the page; its
//! script draws them.

use super::{Episode, Score};
use crate::export::Point;
use crate::grid::Grid;
use crate::head::Look;
use crate::map::{Map, OCCUPIED};
use crate::report::{ReportError, first_occupied_range};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;

/// The most panoramas of a page.
const MOST_FRAMES: usize = 60;

/// Margin by which a cell must be more likely occupied than not to be the first occupied one.
const MARGIN: f32 = OCCUPIED - 0.5;

/// The panoramas of a run.
#[derive(Clone, Debug)]
pub struct Frames {
    every: usize,
    looks: Vec<usize>,
    frames: Vec<String>,
}

impl Frames {
    /// Of a run of so many looks; of a long run, every second, third, … look is kept.
    pub fn of(steps: usize) -> Self {
        Self { every: steps.div_ceil(MOST_FRAMES).max(1), looks: Vec::new(), frames: Vec::new() }
    }

    /// Keeps the panorama of a look.
    ///
    /// # Errors
    /// None that a map gives.
    pub fn add(&mut self, map: &Map, look: &Look) -> Result<(), ReportError> {
        if look.number % self.every == 1 % self.every {
            self.end(map, look.number)?;
        }
        Ok(())
    }

    /// Keeps the panorama of the last look, unless it has it.
    ///
    /// # Errors
    /// None that a map gives.
    pub fn end(&mut self, map: &Map, number: usize) -> Result<(), ReportError> {
        if self.looks.last() != Some(&number) {
            self.looks.push(number);
            self.frames.push(STANDARD.encode(panorama(map.grid(), map)?));
        }
        Ok(())
    }
}

/// The first occupied range of each direction, in 254 steps of its logarithm; 255 for none.
fn panorama(grid: &Grid, map: &Map) -> Result<Vec<u8>, ReportError> {
    let [near, far] = [grid.configuration().rho_min_m, grid.configuration().rho_max_m];
    let ranges = first_occupied_range(grid, map.occupancy(), MARGIN)?;
    let byte = |range: f64| match range.is_nan() {
        true => 255,
        false => (254.0 * ((range / near).ln() / (far / near).ln()).clamp(0.0, 1.0)).round() as u8,
    };
    Ok(ranges.into_iter().map(byte).collect())
}

#[derive(Serialize)]
struct Data<'a> {
    title: String,
    about: String,
    files: String,
    rows: usize,
    columns: usize,
    policies: Vec<Curves>,
    looks: &'a [Look],
    panoramas: Panoramas<'a>,
    points: Points,
}

#[derive(Serialize)]
struct Curves {
    name: &'static str,
    /// In percent of the entropy before the first look, which is the first of the numbers.
    entropy: Vec<f64>,
    occupancy_entropy: Vec<f64>,
    mean: f64,
    score: Score,
}

#[derive(Serialize)]
struct Panoramas<'a> {
    looks: &'a [usize],
    frames: &'a [String],
    range_m: [f64; 2],
    omitted: String,
}

#[derive(Serialize)]
struct Points {
    /// Single-precision numbers, little-endian: x, y, z, P(O = 1), the width of the cell, and the velocity.
    data: String,
    /// The lowest and the highest, m.
    heights: [f32; 2],
}

/// The page of a run. `title` names the scene; `files` says what is beside the page.
pub(super) fn page(
    title: &str,
    files: &str,
    episodes: &[Episode],
    frames: &Frames,
    points: &[Point],
) -> Option<String> {
    let first = episodes.first().filter(|first| !first.looks.is_empty())?;
    let grid = first.map.grid();
    let others = episodes[1..].iter().map(|other| other.policy.name()).collect::<Vec<_>>().join(", ");
    let beside =
        if others.is_empty() { others } else { format!(", and beside it {others}, in the same world") };
    let data = Data {
        title: title.to_owned(),
        about: format!(
            "{} looks with the policy “{}”{beside}. {}.",
            first.steps.len(),
            first.policy.name(),
            crate::frame::DESCRIPTION
        ),
        files: files.to_owned(),
        rows: grid.elevation_cells(),
        columns: grid.azimuth_cells(),
        policies: episodes.iter().map(curves).collect(),
        looks: &first.looks,
        panoramas: Panoramas {
            looks: &frames.looks,
            frames: &frames.frames,
            range_m: [grid.configuration().rho_min_m, grid.configuration().rho_max_m],
            omitted: match frames.every {
                1 if frames.looks.len() >= first.looks.len() => "Each look has a panorama.".to_owned(),
                1 => format!(
                    "The {} looks before the run was resumed have no panorama.",
                    first.looks.len() - frames.looks.len()
                ),
                every => {
                    format!("One look in {every}, and the last, has a panorama; the others are left out.")
                }
            },
        },
        points: cloud(grid, points),
    };
    // No text in the data may end the script that holds them.
    let json = serde_json::to_string(&data).expect("internal: figures are numbers").replace("</", "<\\/");
    let page = include_str!("page.html").replace("@SCRIPT@", include_str!("page.js"));
    Some(page.replace("@DATA@", &json))
}

fn curves(episode: &Episode) -> Curves {
    let shares = |of: fn(&super::Step) -> f64, first: f64| -> Vec<f64> {
        let rest = episode.steps.iter().map(|step| 100.0 * of(step) / first);
        std::iter::once(100.0).chain(rest).collect()
    };
    let entropy = shares(|step| step.entropy, episode.initial[0]);
    let mean = entropy[1..].iter().sum::<f64>() / (entropy.len() - 1).max(1) as f64;
    let occupancy_entropy = shares(|step| step.occupancy_entropy, episode.initial[1]);
    Curves { name: episode.policy.name(), entropy, occupancy_entropy, mean, score: episode.score }
}

fn cloud(grid: &Grid, points: &[Point]) -> Points {
    let heights = points.iter().map(|point| point.place[2]);
    let (low, high) = heights.fold((-0.1f32, 0.1f32), |(low, high), z| (low.min(z), high.max(z)));
    let numbers = points.iter().flat_map(|point| {
        let distance = point.place.iter().map(|part| part * part).sum::<f32>().sqrt();
        let width = distance * grid.elevation_step() as f32;
        point.place.into_iter().chain([point.occupancy, width]).chain(point.velocity)
    });
    let data: Vec<u8> = numbers.flat_map(f32::to_le_bytes).collect();
    Points { data: STANDARD.encode(data), heights: [low, high] }
}
