//! The floor: a head that sees the whole sphere at each look.
//!
//! In: a world and a seed. Out: maps. Invariant: the readings have the noise of the same camera; no reading is counted
//! twice at a look.

use crate::error::Error;
use crate::head::depth;
use crate::map::{Heading, Map};
use crate::vision::{EvidenceKind, RangeReading, Sight};
use crate::world::sensors::{DepthCamera, Pose};
use crate::world::{Random, World, seeded};

/// Steps of yaw and pitch of the views that together cover the sphere, degrees.
const YAWS: [f64; 6] = [0.0, 60.0, 120.0, 180.0, 240.0, 300.0];
const PITCHES: [f64; 5] = [0.0, 50.0, -50.0, 85.0, -85.0];

/// The camera.
pub(super) struct AllRound {
    camera: DepthCamera,
    sight: Sight,
    noise: Random,
}

impl AllRound {
    pub(super) fn new(seed: u64) -> Self {
        Self { camera: DepthCamera::default(), sight: Sight::default(), noise: seeded(seed, "floor") }
    }

    /// One look in all directions.
    pub(super) fn look(&mut self, world: &World, map: &mut Map, time_s: f64) -> Result<(), Error> {
        map.after(depth::STEP_S)?;
        let grid = map.grid().clone();
        let mut readings: Vec<Option<RangeReading>> = vec![None; grid.directions()];
        for pitch in PITCHES {
            for yaw in YAWS.map(f64::to_radians) {
                let pose = Pose { yaw, heading: Heading { yaw }, pitch: pitch.to_radians() };
                let seen = self.camera.look(world, &grid, pose, time_s, &mut self.noise);
                readings.iter_mut().zip(seen).for_each(|(kept, seen)| *kept = kept.or(seen));
            }
        }
        let seen = self.sight.likelihood(&grid, &readings, self.camera.sigma_min_m, EvidenceKind::Virtual)?;
        map.observe(&[&seen])
    }
}
