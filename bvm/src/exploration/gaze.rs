//! Where to look next: `models/gaze.bp` and `models/view.bp` over the map.
//!
//! In: the map and the heading. Out: the direction that bisects the chosen cell, in the map's frame. Invariant:
//! among equals the direction nearest to the heading is chosen, then the first.
//!
//! `gaze.bp` is the paper's rule: the frontier cell with the steepest entropy (Eq. 6). It compares single cells,
//! hidden ones too, which stay unknown however often one looks, so that every depth step of a surface draws it.
//! `view.bp` asks the same of whole views: how much entropy a look would show, as far as nothing occludes it.

use crate::error::Error;
use crate::grid::{Direction, Grid, great_circle};
use crate::map::{Heading, Map};
use crate::programs::{gaze, view};
use crate::world::sensors::DepthCamera;
use bp_core::answer::argmax;

/// A direction to look at.
#[derive(Clone, Copy, PartialEq, Debug, serde::Serialize)]
pub struct Gaze {
    /// Azimuth in the map's frame, rad.
    pub azimuth: f64,
    /// Elevation, rad.
    pub elevation: f64,
    /// By what it was chosen: (1 − P(O = 1)) ‖∇H‖ of the frontier cell, or the entropy in view, nats; 0 where
    /// there was nothing to choose by.
    pub score: f64,
    /// Distance of the chosen frontier cell, m.
    pub range_m: Option<f64>,
}

impl Gaze {
    /// A direction chosen by nothing.
    pub fn at(azimuth: f64, elevation: f64) -> Self {
        Self { azimuth, elevation, score: 0.0, range_m: None }
    }
}

/// How far each direction is from the heading, rad.
fn away(grid: &Grid, heading: &Heading) -> Vec<f32> {
    grid.all_directions()
        .map(|direction| great_circle(grid.direction_centre(direction), (heading.yaw, 0.0)) as f32)
        .collect()
}

/// The paper's rule (section 3, steps 1 to 3); keeps its buffers.
#[derive(Clone, Debug, Default)]
pub struct Gradient {
    answer: gaze::look::Outputs<f32>,
}

impl Gradient {
    /// The best frontier cell. Straight ahead where there is none: nothing has been seen yet.
    ///
    /// # Errors
    /// None that data can cause; the kernel's own checks.
    pub fn choose(&mut self, map: &Map, heading: &Heading) -> Result<Gaze, Error> {
        let grid = map.grid();
        let inputs = gaze::look::Inputs {
            grid: map.space(),
            eta: gaze::DEFAULT_ETA as f32,
            map_p_o_c: map.occupancy(),
            map_h: map.entropy(),
        };
        gaze::look::run(&inputs, &mut self.answer)?;
        let scores = &self.answer.scores_g;
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

/// How likely occupied a cell must be to hide what lies behind it: what was seen is, what was only heard is not.
const OCCLUDES: f32 = 0.9;

/// The rule of whole views, for one camera; keeps its buffers.
#[derive(Clone, Debug)]
pub struct View {
    /// For each elevation of the camera, and each row of the grid: how many columns to either side it sees, none
    /// where it does not see the row.
    reach: Vec<Vec<Option<usize>>>,
    answer: view::look::Outputs<f32>,
}

impl View {
    /// The views of a camera that tilts by `most_tilt` radians at most.
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

    /// The direction of which a look would show most.
    ///
    /// # Errors
    /// None that data can cause; the kernel's own checks.
    pub fn choose(&mut self, map: &Map, heading: &Heading) -> Result<Gaze, Error> {
        let grid = map.grid();
        let gain = self.gains(map);
        let inputs = view::look::Inputs { directions: grid.directions(), gain: &gain };
        view::look::run(&inputs, &mut self.answer)?;
        let chosen = argmax(&self.answer.scores_g, Some(&away(grid, heading)));
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

    /// The entropy that is in view of each direction.
    fn gains(&self, map: &Map) -> Vec<f32> {
        let grid = map.grid();
        let (columns, directions) = (grid.azimuth_cells(), grid.directions());
        // What each line of sight would show: entropy up to the first cell that is surely occupied.
        let shown = |direction: usize| {
            let line = (0..grid.cells_rho()).map(|depth| depth * directions + direction);
            let open = |cell: &usize| map.occupancy()[*cell] < OCCLUDES;
            line.take_while(open).map(|cell| f64::from(map.entropy()[cell])).sum::<f64>()
        };
        // Sums over columns from the first, twice around, so that any stretch is a difference.
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
