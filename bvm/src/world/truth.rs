//! The true state of the cells of a grid.
//!
//! In: a grid and a time in seconds. Out: one value for each direction or each cell, in the grid's storage order, with
//! azimuth 0 along the world's x (head yaw 0). Each direction is represented by the ray through its centre, the ray of
//! the simulated depth camera. Invariant: the labels along a line of sight read free ... free, surface, hidden ...
//! hidden, or hidden throughout.

use super::World;
use crate::frame::unit_vector;
use crate::grid::Grid;

/// Thickness in metres at which [`World::plan`] draws the walls.
pub const WALL_M: f64 = 0.12;

/// The true state of a cell, seen from the head.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CellTruth {
    /// Nearer than the first surface on its line of sight: empty.
    Free,
    /// Holds the first surface on its line of sight: occupied.
    Surface,
    /// Not visible from the head: behind the first surface, or on a line of sight whose first surface gives no reading (glass,
    /// black), so that no look can tell anything of it.
    Hidden,
}

impl World {
    /// The shell (0-based) of the first surface along every direction; `None` where it is beyond the grid's reach. A
    /// surface inside the egocentric gap is in the first shell, as in equation 4 (`z` in `[0; 1]`). Shape:
    /// `[elevation_cells][azimuth_cells]`.
    pub fn truth_first_hit(&self, grid: &Grid, time_s: f64) -> Vec<Option<usize>> {
        let gap = grid.edges_m()[0];
        grid.all_directions()
            .map(|direction| grid.rho_of(self.range(grid.direction_centre(direction), time_s).max(gap)))
            .collect()
    }

    /// The velocity of the first surface along every direction, `[x, y, z]` in m/s; `None` where it does not move. Shape:
    /// `[elevation_cells][azimuth_cells]`.
    pub fn truth_motion(&self, grid: &Grid, time_s: f64) -> Vec<Option<[f64; 3]>> {
        let motion = |direction: (f64, f64)| {
            let hit = self.hit(direction, time_s);
            let point = unit_vector(direction.0, direction.1).map(|part| part * hit.range_m);
            hit.body.map(|body| self.bodies[body].velocity(point, time_s))
        };
        grid.all_directions().map(|direction| motion(grid.direction_centre(direction))).collect()
    }

    /// Free, surface or hidden for every cell. Shape: `[cells_rho][elevation_cells][azimuth_cells]`.
    pub fn truth_state(&self, grid: &Grid, time_s: f64) -> Vec<CellTruth> {
        let first = self.truth_first_hit(grid, time_s);
        let reads = |direction| self.hit(grid.direction_centre(direction), time_s).surface.is_readable();
        let is_read: Vec<bool> = grid.all_directions().map(reads).collect();
        (0..grid.cells())
            .map(|index| match first[index % grid.directions()] {
                _ if !is_read[index % grid.directions()] => CellTruth::Hidden,
                Some(hit) if index / grid.directions() == hit => CellTruth::Surface,
                Some(hit) if index / grid.directions() > hit => CellTruth::Hidden,
                _ => CellTruth::Free,
            })
            .collect()
    }

    /// Whether the centre of every cell is inside a solid (or outside the room), hidden or not. Shape:
    /// `[cells_rho][elevation_cells][azimuth_cells]`.
    pub fn truth_solid(&self, grid: &Grid, time_s: f64) -> Vec<bool> {
        (0..grid.cells())
            .filter_map(|index| grid.cell(index))
            .map(|cell| self.occupied(grid.centre(cell).to_cartesian(), time_s))
            .collect()
    }

    /// The floor plan at the point `[x, y, z]` (metres) and time (seconds): 1 in a solid, 0 where it is empty and
    /// visible from the head, 1/2 where it is empty but hidden, and deeper than [`WALL_M`] in the walls.
    pub fn plan(&self, point: [f64; 3], time_s: f64) -> f64 {
        let depth = (0..3)
            .map(|axis| (self.room[0][axis] - point[axis]).max(point[axis] - self.room[1][axis]))
            .fold(f64::NEG_INFINITY, f64::max);
        let rho_m = point.iter().map(|part| part * part).sum::<f64>().sqrt();
        let ray = if rho_m > 0.0 { point.map(|part| part / rho_m) } else { [1.0, 0.0, 0.0] };
        if depth > WALL_M {
            0.5
        } else if self.occupied(point, time_s) {
            1.0
        } else if self.hit_along(ray, time_s).range_m < rho_m {
            0.5
        } else {
            0.0
        }
    }
}
