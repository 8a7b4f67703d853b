//! Where to look next: `models/gaze.bp` over the map.
//!
//! In: the map and the heading. Out: the direction that bisects the chosen cell, in the map's frame. Invariant:
//! among equals the direction nearest to the heading is chosen, then the first; where there is no frontier at all
//! (nothing has been seen), the gaze is straight ahead.

use crate::error::Error;
use crate::grid::great_circle;
use crate::map::{Heading, Map};
use crate::programs::gaze::{self, look};
use bp_core::answer::argmax;

/// A direction to look at.
#[derive(Clone, Copy, PartialEq, Debug, serde::Serialize)]
pub struct Gaze {
    /// Azimuth in the map's frame, rad.
    pub azimuth: f64,
    /// Elevation, rad.
    pub elevation: f64,
    /// (1 − P(O = 1)) ‖∇H‖ of the chosen cell, nats per cell; 0 where there is none.
    pub score: f64,
    /// Distance of the chosen cell, m; `None` where there is no frontier.
    pub range_m: Option<f64>,
}

/// Chooses gazes; keeps its buffers.
#[derive(Clone, Debug, Default)]
pub struct Chooser {
    answer: look::Outputs<f32>,
}

impl Chooser {
    /// The gaze from which the map can learn most (paper, section 3, steps 1 to 3).
    ///
    /// # Errors
    /// None that data can cause; the kernel's own checks.
    pub fn choose(&mut self, map: &Map, heading: &Heading) -> Result<Gaze, Error> {
        let grid = map.grid();
        let inputs = look::Inputs {
            grid: map.space(),
            eta: gaze::DEFAULT_ETA as f32,
            map_p_o_c: map.occupancy(),
            map_h: map.entropy(),
        };
        look::run(&inputs, &mut self.answer)?;
        let scores = &self.answer.argmax_p_g_nearest_heading;
        let away: Vec<f32> = (grid.all_directions())
            .map(|direction| great_circle(grid.direction_centre(direction), (heading.yaw, 0.0)) as f32)
            .collect();
        let nearest: Vec<f32> = away.iter().cycle().take(grid.cells()).copied().collect();
        let chosen = argmax(scores, Some(&nearest)).first().copied();
        Ok(match chosen.and_then(|index| grid.cell(index).map(|cell| (grid.centre(cell), scores[index]))) {
            Some((centre, score)) => Gaze {
                azimuth: centre.azimuth,
                elevation: centre.elevation,
                score: f64::from(score),
                range_m: Some(centre.rho_m),
            },
            None => Gaze { azimuth: heading.yaw, elevation: 0.0, score: 0.0, range_m: None },
        })
    }
}
