//! Active exploration: the loop of sensing, prediction, estimation, choice of a gaze, and turning.
//!
//! In: a world and a gaze policy. Out: an [`Episode`]: the map, and a record of each step. Invariant: all policies
//! run in the same world with the same noise; only the gaze differs.

mod gaze;
mod leave;
mod page;
mod policy;
mod report;
mod score;

pub use crate::head::Gaze;
pub use gaze::Gradient;
pub use leave::Record;
pub use page::Frames;
pub use policy::{FieldOfView, Gazer, Looks, PolicyKind};
pub use report::Report;
pub use score::Score;

use crate::error::Error;
use crate::frame::wrap_angle;
use crate::head::{Head, Look, depth, run};
use crate::map::{Heading, Map};
use crate::vision::EvidenceKind;
use crate::world::World;
use crate::world::sensors::DepthCamera;
use serde::Serialize;
use std::sync::atomic::AtomicBool;

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

/// A run of one policy.
#[derive(Clone, Debug)]
pub struct Episode {
    /// The policy.
    pub policy: PolicyKind,
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

/// Explores the built-in room, with this kind of evidence from a range reading; `done` sees the map after each look.
///
/// # Errors
/// An invalid grid.
pub fn explore(
    policy: PolicyKind,
    evidence: EvidenceKind,
    steps: usize,
    seed: u64,
    done: impl FnMut(&Map, &Look),
) -> Result<Episode, Error> {
    explore_world(&World::embedded(seed), policy, evidence, steps, seed, done)
}

/// Explores a world with the fast head of [`depth`]; ends before `steps` where nothing is left to see.
///
/// # Errors
/// An invalid grid.
pub fn explore_world(
    world: &World,
    policy: PolicyKind,
    evidence: EvidenceKind,
    steps: usize,
    seed: u64,
    mut done: impl FnMut(&Map, &Look),
) -> Result<Episode, Error> {
    let mut head = depth::head(world.clone(), evidence, seed)?;
    let (camera, grid) = (DepthCamera::default(), head.map().grid());
    let mut gazer = Gazer::new(policy, &camera, grid, depth::MOST_TILT, seed);
    let initial = entropies(head.map());
    let mut looks = Vec::with_capacity(steps);
    let never = AtomicBool::new(false);
    run(&mut head, &mut gazer, &mut looks, steps, None, &never, |map, look| done(map, look))?;
    Ok(Episode::of(policy, initial, head, looks, world))
}

/// Σ H(O, V) and Σ H(O) of a map, nats.
pub fn entropies(map: &Map) -> [f64; 2] {
    let sum = |values: &[f32]| values.iter().map(|value| f64::from(*value)).sum::<f64>();
    [sum(map.entropy()), sum(map.occupancy_entropy())]
}

impl Episode {
    /// The end of a run of a head in a world; `initial` are the [`entropies`] before it.
    pub fn of(policy: PolicyKind, initial: [f64; 2], head: Head, looks: Vec<Look>, world: &World) -> Self {
        let looked_s = looks.last().map_or(0.0, |look| look.time_s);
        let score = Score::of(head.map(), &world.truth_state(head.map().grid(), looked_s));
        let (heading, time_s) = (head.attitude().heading(), head.time_s());
        let steps = looks.iter().map(Step::from).collect();
        Self { policy, initial, steps, looks, map: head.into_map(), score, heading, time_s }
    }
}
