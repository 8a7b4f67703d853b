//! The map in the files of other programs.
//!
//! In: a map. Out: PLY (point clouds), OctoMap's `.bt` and `.ot`, and, with the feature `recording`, MCAP recordings with
//! ROS 2 messages. Points are in the map's frame, in metres. Invariant: PLY and OctoMap files are written whole or not at all; a recording is closed
//! chunk by chunk, so that what was written before an interruption can be read.

mod octomap;
mod ply;
#[cfg(feature = "recording")]
mod recording;
#[cfg(feature = "recording")]
mod ros;

pub use octomap::{Octree, RESOLUTION_M};
pub use ply::write as write_ply;
#[cfg(feature = "recording")]
pub use recording::Recorder;

use crate::grid::Grid;
use crate::map::{Map, OCCUPIED, VELOCITIES};

/// An occupied cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Its centre, `[x, y, z]`, m.
    pub place: [f32; 3],
    /// P(O = 1).
    pub occupancy: f32,
    /// The expected velocity of its content, `[x, y, z]`, m/s.
    pub velocity: [f32; 3],
}

/// The cells with P(O = 1) of at least [`OCCUPIED`]; `step_s` is the time of one step of the map.
pub fn points(map: &Map, step_s: f64) -> Vec<Point> {
    let (grid, cells) = (map.grid(), map.grid().cells());
    let is_occupied = |index: &usize| map.occupancy()[*index] >= OCCUPIED;
    let point = |index: usize| {
        let cell = grid.cell(index).expect("internal: an index below the number of cells");
        let centre = grid.centre(cell).to_cartesian();
        let mut velocity = [0.0; 3];
        for (at, offset) in VELOCITIES.iter().enumerate() {
            let p = f64::from(map.velocity()[at * cells + index]);
            let shift = displacement(grid, index, *offset);
            (0..3).for_each(|axis| velocity[axis] += p * shift[axis] / step_s);
        }
        Point {
            place: centre.map(|part| part as f32),
            occupancy: map.occupancy()[index],
            velocity: velocity.map(|part| part as f32),
        }
    };
    (0..cells).filter(is_occupied).map(point).collect()
}

/// How far the centre of a cell moves by a velocity in one step, m; 0 where the velocity leaves the grid.
fn displacement(grid: &Grid, index: usize, [rho, elevation, azimuth]: [i32; 3]) -> [f64; 3] {
    let Some(cell) = grid.cell(index) else { return [0.0; 3] };
    let moved = grid.neighbour(cell, rho as isize, azimuth as isize, elevation as isize);
    let Some(moved) = moved else { return [0.0; 3] };
    let [from, to] = [cell, moved].map(|cell| grid.centre(cell).to_cartesian());
    [0, 1, 2].map(|axis| to[axis] - from[axis])
}
