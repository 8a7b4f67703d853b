//! A map whose head has moved to another place.
//!
//! In: how far the head moved, in the axes of the map. Out: for each cell, the former cells around its centre, with shares that
//! sum to 1. Invariant: probabilities stay probabilities, a map of equal cells is kept, and what was outside the grid is unknown.
//!
//! The cells of a log-spherical grid have no shift for a translation: the content is interpolated linearly in (log ρ, φ, θ) between
//! the eight former cells whose centres surround the centre of the new cell. Each interpolation smooths the map, so that small
//! moves are added up until they reach half of the smallest cell ([`Travel`]).

use crate::frame::Spherical;
use crate::grid::{Cell, Grid};
use std::f64::consts::{FRAC_PI_2, PI};

/// A move is made when it reaches this part of the smallest width of a cell.
const WORTH_MOVING: f64 = 0.5;

/// The place of the head, beside the place that the map is about.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Travel {
    rest: [f64; 3],
}

impl Travel {
    /// The head moved by a vector, m: the move that the map has to follow now, if any.
    pub fn go(&mut self, grid: &Grid, step: [f64; 3]) -> Option<[f64; 3]> {
        for (rest, step) in self.rest.iter_mut().zip(step) {
            *rest += step;
        }
        let length = self.rest.iter().map(|part| part * part).sum::<f64>().sqrt();
        (length >= WORTH_MOVING * smallest_width(grid)).then(|| std::mem::take(&mut self.rest))
    }

    /// What the map lags behind, m.
    pub fn rest(&self) -> [f64; 3] {
        self.rest
    }
}

/// The smallest width of a cell away from the poles: that of the innermost shell, m.
pub fn smallest_width(grid: &Grid) -> f64 {
    let widths = [grid.azimuth_step(), grid.elevation_step(), grid.base() - 1.0];
    grid.edges_m()[0] * widths.into_iter().fold(f64::INFINITY, f64::min)
}

/// Former cells and their shares.
pub(super) type Shares = [(usize, f32); 8];

/// Where a cell takes its content from when the head has moved by `step`, m; `None`: from outside the grid.
pub(super) fn shares(grid: &Grid, cell: Cell, step: [f64; 3]) -> Option<Shares> {
    let centre = grid.centre(cell).to_cartesian();
    let point = Spherical::from_cartesian(std::array::from_fn(|axis| centre[axis] + step[axis]));
    grid.rho_of(point.rho_m)?;
    // Coordinates in cells, from the first centre.
    let last = (grid.cells_rho() - 1) as f64;
    let (shell, outwards) = split((grid.log_coordinate(point.rho_m) - 0.5).clamp(0.0, last));
    let (row, upwards) = split((point.elevation + FRAC_PI_2) / grid.elevation_step() - 0.5);
    let (column, leftwards) = split((point.azimuth + PI) / grid.azimuth_step() - 0.5);
    let mut shares = [(0, 0.0); 8];
    for (corner, share) in shares.iter_mut().enumerate() {
        let [a, b, c] = [corner & 1, corner >> 1 & 1, corner >> 2];
        let part = |at: usize, fraction: f64| if at == 1 { fraction } else { 1.0 - fraction };
        // The shell beyond the last one has no share: its fraction is 0.
        let from = Cell { rho: (shell as usize + a).min(grid.cells_rho() - 1), elevation: 0, azimuth: 0 };
        let from = grid.neighbour(from, 0, column + c as isize, row + b as isize)?;
        *share = (grid.index(from), (part(a, outwards) * part(b, upwards) * part(c, leftwards)) as f32);
    }
    Some(shares)
}

/// The whole part and the fraction.
fn split(coordinate: f64) -> (isize, f64) {
    let whole = coordinate.floor();
    (whole as isize, coordinate - whole)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::GridConfiguration;

    fn grid() -> Grid {
        let configuration = GridConfiguration {
            cells_rho: 8,
            rho_min_m: 1.0,
            rho_max_m: 8.0,
            azimuth_cells: 60,
            elevation_cells: 30,
        };
        Grid::new(configuration).unwrap()
    }

    #[test]
    fn shares_are_those_of_the_surrounding_centres() {
        let grid = grid();
        let mut outside = 0;
        for cell in (0..grid.cells()).filter_map(|at| grid.cell(at)) {
            let still = shares(&grid, cell, [0.0; 3]).unwrap();
            let own: f32 = still.iter().filter(|it| it.0 == grid.index(cell)).map(|it| it.1).sum();
            assert!((own - 1.0).abs() < 1e-5, "{cell:?}: a head at rest keeps its map");
            let Some(moved) = shares(&grid, cell, [0.3, -0.2, 0.1]) else {
                outside += 1;
                continue;
            };
            assert!((moved.iter().map(|it| it.1).sum::<f32>() - 1.0).abs() < 1e-5);
            assert!(moved.iter().all(|it| (0.0..=1.0).contains(&it.1)));
        }
        // The far side of the outer shell, and the near side of the inner one.
        assert!(outside > 100 && outside < grid.cells() / 4, "{outside}");
    }

    #[test]
    fn ahead_is_nearer_after_a_step_ahead() {
        // Shells are a factor of 8^(1/8) wide. A step of ρ (b − 1) ahead brings the next cell ahead to this one.
        let grid = grid();
        let ahead = grid.direction_of(0.0, 0.0).unwrap();
        let here = ahead.at(3);
        let [x, y, z] = grid.centre(here).to_cartesian();
        let step = [x, y, z].map(|part| part * (grid.base() - 1.0));
        let found = shares(&grid, here, step).unwrap();
        let next: f32 = found.iter().filter(|it| it.0 == grid.index(ahead.at(4))).map(|it| it.1).sum();
        assert!((next - 1.0).abs() < 1e-4, "{found:?}");
    }

    #[test]
    fn small_moves_add_up() {
        // The smallest width is that of 6° at 1 m, 0.105 m.
        let grid = grid();
        let mut travel = Travel::default();
        let made: Vec<_> = (0..4).map(|_| travel.go(&grid, [0.02, 0.0, 0.0])).collect();
        assert_eq!(made[..2], [None, None]);
        assert!(made[2].is_some_and(|step| (step[0] - 0.06).abs() < 1e-12) && made[3].is_none());
        assert_eq!(travel.rest(), [0.02, 0.0, 0.0]);
    }
}
