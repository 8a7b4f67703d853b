//! Gaze policies: the next gaze from the map, and from where the head looked before.
//!
//! In: the map and the heading after each look. Out: a [`Gaze`]. The objective of each policy is a Bayesian Program in
//! `bvm/models`; here its inputs are gathered, and its answer is summed over the field of view ([`FieldOfView`]).
//! Invariant: the same seed and situations give the same gazes, for any number of threads.

mod field_of_view;
mod worth;

pub use field_of_view::{FieldOfView, Looks};

use crate::error::Error;
use crate::grid::Grid;
use crate::head::{Coverage, Gaze, Policy};
use crate::map::{Heading, Likelihood, Map, shift::solid_angles};
use crate::programs::{random, sweep};
use crate::world::sensors::DepthCamera;
use crate::world::{Random, seeded};
use bp_core::compiler::answer::argmax;
use rand::RngExt;
use serde::{Deserialize, Serialize};
use worth::Worth;

/// More looks at a direction count as this many, with the same share of readings: a surface does not stay for ever.
const MOST_LOOKS: f32 = 20.0;

/// A gaze policy.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PolicyKind {
    /// The paper's gradient, with unseen directions as candidates and inhibition of return, summed over the field of
    /// view: `models/inhibited.bp`.
    Inhibited,
    /// The steepest entropy at the frontier, as the paper prints it: `models/paper.bp`.
    Paper,
    /// The most entropy in view: `models/entropy_in_view.bp`.
    View,
    /// The expected information of readings along the rays in view: `models/information_gain.bp`.
    InformationGain,
    /// Uncertainty, saliency of motion and sound, inhibition of return: `models/attention.bp`.
    Attention,
    /// Inhibition of return without a map: `models/null.bp`.
    Null,
    /// Uniformly random on the sphere: `models/random.bp`.
    Random,
    /// A sweep around, at three elevations: `models/sweep.bp`.
    Sweep,
}

impl PolicyKind {
    /// All policies, the default first.
    pub const ALL: [PolicyKind; 8] = [
        PolicyKind::Inhibited,
        PolicyKind::Paper,
        PolicyKind::View,
        PolicyKind::InformationGain,
        PolicyKind::Attention,
        PolicyKind::Null,
        PolicyKind::Random,
        PolicyKind::Sweep,
    ];

    /// Its name in commands and files.
    pub fn name(self) -> &'static str {
        match self {
            PolicyKind::Inhibited => "inhibited",
            PolicyKind::Paper => "paper",
            PolicyKind::View => "view",
            PolicyKind::InformationGain => "information-gain",
            PolicyKind::Attention => "attention",
            PolicyKind::Null => "null",
            PolicyKind::Random => "random",
            PolicyKind::Sweep => "sweep",
        }
    }

    /// The policy of a head, for a camera that tilts by at most `most_tilt` radians.
    pub fn policy(self, map: &Map, camera: &DepthCamera, most_tilt: f64, seed: u64) -> Box<dyn Policy> {
        Box::new(Gazer::new(self, camera, map.grid(), most_tilt, seed))
    }

    /// The policy of a name.
    pub fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|policy| policy.name() == name)
    }
}

/// A policy with its memory: what was in view when, and its random numbers.
#[derive(Clone, Debug)]
pub struct Gazer {
    kind: PolicyKind,
    field: FieldOfView,
    looks: Looks,
    number: usize,
    /// The elevation of the last gaze, rad.
    elevation: f64,
    most_tilt: f64,
    heard: Option<Likelihood>,
    /// Of each direction: looks with a reading, and without.
    counts: [Vec<f32>; 2],
    worth: Worth,
    random: Random,
    /// Fields of view around the horizon, and the vertical angle of one, rad.
    sweep: (usize, f64, f64),
    solid_angles: Vec<f32>,
}

impl Gazer {
    /// A policy for a camera that tilts by at most `most_tilt` radians, and a grid. The seed is that of the run; only `random` uses it.
    pub fn new(kind: PolicyKind, camera: &DepthCamera, grid: &Grid, most_tilt: f64, seed: u64) -> Self {
        let field = FieldOfView::of(camera, grid, most_tilt);
        let [across, upwards] = camera.field_degrees;
        Self {
            kind,
            looks: Looks::none(grid.directions()),
            number: 0,
            elevation: 0.0,
            most_tilt,
            heard: None,
            counts: [vec![0.0; grid.directions()], vec![0.0; grid.directions()]],
            worth: Worth::new(grid),
            random: seeded(seed, "gaze"),
            sweep: ((360.0 / across).ceil() as usize, across.to_radians(), upwards.to_radians()),
            solid_angles: solid_angles(grid).into_iter().map(|angle| angle as f32).collect(),
            field,
        }
    }

    /// The policy.
    pub fn kind(&self) -> PolicyKind {
        self.kind
    }

    /// The field of view.
    pub fn field(&self) -> &FieldOfView {
        &self.field
    }

    /// Takes note of a look, of what it has in view.
    fn note(&mut self, grid: &Grid, heading: &Heading) {
        let seen = grid.direction_of(crate::frame::wrap_angle(heading.yaw), self.elevation);
        if let Some(seen) = seen {
            self.looks.look(&self.field, grid.direction_index(seen));
        }
        self.number += 1;
    }

    /// A draw from `random.bp`.
    fn drawn(&mut self, grid: &Grid) -> Result<Option<Gaze>, Error> {
        let count = self.field.directions();
        let answer = random::gaze().directions(count).solid_angle(&self.solid_angles).ask()?;
        let weights = answer.distribution();
        let total: f64 = weights.iter().map(|weight| f64::from(*weight)).sum();
        let mut rest = total * self.random.random_range(0.0..1.0);
        let drawn = weights.iter().position(|weight| {
            rest -= f64::from(*weight);
            rest < 0.0
        });
        let direction = grid.direction(drawn.unwrap_or(count - 1));
        Ok(direction.map(|direction| {
            let (azimuth, elevation) = grid.direction_centre(direction);
            Gaze::at(azimuth, elevation)
        }))
    }

    /// The next of `sweep.bp`.
    fn swept(&self) -> Result<Gaze, Error> {
        let (around, across, upwards) = self.sweep;
        let looks = 3 * around;
        // The head begins ahead, which is the first look of the sweep.
        let look = (self.number % looks + 1) as i64;
        let answer = sweep::gaze().around(around).looks(looks).look(look).ask()?;
        let (column, level) = answer.argmax().unwrap_or((1, 1));
        let elevation = [0.0, upwards, -upwards][(level - 1) as usize];
        Ok(Gaze::at((column - 1) as f64 * across, elevation))
    }
}

impl Policy for Gazer {
    /// The next gaze; its tilt is within that of the camera. Straight ahead where no direction is worth a look.
    fn choose(&mut self, map: &Map, heading: &Heading) -> Result<Gaze, Error> {
        let grid = map.grid();
        self.note(grid, heading);
        let heard = self.heard.take();
        let away = || self.field.away(heading.yaw);
        let summed = |worth: &[f32]| best(grid, &self.field.sums(worth), &away(), None);
        let chosen = match self.kind {
            PolicyKind::Inhibited => summed(self.worth.inhibited(map, &self.looks, &self.counts)?),
            PolicyKind::View => summed(self.worth.entropy_in_view(map)?),
            PolicyKind::InformationGain => summed(self.worth.information_gain(map)?),
            PolicyKind::Null => summed(self.worth.null(&self.looks)?),
            PolicyKind::Attention => {
                best(grid, self.worth.attention(map, &self.looks, heard.as_ref())?, &away(), None)
            }
            PolicyKind::Paper => {
                let (worth, ranges) = self.worth.paper(map)?;
                best(grid, &worth, &away(), Some(&ranges))
            }
            PolicyKind::Random => self.drawn(grid)?,
            PolicyKind::Sweep => Some(self.swept()?),
        };
        let gaze = chosen.unwrap_or_else(|| Gaze::at(heading.yaw, 0.0));
        Ok(Gaze { elevation: gaze.elevation.clamp(-self.most_tilt, self.most_tilt), ..gaze })
    }

    fn sensed(&mut self, sense: &str, likelihood: &Likelihood) {
        if sense == "hearing" && self.kind == PolicyKind::Attention {
            self.heard = Some(likelihood.clone());
        }
    }

    fn covered(&mut self, coverage: &Coverage) {
        let (looks, readings) = coverage.counts();
        let [read, silent] = &mut self.counts;
        for (at, (looks, readings)) in looks.iter().zip(readings).enumerate() {
            let (looks, readings) = (f32::from(*looks), f32::from(*readings));
            let share = if looks > MOST_LOOKS { MOST_LOOKS / looks } else { 1.0 };
            (read[at], silent[at]) = (share * readings, share * (looks - readings));
        }
    }

    fn turned(&mut self, gaze: &Gaze) {
        self.elevation = gaze.elevation;
    }
}

/// The direction with the best score, the nearest of equals; none if no score is positive.
fn best(grid: &Grid, scores: &[f32], away: &[f32], ranges: Option<&[f64]>) -> Option<Gaze> {
    let index = *argmax(scores, Some(away)).first()?;
    let (azimuth, elevation) = grid.direction_centre(grid.direction(index)?);
    let range_m = ranges.map(|ranges| ranges[index]);
    Some(Gaze { azimuth, elevation, score: f64::from(scores[index]), range_m })
}
