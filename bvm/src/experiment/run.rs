//! One run of the experiment, measured after each look.
//!
//! In: a scene, a participant, a seed. Out: [`Run`], which is written as JSON. Invariant: all numbers but the times of
//! decisions depend on scene, participant and seed only.

use super::contender::Contender;
use super::floor::AllRound;
use super::found::Found;
use crate::error::Error;
use crate::exploration::Score;
use crate::grid::{Grid, GridConfiguration};
use crate::head::{depth, real};
use crate::map::Map;
use crate::vision::EvidenceKind;
use crate::world::scene::Scene;
use crate::world::sensors::DepthCamera;
use crate::world::{CellTruth, World};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The state after a look.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// Seconds since the beginning: ½ s a look, and the time of the turns.
    pub seconds: f64,
    /// How far the head has turned, rad.
    pub travel_rad: f64,
    /// Σ H(O, V) over the map, nats.
    pub entropy: f64,
    /// Σ H(O) over the map, nats.
    pub occupancy_entropy: f64,
    /// Σ H(O) over the cells that the truth says are visible, nats.
    pub reachable: f64,
    /// Number of visible cells.
    pub visible: usize,
    /// Mean −ln P of the true state of a visible cell, nats.
    pub log_loss: f64,
    /// See [`Score`].
    pub precision: f64,
    /// Recall of surfaces.
    pub recall: f64,
    /// Number of free cells taken for occupied.
    pub false_occupied: usize,
}

/// A run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// The scene.
    pub scene: String,
    /// The participant.
    pub contender: Contender,
    /// The random seed.
    pub seed: u64,
    /// The number of looks that were asked for.
    pub steps: usize,
    /// Σ H(O, V) and Σ H(O) before the first look, nats.
    pub initial: [f64; 2],
    /// After each look.
    pub looks: Vec<Measured>,
    /// Median time of a decision, µs.
    pub decision_us: f64,
    /// Seconds until the map had a moving body where it was, and until a sound was heard from where it came.
    #[serde(default)]
    pub found: Found,
}

impl Run {
    /// Reads a run of so many looks; none if there is no such file, or it holds something else.
    pub(super) fn read(path: &Path, steps: usize) -> Option<Self> {
        let run: Self = serde_json::from_slice(&std::fs::read(path).ok()?).ok()?;
        (run.steps == steps).then_some(run)
    }

    /// Σ H(O) over visible cells before the first look: ln 2 each.
    pub fn reachable_at_first(&self) -> f64 {
        self.looks.first().map_or(0.0, |look| look.visible as f64 * std::f64::consts::LN_2)
    }
}

/// Runs and measures. Without `senses` the head is the fast one of [`depth`]; the floor always has its camera.
pub(super) fn run(
    scene: &Scene,
    senses: Option<real::Senses>,
    contender: Contender,
    seed: u64,
    steps: usize,
) -> Result<Run, Error> {
    let world = scene.world(seed);
    let grid = Grid::new(GridConfiguration::default_exploration())?;
    let sum = |values: &[f32]| values.iter().map(|value| f64::from(*value)).sum::<f64>();
    let (mut looks, mut decisions) = (Vec::new(), Vec::new());
    let initial;
    let mut found = Found::default();
    let neck = match senses {
        None => (DepthCamera::default(), depth::MOST_TILT),
        Some(_) => (real::camera_of(scene), real::most_tilt(scene)),
    };
    match contender.policy(&world, &grid, neck, seed) {
        Some(mut policy) => {
            let mut head = match senses {
                None => depth::head(world.clone(), EvidenceKind::Virtual, seed)?,
                Some(senses) => real::head(scene, senses, seed)?.0,
            };
            initial = [sum(head.map().entropy()), sum(head.map().occupancy_entropy())];
            let (mut turned_s, mut travel) = (0.0, 0.0);
            for number in 1..=steps {
                let look = head.look(policy.as_mut())?;
                decisions.push(look.stages_ms.gaze * 1e3);
                // The world of the fast head stands still while it turns.
                let at = match senses {
                    None => number as f64 * depth::STEP_S + turned_s,
                    Some(_) => look.time_s + real::LOOK_S,
                };
                found.look(&world, head.map(), &look, at);
                looks.push(measure(head.map(), &world, look.time_s, at, travel));
                (turned_s, travel) = (turned_s + look.turn_s, travel + look.travel_rad);
            }
        }
        None => {
            let (mut map, mut all_round) = (Map::new(grid)?, AllRound::new(seed));
            initial = [sum(map.entropy()), sum(map.occupancy_entropy())];
            for number in 0..steps {
                let time_s = number as f64 * depth::STEP_S;
                all_round.look(&world, &mut map, time_s)?;
                looks.push(measure(&map, &world, time_s, time_s + depth::STEP_S, 0.0));
            }
        }
    }
    decisions.sort_by(f64::total_cmp);
    let decision_us = decisions.get(decisions.len() / 2).copied().unwrap_or(0.0);
    Ok(Run { scene: scene.name.clone(), contender, seed, steps, initial, looks, decision_us, found })
}

fn measure(map: &Map, world: &World, time_s: f64, seconds: f64, travel_rad: f64) -> Measured {
    let truth = world.truth_state(map.grid(), time_s);
    let score = Score::of(map, &truth);
    let entropies = map.occupancy_entropy().iter().zip(&truth);
    let visible =
        entropies.filter(|(_, truth)| **truth != CellTruth::Hidden).map(|(entropy, _)| f64::from(*entropy));
    let (visible, reachable) = visible.fold((0, 0.0), |(count, sum), entropy| (count + 1, sum + entropy));
    let sum = |values: &[f32]| values.iter().map(|value| f64::from(*value)).sum::<f64>();
    Measured {
        seconds,
        travel_rad,
        entropy: sum(map.entropy()),
        occupancy_entropy: sum(map.occupancy_entropy()),
        reachable,
        visible,
        log_loss: score.log_loss,
        precision: score.precision,
        recall: score.found,
        false_occupied: score.false_occupied,
    }
}
