//! The accuracy of the map.
//!
//! In: the map, and the true state of each cell. Out: its accuracy over the cells that an observer at the head can
//! judge: free cells, and the first surface of each line of sight. Invariant: hidden cells do not count.

use crate::map::{Map, OCCUPIED};
use crate::world::CellTruth;
use serde::Serialize;

/// The least probability in the mean, so that a single cell with a certain but wrong state does not dominate it.
const LEAST: f64 = 1e-6;

/// The accuracy of a map.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Score {
    /// Mean −ln P of the true state of each visible cell, nats.
    pub log_loss: f64,
    /// Number of free cells that count as [`OCCUPIED`], except the last one before the first surface of its line of
    /// sight, which is a surface one cell too near.
    pub false_occupied: usize,
    /// Share of the first surface cells that count as occupied: the recall of surfaces.
    pub found: f64,
    /// Share of the found surface cells among these and the false ones; 1 if there are none of either.
    pub precision: f64,
}

impl Score {
    /// Compares a map with the truth. `truth` has one label for each cell of the map, as
    /// [`crate::world::World::truth_state`] gives them.
    pub fn of(map: &Map, truth: &[CellTruth]) -> Self {
        let directions = map.grid().directions();
        let (mut loss, mut cells, mut false_occupied) = (0.0, 0usize, 0);
        let (mut surfaces, mut found) = (0usize, 0usize);
        for (index, (truth_here, p)) in truth.iter().zip(map.occupancy()).enumerate() {
            let taken = *p >= OCCUPIED;
            let p_of_truth = match truth_here {
                CellTruth::Hidden => continue,
                CellTruth::Free => {
                    let next = truth.get(index + directions);
                    false_occupied += usize::from(taken && next != Some(&CellTruth::Surface));
                    1.0 - f64::from(*p)
                }
                CellTruth::Surface => {
                    (surfaces, found) = (surfaces + 1, found + usize::from(taken));
                    f64::from(*p)
                }
            };
            loss -= p_of_truth.max(LEAST).ln();
            cells += 1;
        }
        let share = |part: f64, all: usize| part / all.max(1) as f64;
        let taken = found + false_occupied;
        Self {
            log_loss: share(loss, cells),
            false_occupied,
            found: share(found as f64, surfaces),
            precision: if taken == 0 { 1.0 } else { share(found as f64, taken) },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::{Grid, GridConfiguration};

    #[test]
    fn three_lines_of_sight_by_hand() {
        // Four directions of three cells each: free free surface; free surface hidden; free free free; surface hidden hidden.
        let grid = Grid::new(GridConfiguration {
            cells_rho: 3,
            rho_min_m: 1.0,
            rho_max_m: 8.0,
            azimuth_cells: 4,
            elevation_cells: 1,
        })
        .unwrap();
        use CellTruth::{Free, Hidden, Surface};
        let truth =
            [[Free, Free, Free, Surface], [Free, Surface, Free, Hidden], [Surface, Hidden, Free, Hidden]]
                .concat();
        let mut map = Map::new(grid).unwrap();
        let unknown = Score::of(&map, &truth);
        assert!((unknown.log_loss - 2f64.ln()).abs() < 1e-7);
        assert_eq!((unknown.false_occupied, unknown.found), (0, 0.0));
        // P(O) = ¾ of a cell whose likelihood is three times as high where it is occupied: for the free cell before the
        // first surface, a free cell that is not next to a surface, a surface, and a hidden cell.
        let mut likelihood = vec![1f32; 24];
        for cell in [4, 2, 5, 7] {
            likelihood[12 + cell] = 3.0;
        }
        // A free cell that was only heard, P(O) = 1.1 / 2.1, does not count as occupied.
        likelihood[12] = 1.1;
        map.observe(&[&likelihood]).unwrap();
        let score = Score::of(&map, &truth);
        // Of the nine cells that can be seen two are wrongly at ¾, one rightly, one was heard, five are at ½.
        let heard = (1.0f64 / 2.1).ln();
        let expected = -(2.0 * 0.25f64.ln() + 0.75f64.ln() + heard + 5.0 * 0.5f64.ln()) / 9.0;
        assert!((score.log_loss - expected).abs() < 1e-6, "{score:?}");
        assert_eq!(score.false_occupied, 1);
        assert!((score.found - 1.0 / 3.0).abs() < 1e-12);
        assert_eq!(score.precision, 0.5);
    }
}
