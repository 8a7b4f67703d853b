//! What was in view, and what is left to see.
//!
//! In: the view of each look, and the map. Out: the directions that are still open, and what cannot be seen at all.
//! Invariant: exploration ends: a direction is open only for a bounded number of looks at it.

use super::sense::View;
use super::stage::Neck;
use crate::grid::Grid;
use crate::map::shift::solid_angles;
use crate::map::{Map, OCCUPIED};
use serde::Serialize;

/// A direction is closed when its first occupied cell is this probable and all cells before it are empty with at least
/// the same probability.
const SURE: f32 = 0.9;
/// After this many looks at a direction no more is expected of it.
const ENOUGH: u16 = 8;

/// The counts of looks and readings of each direction.
#[derive(Clone, Debug)]
pub struct Coverage {
    pub(super) reaches: Vec<bool>,
    pub(super) looks: Vec<u16>,
    pub(super) readings: Vec<u16>,
}

/// What cannot be seen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Unseeable {
    /// Share of the sphere that the neck cannot bring into view.
    pub beyond_the_neck: f64,
    /// Share of the sphere that has been in view, but never gave a reading: glass, black, without texture, in fog.
    pub without_reading: f64,
    /// Cells behind the first surface.
    pub hidden_cells: usize,
    /// All cells.
    pub cells: usize,
}

impl Coverage {
    /// Nothing seen yet.
    pub fn of(grid: &Grid, neck: &dyn Neck) -> Self {
        let reaches = grid.all_directions().map(|direction| neck.reaches(grid.direction_centre(direction)));
        let none = vec![0; grid.directions()];
        Self { reaches: reaches.collect(), looks: none.clone(), readings: none }
    }

    /// For each direction: looks that had it in view, and those of them with a reading.
    pub fn counts(&self) -> (&[u16], &[u16]) {
        (&self.looks, &self.readings)
    }

    /// Adds the view of a look; an empty one has no effect.
    pub fn add(&mut self, view: &View) {
        for (at, seen) in view.iter().enumerate() {
            let Some(reading) = seen else { continue };
            self.looks[at] = self.looks[at].saturating_add(1);
            self.readings[at] = self.readings[at].saturating_add(u16::from(*reading));
        }
    }

    /// The number of directions that looks can still tell something about.
    pub fn open(&self, map: &Map) -> usize {
        let directions = map.grid().directions();
        let (occupied, cells) = (map.occupancy(), map.grid().cells_rho());
        let is_closed = |direction: usize| {
            let line = (0..cells).map(|rho| occupied[rho * directions + direction]);
            for p in line {
                if p >= SURE {
                    return true;
                }
                if p > 1.0 - SURE {
                    return false;
                }
            }
            true
        };
        let is_open = |at: &usize| self.reaches[*at] && self.looks[*at] < ENOUGH && !is_closed(*at);
        (0..directions).filter(is_open).count()
    }

    /// What cannot be seen from here.
    pub fn unseeable(&self, map: &Map) -> Unseeable {
        let grid = map.grid();
        let solid = solid_angles(grid);
        let all: f64 = solid.iter().sum();
        let share = |is: &dyn Fn(usize) -> bool| {
            (0..solid.len()).filter(|at| is(*at)).map(|at| solid[at]).fold(0.0, |sum, one| sum + one) / all
        };
        let hidden = |direction: usize| {
            let first = (0..grid.cells_rho())
                .position(|rho| map.occupancy()[rho * grid.directions() + direction] >= OCCUPIED);
            first.map_or(0, |first| grid.cells_rho() - 1 - first)
        };
        Unseeable {
            beyond_the_neck: share(&|at| !self.reaches[at]),
            without_reading: share(&|at| self.looks[at] > 0 && self.readings[at] == 0),
            hidden_cells: (0..grid.directions()).map(hidden).sum(),
            cells: grid.cells(),
        }
    }
}
