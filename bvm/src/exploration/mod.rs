//! Active exploration: the loop of sensing, prediction, estimation, choice of a gaze, and turning.
//!
//! In: a world and a gaze strategy. Out: an [`Episode`]: the map, and a record of each step. Invariant: all strategies
//! run in the same world with the same noise; only the gaze differs.

mod gaze;
mod report;
mod score;

pub use crate::head::Gaze;
pub use gaze::{Gradient, View};
pub use report::Report;
pub use score::Score;

use crate::error::Error;
use crate::frame::wrap_angle;
use crate::head::{Head, Look, Policy, depth, run};
use crate::map::{Heading, Map};
use crate::vision::EvidenceKind;
use crate::world::sensors::DepthCamera;
use crate::world::{World, seeded};
use rand::{Rng, RngExt};
use serde::Serialize;
use std::sync::atomic::AtomicBool;

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

impl From<&Look> for Step {
    fn from(look: &Look) -> Self {
        let readings = |sense: usize| look.senses.get(sense).map_or(0, |one| one.readings);
        Self {
            gaze: look.gaze,
            true_yaw: look.truth.map_or(look.attitude.yaw, |truth| truth.yaw),
            estimated_yaw: wrap_angle(look.attitude.yaw),
            heard: look.senses.len() > 2 && readings(1) > 0,
            readings: readings(0),
            entropy: look.entropy,
            occupancy_entropy: look.occupancy_entropy,
        }
    }
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
    /// The same with what each sense gave and each stage took.
    pub looks: Vec<Look>,
    /// The map at the end.
    pub map: Map,
    /// The final map compared with the world at the last look.
    pub score: Score,
    /// Yaw at the end.
    pub heading: Heading,
    /// World time at the end, s.
    pub time_s: f64,
}

/// Explores the built-in room, with this kind of evidence from a range reading.
///
/// # Errors
/// An invalid grid.
pub fn explore(
    rule: Rule,
    evidence: EvidenceKind,
    steps: usize,
    seed: u64,
    done: impl FnMut(),
) -> Result<Episode, Error> {
    explore_world(&World::embedded(seed), rule, evidence, steps, seed, done)
}

/// Explores a world with the fast head of [`depth`]; ends before `steps` where nothing is left to see.
///
/// # Errors
/// An invalid grid.
pub fn explore_world(
    world: &World,
    rule: Rule,
    evidence: EvidenceKind,
    steps: usize,
    seed: u64,
    mut done: impl FnMut(),
) -> Result<Episode, Error> {
    let mut head = depth::head(world.clone(), evidence, seed)?;
    let mut policy = rule.policy(head.map(), &DepthCamera::default(), depth::MOST_TILT, seed);
    let initial = entropies(head.map());
    let mut looks = Vec::with_capacity(steps);
    let never = AtomicBool::new(false);
    run(&mut head, policy.as_mut(), &mut looks, steps, None, &never, |_| done())?;
    Ok(Episode::of(rule, initial, head, looks, world))
}

/// Σ H(O, V) and Σ H(O) of a map, nats.
pub fn entropies(map: &Map) -> [f64; 2] {
    let sum = |values: &[f32]| values.iter().map(|value| f64::from(*value)).sum::<f64>();
    [sum(map.entropy()), sum(map.occupancy_entropy())]
}

impl Episode {
    /// The end of a run of a head in a world; `initial` are the [`entropies`] before it.
    pub fn of(rule: Rule, initial: [f64; 2], head: Head, looks: Vec<Look>, world: &World) -> Self {
        let looked_s = looks.last().map_or(0.0, |look| look.time_s);
        let score = Score::of(head.map(), &world.truth_state(head.map().grid(), looked_s));
        let (heading, time_s) = (head.attitude().heading(), head.time_s());
        let steps = looks.iter().map(Step::from).collect();
        Self { rule, initial, steps, looks, map: head.into_map(), score, heading, time_s }
    }
}

impl Rule {
    /// The policy of the strategy, for a camera that tilts by at most `most_tilt` radians.
    pub fn policy(self, map: &Map, camera: &DepthCamera, most_tilt: f64, seed: u64) -> Box<dyn Policy> {
        let mut noise = seeded(seed, "gaze");
        let field = camera.field_degrees;
        let mut number = 0;
        match self {
            Rule::View => Box::new(View::of(camera, map.grid(), most_tilt)),
            Rule::Gradient => Box::new(Gradient::default()),
            Rule::Random => Box::new(move |_: &Map, _: &Heading| Ok(random_gaze(&mut noise))),
            Rule::Sweep => Box::new(move |_: &Map, _: &Heading| {
                number += 1;
                Ok(sweep_gaze(number, field))
            }),
        }
    }
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
