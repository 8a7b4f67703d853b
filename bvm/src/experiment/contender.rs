//! What takes part: the policies of heads, and two that know the truth.
//!
//! In: a world. Out: a policy. Invariant: the oracle and the floor are bounds, and exist in the experiment only.

use crate::error::Error;
use crate::exploration::{FieldOfView, Gazer, PolicyKind};
use crate::grid::Grid;
use crate::head::{Gaze, Policy, depth};
use crate::map::{Heading, Map};
use crate::world::World;
use crate::world::sensors::DepthCamera;
use bp_core::compiler::answer::argmax;
use serde::{Deserialize, Serialize};

/// A participant.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Contender {
    /// Greedy: the gaze with the most entropy of occupancy on what it will hit, by the truth, where this gives a reading.
    Oracle,
    /// The whole sphere at each look: no policy can do better with this camera.
    Floor,
    /// A policy.
    #[serde(untagged)]
    Policy(PolicyKind),
}

impl Contender {
    /// Its name in files and figures.
    pub fn name(self) -> &'static str {
        match self {
            Contender::Policy(kind) => kind.name(),
            Contender::Oracle => "oracle",
            Contender::Floor => "floor",
        }
    }

    /// The participant of this name.
    pub fn of_name(name: &str) -> Option<Self> {
        match name {
            "oracle" => Some(Contender::Oracle),
            "floor" => Some(Contender::Floor),
            _ => PolicyKind::of_name(name).map(Contender::Policy),
        }
    }

    /// The policy in a world, for a camera and its largest tilt, rad; none for the floor.
    pub(super) fn policy(
        self,
        world: &World,
        grid: &Grid,
        (camera, most_tilt): (DepthCamera, f64),
        seed: u64,
    ) -> Option<Box<dyn Policy>> {
        match self {
            Contender::Policy(kind) => Some(Box::new(Gazer::new(kind, &camera, grid, most_tilt, seed))),
            Contender::Oracle => Some(Box::new(Oracle {
                world: world.clone(),
                field: FieldOfView::of(&camera, grid, most_tilt),
                looks: 0,
            })),
            Contender::Floor => None,
        }
    }
}

/// The greedy oracle.
struct Oracle {
    world: World,
    field: FieldOfView,
    looks: usize,
}

impl Policy for Oracle {
    fn choose(&mut self, map: &Map, heading: &Heading) -> Result<Gaze, Error> {
        self.looks += 1;
        let grid = map.grid();
        let directions = grid.directions();
        let time_s = self.looks as f64 * depth::STEP_S;
        let hits = self.world.truth_first_hit(grid, time_s);
        let shown = hits.iter().zip(grid.all_directions()).enumerate().map(|(direction, (hit, centre))| {
            // A surface that gives no reading shows nothing. Fog is not foreseen.
            if !self.world.hit(grid.direction_centre(centre), time_s).surface.is_readable() {
                return 0.0;
            }
            let last = hit.unwrap_or(grid.cells_rho() - 1);
            (0..=last).map(|rho| map.occupancy_entropy()[rho * directions + direction]).sum::<f32>()
        });
        let sums = self.field.sums(&shown.collect::<Vec<f32>>());
        let chosen = argmax(&sums, Some(&self.field.away(heading.yaw)));
        Ok(match chosen.first().and_then(|index| grid.direction(*index)) {
            Some(direction) => {
                let (azimuth, elevation) = grid.direction_centre(direction);
                Gaze::at(azimuth, elevation)
            }
            None => Gaze::at(heading.yaw, 0.0),
        })
    }
}
