//! What range readings say of the map: `models/line_of_sight.bp`, one ray for each direction.
//!
//! In: one reading, or none, for each direction. Out: the likelihood of the readings for each cell, empty or
//! occupied. Invariant: a direction without a reading says nothing: ones (paper: it is predicted, not estimated).

use super::RangeReading;
use crate::error::Error;
use crate::grid::Grid;
use crate::map::Likelihood;
use crate::programs::line_of_sight::reading;

/// Readings made into likelihoods; keeps its buffers.
#[derive(Clone, Debug, Default)]
pub struct Sight {
    answer: reading::Outputs<f32>,
}

impl Sight {
    /// The likelihood of readings, one for each direction `[φ][θ]`, with the standard deviation `sigma_min / λ`
    /// metres (Eq. 3). A reading beyond the grid is "No Detection"; one nearer than it begins is in its first cell.
    ///
    /// # Errors
    /// Another number of readings than of directions.
    pub fn likelihood(
        &mut self,
        grid: &Grid,
        readings: &[Option<RangeReading>],
        sigma_min_m: f64,
    ) -> Result<Likelihood, Error> {
        let given = |value: &dyn Fn(&RangeReading) -> f32, otherwise: f32| -> Vec<f32> {
            readings.iter().map(|reading| reading.as_ref().map_or(otherwise, value)).collect()
        };
        let bins = grid.cells_rho() as f64;
        let bin = |reading: &RangeReading| {
            let u = grid.log_coordinate(f64::from(reading.range_m));
            if u > bins { 0.0 } else { u.ceil().max(1.0) as f32 }
        };
        let inputs = reading::Inputs {
            rays: grid.directions(),
            n: grid.cells_rho(),
            z: &given(&bin, 0.0),
            sigma_min: sigma_min_m as f32,
            ln_b: grid.base().ln() as f32,
            lambda: &given(&|reading| reading.confidence, 1.0),
            rho: &given(&|reading| reading.range_m, 1.0),
        };
        reading::run(&inputs, &mut self.answer)?;
        let mut likelihood = self.answer.p_z_z_o_c.clone();
        for plane in likelihood.chunks_exact_mut(readings.len()) {
            for (cell, _) in plane.iter_mut().zip(readings).filter(|(_, reading)| reading.is_none()) {
                *cell = 1.0;
            }
        }
        Ok(likelihood)
    }
}
