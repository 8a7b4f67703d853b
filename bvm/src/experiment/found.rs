//! When a run found what moves and what sounds.
//!
//! In: the truth, the map and the record of each look. Out: [`Found`]. Invariant: the truth only judges; nothing of it reaches
//! the head.

use crate::frame::{great_circle, unit_vector};
use crate::head::Look;
use crate::map::{Map, OCCUPIED};
use crate::world::World;
use serde::{Deserialize, Serialize};

/// A sound is found by a bearing that is as near as this, degrees.
const NEAR_DEG: f64 = 15.0;

/// Seconds since the beginning of the run; none where it did not happen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Found {
    /// Until the map first had a moving body where it was: at least half of the cells of its surface in sight counted as occupied.
    pub body_s: Option<f64>,
    /// Until a bearing first pointed to a source.
    pub source_s: Option<f64>,
}

impl Found {
    /// Takes note of a look that ended `at` seconds after the beginning.
    pub(super) fn look(&mut self, world: &World, map: &Map, look: &Look, at: f64) {
        if self.body_s.is_none() && has_a_body(world, map, look.time_s) {
            self.body_s = Some(at);
        }
        if self.source_s.is_none() && points_to_a_source(world, look) {
            self.source_s = Some(at);
        }
    }
}

fn has_a_body(world: &World, map: &Map, time_s: f64) -> bool {
    let grid = map.grid();
    let mut counts = vec![(0, 0); world.bodies.len()];
    for (at, direction) in grid.all_directions().enumerate() {
        let hit = world.hit(grid.direction_centre(direction), time_s);
        let (Some(body), Some(rho)) = (hit.body, grid.rho_of(hit.range_m)) else { continue };
        let (azimuth, elevation) = grid.direction_centre(direction);
        let point = unit_vector(azimuth, elevation).map(|part| part * hit.range_m);
        if world.bodies[body].velocity(point, time_s).iter().any(|part| *part != 0.0) {
            counts[body].0 += 1;
            counts[body].1 += usize::from(map.occupancy()[rho * grid.directions() + at] >= OCCUPIED);
        }
    }
    counts.iter().any(|(all, found)| *all > 0 && 2 * found >= *all)
}

fn points_to_a_source(world: &World, look: &Look) -> bool {
    let is_near = |bearing: &crate::head::Bearing| {
        let heard = (bearing.azimuth_deg.to_radians(), bearing.elevation_deg.to_radians());
        world.sources.iter().any(|source| {
            let place = world.source_from(source, 0.0, look.time_s);
            great_circle(heard, (place.azimuth, place.elevation)) <= NEAR_DEG.to_radians()
        })
    };
    look.senses.iter().flat_map(|sense| &sense.found).any(is_near)
}
