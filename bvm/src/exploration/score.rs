//! The map against the truth.
//!
//! In: the map, and what each cell truly is. Out: how far the map is right where someone at the head can tell: about cells
//! that are free or hold the first surface of their line of sight. Invariant: a hidden cell counts for nothing.

use crate::map::Map;
use crate::world::CellTruth;
use serde::Serialize;

/// From this probability on a cell is taken for occupied.
const OCCUPIED: f32 = 0.5;

/// The least probability that counts, so that one cell that the map is wrong about for sure does not decide the mean.
const LEAST: f64 = 1e-6;

/// A map against the truth.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Score {
    /// Mean −ln P of what is true, nats for each cell that can be seen.
    pub log_loss: f64,
    /// Free cells that are taken for occupied, but for the last one before the first surface of its line of sight: such
    /// a surface is one cell too near, any other is not there.
    pub false_occupied: usize,
    /// Part of the cells with the first surface of their line of sight that are taken for occupied.
    pub found: f64,
}

impl Score {
    /// Compares. `truth` has one label for each cell of the map, as [`crate::world::World::truth_state`] gives them.
    pub fn of(map: &Map, truth: &[CellTruth]) -> Self {
        let directions = map.grid().directions();
        let (mut loss, mut cells, mut false_occupied) = (0.0, 0usize, 0);
        let (mut surfaces, mut found) = (0usize, 0usize);
        for (index, (truth_here, p)) in truth.iter().zip(map.occupancy()).enumerate() {
            let taken = *p > OCCUPIED;
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
        Self { log_loss: share(loss, cells), false_occupied, found: share(found as f64, surfaces) }
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
        // P(O) = ¾ of a cell whose likelihood is three times as high where it is occupied: of the free cell before the
        // first surface, of one that is beside none, of a surface, and of a hidden cell.
        let mut likelihood = vec![1f32; 24];
        for cell in [4, 2, 5, 7] {
            likelihood[12 + cell] = 3.0;
        }
        map.observe(&[&likelihood]).unwrap();
        let score = Score::of(&map, &truth);
        // Of the nine cells that can be seen two are wrongly at ¾, one rightly, six at ½.
        let expected = -(2.0 * 0.25f64.ln() + 0.75f64.ln() + 6.0 * 0.5f64.ln()) / 9.0;
        assert!((score.log_loss - expected).abs() < 1e-6, "{score:?}");
        assert_eq!(score.false_occupied, 1);
        assert!((score.found - 1.0 / 3.0).abs() < 1e-12);
    }
}
