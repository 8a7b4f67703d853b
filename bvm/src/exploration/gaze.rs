//! The choice of the next gaze: `models/gaze.bp` and `models/view.bp` over the map.
//!
//! In: the map and the heading. Out: the direction that bisects the chosen cell, in the map's frame. Invariant:
//! among equals the direction nearest to the heading is chosen, then the first.
//!
//! `gaze.bp` is the paper's rule: the frontier cell with the steepest entropy (Eq. 6). It compares single cells,
//! including hidden ones, which stay unknown however often one looks, so that every depth step of a surface attracts
//! it.

use crate::error::Error;
use crate::frame::great_circle;
use crate::grid::{Direction, Grid};
use crate::head::{Gaze, Policy};
use crate::map::{Heading, Map};
use crate::programs::{gaze, view};
use crate::world::sensors::DepthCamera;
use bp_core::compiler::answer::argmax;

/// The angle of each direction to the heading, rad.
fn away(grid: &Grid, heading: &Heading) -> Vec<f32> {
    grid.all_directions()
        .map(|direction| great_circle(grid.direction_centre(direction), (heading.yaw, 0.0)) as f32)
        .collect()
}

/// The paper's rule (section 3, steps 1 to 3), with its buffers. Directions never looked at are candidates: their
/// innermost cell is a frontier cell against the empty gap.
#[derive(Clone, Debug, Default)]
pub struct Gradient {
    answer: gaze::look::Answer<f32>,
}

impl Gradient {
    /// The best frontier cell; straight ahead if every direction is blocked next to the head.
    ///
    /// # Errors
    /// Only the kernel's own checks, which valid data pass.
    pub fn choose(&mut self, map: &Map, heading: &Heading) -> Result<Gaze, Error> {
        let grid = map.grid();
        gaze::look(map.space()).map_p_o_c(map.occupancy()).map_h(map.entropy()).run_into(&mut self.answer)?;
        let scores = self.answer.scores();
        let nearest: Vec<f32> = away(grid, heading).into_iter().cycle().take(grid.cells()).collect();
        let chosen = argmax(scores, Some(&nearest)).first().copied();
        Ok(match chosen.and_then(|index| grid.cell(index).map(|cell| (grid.centre(cell), scores[index]))) {
            Some((centre, score)) => Gaze {
                azimuth: centre.azimuth,
                elevation: centre.elevation,
                score: f64::from(score),
                range_m: Some(centre.rho_m),
            },
            None => Gaze::at(heading.yaw, 0.0),
        })
    }
}

impl Policy for Gradient {
    fn choose(&mut self, map: &Map, heading: &Heading) -> Result<Gaze, Error> {
        Gradient::choose(self, map, heading)
    }
}

impl Policy for View {
    fn choose(&mut self, map: &Map, heading: &Heading) -> Result<Gaze, Error> {
        View::choose(self, map, heading)
    }
}

/// The least probability of occupancy with which a cell occludes: seen cells reach it, cells that were only heard do
/// not.
const OCCLUDES: f32 = 0.9;

/// The rule of the entropy in view, for one camera, with its buffers.
#[derive(Clone, Debug)]
pub struct View {
    /// For each elevation of the camera and each row of the grid: the number of visible columns to either side; none if
    /// the row is not visible.
    reach: Vec<Vec<Option<usize>>>,
    answer: view::look::Answer<f32>,
}

impl View {
    /// The views of a camera with a tilt of at most `most_tilt` radians.
    pub fn of(camera: &DepthCamera, grid: &Grid, most_tilt: f64) -> Self {
        let elevation = |row: usize| grid.direction_centre(Direction { elevation: row, azimuth: 0 }).1;
        let reach = |tilt: f64, row: usize| {
            let sees = |columns: &usize| {
                camera.sees((*columns as f64 * grid.azimuth_step(), elevation(row)), tilt).is_some()
            };
            (0..=grid.azimuth_cells() / 2).take_while(sees).last()
        };
        let rows = 0..grid.elevation_cells();
        let reach = rows.clone().map(|tilt| match elevation(tilt) {
            tilt if tilt.abs() > most_tilt => vec![None; grid.elevation_cells()],
            tilt => rows.clone().map(|row| reach(tilt, row)).collect(),
        });
        Self { reach: reach.collect(), answer: Default::default() }
    }

    /// The direction with the most entropy in view.
    ///
    /// # Errors
    /// Only the kernel's own checks, which valid data pass.
    pub fn choose(&mut self, map: &Map, heading: &Heading) -> Result<Gaze, Error> {
        let grid = map.grid();
        let gain = self.gains(map);
        view::look().directions(grid.directions()).gain(&gain).run_into(&mut self.answer)?;
        let chosen = argmax(self.answer.scores(), Some(&away(grid, heading)));
        Ok(
            match chosen.first().and_then(|index| grid.direction(*index).map(|direction| (*index, direction)))
            {
                Some((index, direction)) => {
                    let (azimuth, elevation) = grid.direction_centre(direction);
                    Gaze { azimuth, elevation, score: f64::from(gain[index]), range_m: None }
                }
                None => Gaze::at(heading.yaw, 0.0),
            },
        )
    }

    /// The entropy in view of each direction.
    fn gains(&self, map: &Map) -> Vec<f32> {
        let grid = map.grid();
        let (columns, directions) = (grid.azimuth_cells(), grid.directions());
        // The entropy of each line of sight, up to the first cell that is occupied with near certainty.
        let shown = |direction: usize| {
            let line = (0..grid.cells_rho()).map(|depth| depth * directions + direction);
            let open = |cell: &usize| map.occupancy()[*cell] < OCCLUDES;
            line.take_while(open).map(|cell| f64::from(map.entropy()[cell].max(0.0))).sum::<f64>()
        };
        // Cumulative sums over columns, twice around, so that any range of columns is a difference.
        let sums: Vec<Vec<f64>> = (0..grid.elevation_cells())
            .map(|row| {
                let mut sums = vec![0.0];
                let line: Vec<f64> = (0..columns).map(|column| shown(row * columns + column)).collect();
                for column in 0..3 * columns {
                    sums.push(sums[column] + line[column % columns]);
                }
                sums
            })
            .collect();
        let view = |tilt: usize, column: usize| -> f64 {
            let rows = self.reach[tilt].iter().zip(&sums);
            rows.filter_map(|(reach, sums)| {
                let reach = (*reach)?.min((columns - 1) / 2);
                Some(sums[column + columns + reach + 1] - sums[column + columns - reach])
            })
            .sum()
        };
        (0..directions).map(|direction| view(direction / columns, direction % columns) as f32).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::GridConfiguration;

    /// A map after repeated observation of the states that `is_occupied` gives; `None`: unobserved.
    fn seen(is_occupied: impl Fn(usize, (f64, f64)) -> Option<bool>) -> Map {
        let grid = Grid::new(GridConfiguration::default_exploration()).unwrap();
        let (cells, directions) = (grid.cells(), grid.directions());
        let mut likelihood = vec![1.0f32; 2 * cells];
        for index in 0..cells {
            let direction = grid.direction(index % directions).unwrap();
            if let Some(occupied) = is_occupied(index / directions, grid.direction_centre(direction)) {
                likelihood[if occupied { index } else { cells + index }] = 1e-4;
            }
        }
        let mut map = Map::new(grid).unwrap();
        map.observe(&[&likelihood]).unwrap();
        map
    }

    #[test]
    fn of_a_map_that_knows_nothing_the_innermost_cell_ahead_is_the_frontier() {
        let map = Map::new(Grid::new(GridConfiguration::default_exploration()).unwrap()).unwrap();
        for yaw in [0.0, 1.0, -2.0] {
            let gaze = Gradient::default().choose(&map, &Heading { yaw }).unwrap();
            let first = map.grid().centre(crate::grid::Cell { rho: 0, elevation: 0, azimuth: 0 }).rho_m;
            assert_eq!(gaze.range_m, Some(first));
            // (1 − ½) ‖∇H‖, with H itself as the difference to the gap, whose state is certain.
            assert!((gaze.score - 0.5 * f64::from(map.entropy()[0])).abs() < 1e-5, "{gaze:?}");
            let away = great_circle((gaze.azimuth, gaze.elevation), (yaw, 0.0));
            assert!(away < 2f64.to_radians() * 2f64.sqrt(), "as near to the heading as a cell's centre");
        }
    }

    #[test]
    fn unseen_cells_are_candidates_and_blocked_cells_are_not() {
        // Ahead everything is empty and known; on the left the innermost cell is a wall; on the right nothing is known.
        let blocked = |azimuth: f64| azimuth > 0.5;
        let known = |azimuth: f64| azimuth.abs() <= 0.5;
        let map = seen(|rho, (azimuth, _)| match azimuth {
            azimuth if known(azimuth) => Some(false),
            azimuth if blocked(azimuth) && rho == 0 => Some(true),
            _ => None,
        });
        let mut rule = Gradient::default();
        rule.choose(&map, &Heading::default()).unwrap();
        let grid = map.grid();
        let scores = rule.answer.scores();
        for direction in grid.all_directions() {
            let (azimuth, _) = grid.direction_centre(direction);
            let score = |rho: usize| scores[grid.index(direction.at(rho))];
            let inner = score(0);
            assert!((1..grid.cells_rho() - 1).all(|rho| score(rho) == 0.0), "an open ray ends at N");
            if known(azimuth) || blocked(azimuth) {
                assert_eq!(inner, 0.0, "{azimuth}");
            } else {
                assert!(inner > 0.3, "{azimuth}: {inner}");
            }
        }
    }
}
