//! Where the head points over the map: the index shift of section 2.3 of the paper.
//!
//! In: the head's yaw, as balance estimates it, in radians. Out: columns between the head's frame and the map's.
//! Invariant: the shift is a whole number of cells, and the rest is carried: the same yaw always gives the same
//! shift, however it was reached. It is exact for turns about the polar axis.

use crate::grid::{Grid, wrap_angle};

/// The head's yaw over the map.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Heading {
    /// Radians, positive to the right, not wrapped.
    pub yaw: f64,
}

impl Heading {
    /// By how many columns the head's frame is turned in the map's.
    pub fn shift(&self, grid: &Grid) -> usize {
        let columns = (self.yaw / grid.azimuth_step()).round() as i64;
        columns.rem_euclid(grid.azimuth_cells() as i64) as usize
    }

    /// The azimuth in the head's frame of an azimuth in the map's.
    pub fn relative(&self, azimuth: f64) -> f64 {
        wrap_angle(azimuth - self.yaw)
    }

    /// Rows of values in the head's frame, turned into the map's; each row is `azimuth_cells` long.
    pub fn turn_rows<T: Clone>(&self, grid: &Grid, rows: &mut [T]) {
        let shift = self.shift(grid);
        rows.chunks_exact_mut(grid.azimuth_cells()).for_each(|row| row.rotate_right(shift));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::GridConfiguration;

    #[test]
    fn what_is_ahead_of_a_turned_head_is_to_the_right_in_the_map() {
        let grid = Grid::new(GridConfiguration::default_exploration()).unwrap();
        // A whole number of cells, so that nothing is carried.
        let heading = Heading { yaw: 22.0 * grid.azimuth_step() };
        let ahead = grid.direction_of(0.01, 0.0).unwrap().azimuth;
        let right = grid.direction_of(22.0 * grid.azimuth_step() + 0.01, 0.0).unwrap().azimuth;
        let mut row = vec![0; grid.azimuth_cells()];
        row[ahead] = 1;
        heading.turn_rows(&grid, &mut row);
        assert_eq!(row.iter().position(|value| *value == 1), Some(right.min(row.len() - 1)));
    }

    #[test]
    fn the_shift_wraps_and_carries_the_rest() {
        let grid = Grid::new(GridConfiguration::default_exploration()).unwrap();
        let step = grid.azimuth_step();
        assert_eq!(Heading { yaw: 0.4 * step }.shift(&grid), 0);
        assert_eq!(Heading { yaw: 0.8 * step }.shift(&grid), 1, "two turns of 0.4 cells make one cell");
        assert_eq!(Heading { yaw: -step }.shift(&grid), grid.azimuth_cells() - 1);
        assert_eq!(Heading { yaw: std::f64::consts::TAU }.shift(&grid), 0);
    }
}
