//! Where to look next: `models/gaze.bp` over the map.
//!
//! In: the map and the heading. Out: the direction that bisects the chosen cell, in the map's frame. Invariant:
//! among equals the direction nearest to the heading is chosen, then the first; where there is no frontier at all
//! (nothing has been seen), the gaze is straight ahead.
//!
//! As printed, the gradient of Eq. 6 compares single cells, and cells that are hidden behind a surface too. These
//! stay unknown however often one looks, so that the steps of every slanted surface draw the gaze for ever. But a
//! look shows a whole line of sight, as far as it is not occluded: [`Field::LineOfSight`], the default, compares
//! what is left to be learnt along lines of sight; [`Field::Cell`] is the literal reading.

use crate::error::Error;
use crate::grid::great_circle;
use crate::map::{Heading, Map};
use crate::programs::gaze::{self, look};
use bp_core::answer::argmax;
use std::marker::PhantomData;

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

/// Of which entropy field the gradient is taken.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Field {
    /// For each cell, the mean of H over its line of sight, hidden cells counting as 0.
    #[default]
    LineOfSight,
    /// H(c), as printed.
    Cell,
}

/// Chooses gazes; keeps its buffers.
#[derive(Clone, Debug, Default)]
pub struct Chooser {
    field: Field,
    entropy: Vec<f32>,
    answer: look::Outputs<f32>,
}

/// By how much a cell must be more likely occupied than not to hide what lies behind it.
const OCCLUDES: f32 = 0.5 + gaze::DEFAULT_ETA as f32;

impl Chooser {
    /// Gradients of this field.
    pub fn of(field: Field) -> Self {
        Self { field, ..Self::default() }
    }

    fn entropy(&mut self, map: &Map) -> &[f32] {
        self.entropy.clear();
        self.entropy.extend_from_slice(map.entropy());
        if self.field == Field::LineOfSight {
            let (directions, depths) = (map.grid().directions(), map.grid().cells_rho());
            for direction in 0..directions {
                let line = (0..depths).map(|depth| depth * directions + direction);
                let visible = line.clone().take_while(|cell| map.occupancy()[*cell] <= OCCLUDES);
                let left = visible.map(|cell| map.entropy()[cell]).sum::<f32>() / depths as f32;
                line.for_each(|cell| self.entropy[cell] = left);
            }
        }
        &self.entropy
    }

    /// The gaze from which the map can learn most (paper, section 3, steps 1 to 3).
    ///
    /// # Errors
    /// None that data can cause; the kernel's own checks.
    pub fn choose(&mut self, map: &Map, heading: &Heading) -> Result<Gaze, Error> {
        let grid = map.grid();
        let mut answer = std::mem::take(&mut self.answer);
        let inputs = look::Inputs {
            grid: map.space(),
            eta: gaze::DEFAULT_ETA as f32,
            map_p_o_c: map.occupancy(),
            map_h: self.entropy(map),
            marker: PhantomData,
        };
        look::run(&inputs, &mut answer)?;
        self.answer = answer;
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
