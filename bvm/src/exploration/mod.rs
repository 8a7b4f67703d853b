//! Active exploration: the loop of sensing, prediction, estimation, choice of a gaze, and turning.
//!
//! In: a world and a gaze strategy. Out: an [`Episode`]: the map, and a record of each step. Invariant: all strategies
//! run in the same world with the same noise; only the gaze differs.

mod gaze;
mod report;
mod score;

pub use gaze::{Gaze, Gradient, View};
pub use report::Report;
pub use score::Score;

use crate::audition::Hearing;
use crate::error::Error;
use crate::frame::wrap_angle;
use crate::grid::{Grid, GridConfiguration};
use crate::map::{Heading, Map};
use crate::vestibular::{Balance, Vestibular};
use crate::vision::{EvidenceKind, Sight};
use crate::world::sensors::{DepthCamera, Ears, Gyroscope, Pose, turn_profile};
use crate::world::{World, seeded};
use rand::{Rng, RngExt};
use serde::Serialize;

/// Time between looks, seconds.
const STEP_S: f64 = 0.5;

/// Most tilt of the camera, rad.
const MOST_TILT: f64 = 1.1;

/// A gaze strategy.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Rule {
    /// The most entropy in view: `models/view.bp`.
    View,
    /// The steepest entropy at the frontier, as the paper prints it: `models/gaze.bp`.
    Gradient,
    /// Uniformly random on the sphere.
    Random,
    /// A sweep around, at three elevations.
    Sweep,
}

impl Rule {
    /// All of them, the default first.
    pub const ALL: [Rule; 4] = [Rule::View, Rule::Gradient, Rule::Random, Rule::Sweep];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Rule::View => "entropy in view",
            Rule::Gradient => "entropy gradient",
            Rule::Random => "random gaze",
            Rule::Sweep => "sweep",
        }
    }
}

/// The record of a step.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Step {
    /// The gaze, in the map's frame.
    pub gaze: Gaze,
    /// True yaw, rad to the left.
    pub true_yaw: f64,
    /// Estimated yaw, rad to the left.
    pub estimated_yaw: f64,
    /// Whether a sound was heard.
    pub heard: bool,
    /// Number of directions with a range.
    pub readings: usize,
    /// Σ H(O, V) over the map after the step, nats.
    pub entropy: f64,
    /// Σ H(O) over the map after the step, nats.
    pub occupancy_entropy: f64,
}

/// A run of one strategy.
#[derive(Clone, Debug)]
pub struct Episode {
    /// The strategy.
    pub rule: Rule,
    /// Entropies before the first step: Σ H(O, V) and Σ H(O), nats.
    pub initial: [f64; 2],
    /// The steps.
    pub steps: Vec<Step>,
    /// The map at the end.
    pub map: Map,
    /// The final map compared with the world at the last look.
    pub score: Score,
    /// Yaw at the end.
    pub heading: Heading,
    /// World time at the end, s.
    pub time_s: f64,
}

/// Explores the simulated world, with this kind of evidence from a range reading.
///
/// # Errors
/// An invalid grid.
pub fn explore(
    rule: Rule,
    evidence: EvidenceKind,
    steps: usize,
    seed: u64,
    mut done: impl FnMut(),
) -> Result<Episode, Error> {
    let grid = Grid::new(GridConfiguration::default_exploration())?;
    let world = World::embedded(seed);
    let (camera, ears, gyroscope) = (DepthCamera::default(), Ears::default(), Gyroscope::default());
    let mut noise = ["sight", "hearing", "balance", "gaze"].map(|purpose| seeded(seed, purpose));
    let mut map = Map::new(grid.clone())?;
    let mut hearing = Hearing::calibrated(&grid);
    let mut sight = Sight::default();
    let (mut view, mut gradient) = (View::of(&camera, &grid, MOST_TILT), Gradient::default());
    let mut balance = Vestibular::at_rest(Balance::Gyroscope)?;
    let sum = |values: &[f32]| values.iter().map(|value| f64::from(*value)).sum::<f64>();
    let initial = [sum(map.entropy()), sum(map.occupancy_entropy())];
    let (mut true_yaw, mut time_s, mut looked_s) = (0.0, 0.0, 0.0);
    let mut gaze = Gaze::at(0.0, 0.0);
    let mut history = Vec::with_capacity(steps);
    for number in 0..steps {
        let heading = Heading { yaw: balance.yaw() };
        let pose = Pose { yaw: true_yaw, heading, pitch: gaze.elevation };
        let readings = camera.look(&world, &grid, pose, time_s, &mut noise[0]);
        let seen = sight.likelihood(&grid, &readings, camera.sigma_min_m, evidence)?;
        let cues = ears.hear(&world, true_yaw, &mut noise[1]);
        let heard = match &cues {
            None => None,
            Some(cues) => Some(hearing.turned(heading).likelihood(cues)?),
        };
        let likelihoods: Vec<_> = std::iter::once(&seen).chain(&heard).collect();
        map.observe(&likelihoods)?;
        history.push(Step {
            gaze: Gaze { azimuth: wrap_angle(gaze.azimuth), ..gaze },
            true_yaw: wrap_angle(true_yaw),
            estimated_yaw: wrap_angle(heading.yaw),
            heard: heard.is_some(),
            readings: readings.iter().flatten().count(),
            entropy: sum(map.entropy()),
            occupancy_entropy: sum(map.occupancy_entropy()),
        });
        gaze = match rule {
            Rule::View => view.choose(&map, &heading)?,
            Rule::Gradient => gradient.choose(&map, &heading)?,
            Rule::Random => random_gaze(&mut noise[3]),
            Rule::Sweep => sweep_gaze(number + 1, camera.field_degrees),
        };
        gaze.elevation = gaze.elevation.clamp(-MOST_TILT, MOST_TILT);
        let turn = heading.relative(gaze.azimuth);
        for rate in turn_profile(turn, Vestibular::DT) {
            true_yaw += rate * Vestibular::DT;
            balance.feel(gyroscope.measure(rate, &mut noise[2]))?;
        }
        (looked_s, time_s) = (time_s, time_s + STEP_S);
        done();
    }
    let heading = Heading { yaw: balance.yaw() };
    let score = Score::of(&map, &world.truth_state(&grid, looked_s));
    Ok(Episode { rule, initial, steps: history, map, score, heading, time_s })
}

fn random_gaze(random: &mut impl Rng) -> Gaze {
    let azimuth = random.random_range(-std::f64::consts::PI..std::f64::consts::PI);
    let elevation = random.random_range(-1.0..1.0f64).asin();
    Gaze::at(azimuth, elevation)
}

/// A sweep of adjacent fields of view: around the horizon, then above, then below.
fn sweep_gaze(number: usize, [across, upwards]: [f64; 2]) -> Gaze {
    let around = (360.0 / across).ceil() as usize;
    let elevation = [0.0, upwards, -upwards][(number / around) % 3].to_radians();
    let azimuth = ((number % around) as f64 * across).to_radians();
    Gaze::at(azimuth, elevation)
}
