//! The choice of a gaze from a single map: `models/gaze.bp`.
//!
//! In: the map and the heading. Out: the direction that bisects the chosen cell, in the map's frame. Invariant:
//! among equals the direction nearest to the heading is chosen, then the first. A head that looks repeatedly has a
//! [`super::Gazer`].

use crate::error::Error;
use crate::frame::great_circle;
use crate::grid::Grid;
use crate::head::{Gaze, Policy};
use crate::map::{Heading, Map};
use crate::programs::gaze;
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
