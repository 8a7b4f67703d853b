//! The likelihood of range readings for the map: `models/line_of_sight.bp`, `models/range_code.bp` and
//! `models/population_code.bp`, one ray for each direction.
//!
//! In: for each direction a reading or none; optionally its population code, and the probabilities of the map. Out: the
//! likelihood of the readings for each cell, empty or occupied. Invariant: the likelihood of a direction without a
//! reading is one everywhere (paper: it is predicted, not estimated).

use super::population::{Codes, Population, codes};
use super::readings::PixelReading;
use super::stereo::SIGMA_MIN_PX;
use super::{Calibration, DisparityMap, RangeReading};
use crate::error::Error;
use crate::grid::Grid;
use crate::map::{Likelihood, Map};
use crate::programs::{line_of_sight, population_code, range_code};
use serde::Serialize;

/// The kind of evidence from a direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum EvidenceKind {
    /// The cell of one range, with the deviation of the range.
    #[default]
    Hard,
    /// A likelihood for all cells (Pearl's virtual evidence): the whole population code, or the normal distribution
    /// about one range.
    Virtual,
}

impl EvidenceKind {
    /// Its name in commands and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hard => "hard",
            Self::Virtual => "virtual",
        }
    }
}

impl HiddenCells {
    /// Its name in commands and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::Map => "map",
        }
    }
}

/// The occupancy of the hidden cells of a line of sight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum HiddenCells {
    /// Each is occupied with probability ½.
    #[default]
    Uniform,
    /// With the probability in the map before the reading.
    Map,
}

/// The evidence of a frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct FrameEvidence<'p> {
    /// A reading or a code for each direction.
    pub evidence: EvidenceKind,
    /// The posteriors of all pixels, for codes; without them a code is made of the estimate and its λ.
    pub population: Option<&'p Population>,
    /// Where the camera is from the origin of the map, in the axes of the camera, m.
    pub camera_m: [f64; 3],
}

/// The readings of a view in all directions.
#[derive(Clone, Debug)]
pub struct ViewReadings {
    /// One for each direction `[φ][θ]`, or none.
    pub readings: Vec<Option<RangeReading>>,
    codes: Option<Codes>,
    sigma_min_m: f64,
}

impl ViewReadings {
    /// The selected pixels of each direction, as readings with the λ of Eq. 3, or as codes: then the code contains the
    /// spread, and λ is that of the least deviation. σ_min is that of a disparity of confidence 1 at a range of
    /// `nearest_m`: the least deviation of a disparity is a fixed part of a pixel, which in metres grows with the
    /// square of the range (A20).
    pub fn of(
        pixel_readings: &[Option<PixelReading>],
        map: &DisparityMap,
        calibration: &Calibration,
        grid: &Grid,
        nearest_m: f64,
        heard: &FrameEvidence<'_>,
    ) -> Self {
        let sigma = |range_m: f64| calibration.range_sigma_m(range_m, f64::from(SIGMA_MIN_PX));
        let sigma_min_m = sigma(nearest_m);
        let is_hard = heard.evidence == EvidenceKind::Hard;
        let one = |PixelReading { reading, .. }: PixelReading| {
            let own = if is_hard { f64::from(reading.confidence) } else { 1.0 };
            let confidence = (own * sigma_min_m / sigma(f64::from(reading.range_m))).min(1.0);
            RangeReading { confidence: confidence as f32, ..reading }
        };
        Self {
            readings: pixel_readings.iter().map(|found| found.map(one)).collect(),
            codes: (!is_hard).then(|| codes(pixel_readings, map, heard, calibration, grid)),
            sigma_min_m,
        }
    }

    /// Given readings, with the deviation `sigma_min_m / λ`.
    pub fn hard(readings: Vec<Option<RangeReading>>, sigma_min_m: f64) -> Self {
        Self { readings, codes: None, sigma_min_m }
    }
}

/// Computes the likelihoods of readings; keeps its buffers.
#[derive(Clone, Debug, Default)]
pub struct Sight {
    read: line_of_sight::reading::Answer<f32>,
    spread: range_code::reading::Answer<f32>,
    heard: population_code::heard::Answer<f32>,
}

impl Sight {
    /// The likelihood of readings, one for each direction `[φ][θ]`, with the standard deviation `sigma_min / λ` metres
    /// (Eq. 3): of the cell that contains each, or spread over the neighbouring cells. A reading beyond the grid is "No
    /// Detection"; one in the gap is in the first cell.
    ///
    /// # Errors
    /// Numbers that the program refuses.
    pub fn likelihood(
        &mut self,
        grid: &Grid,
        readings: &[Option<RangeReading>],
        sigma_min_m: f64,
        evidence: EvidenceKind,
    ) -> Result<Likelihood, Error> {
        let seen = Seen::of(readings);
        if seen.rays.is_empty() {
            return Ok(seen.spread(grid, readings.len(), &[]));
        }
        let (rays, n) = (seen.rays.len(), grid.cells_rho());
        let (sigma_min, ln_b) = (sigma_min_m, grid.base().ln());
        let (lambda, rho) = (&seen.lambda(), &seen.rho());
        let answers = match evidence {
            EvidenceKind::Hard => {
                let z: Vec<f32> = seen.readings.iter().map(|reading| bin(grid, reading) as f32).collect();
                let question = line_of_sight::reading().rays(rays).n(n).sigma_min(sigma_min).ln_b(ln_b);
                question.lambda(lambda).rho(rho).z(&z).run_into(&mut self.read)?;
                self.read.distribution_mut()
            }
            EvidenceKind::Virtual => {
                let question = range_code::reading().rays(rays).n(n).sigma_min(sigma_min).ln_b(ln_b);
                let question = question.rho_min(grid.edges_m()[0]).lambda(lambda).rho(rho);
                question.run_into(&mut self.spread)?;
                self.spread.distribution_mut()
            }
        };
        if rays == readings.len() {
            return Ok(std::mem::take(answers));
        }
        Ok(seen.spread(grid, readings.len(), answers))
    }

    /// The likelihood of a frame, with hidden cells occupied with the probabilities of the map `before`, or each with
    /// probability ½.
    ///
    /// # Errors
    /// Numbers that the program refuses.
    pub fn likelihood_of(
        &mut self,
        grid: &Grid,
        view: &ViewReadings,
        before: Option<&Map>,
    ) -> Result<Likelihood, Error> {
        let ViewReadings { readings, codes, sigma_min_m } = view;
        if codes.is_none() && before.is_none() {
            return self.likelihood(grid, readings, *sigma_min_m, EvidenceKind::Hard);
        }
        let seen = Seen::of(readings);
        if seen.rays.is_empty() {
            return Ok(seen.spread(grid, readings.len(), &[]));
        }
        let (rays, bins) = (seen.rays.len(), grid.cells_rho());
        let mut code = vec![0f32; (bins + 1) * rays];
        for (at, (ray, reading)) in seen.rays.iter().zip(&seen.readings).enumerate() {
            match codes.as_ref().and_then(|codes| codes[*ray].as_ref()) {
                Some(code_of_ray) => (0..=bins).for_each(|z| code[z * rays + at] = code_of_ray[z]),
                None => code[bin(grid, reading) * rays + at] = 1.0,
            }
        }
        let hidden = match before {
            None => vec![0.5; bins * rays],
            Some(map) => {
                let planes = map.occupancy().chunks_exact(readings.len());
                planes.flat_map(|plane| seen.rays.iter().map(|ray| plane[*ray])).collect()
            }
        };
        let (lambda, rho) = (seen.lambda(), seen.rho());
        population_code::heard()
            .rays(rays)
            .n(bins)
            .sigma_min(*sigma_min_m)
            .ln_b(grid.base().ln())
            .lambda(&lambda)
            .rho(&rho)
            .hidden(&hidden)
            .code(&code)
            .run_into(&mut self.heard)?;
        Ok(seen.spread(grid, readings.len(), self.heard.distribution()))
    }
}

/// The bin of a reading: 0 is "No Detection".
fn bin(grid: &Grid, reading: &RangeReading) -> usize {
    let nearer = grid.edges_m().partition_point(|edge| *edge < f64::from(reading.range_m));
    if nearer > grid.cells_rho() { 0 } else { nearer.max(1) }
}

/// The directions that have a reading.
struct Seen {
    rays: Vec<usize>,
    readings: Vec<RangeReading>,
}

impl Seen {
    fn of(readings: &[Option<RangeReading>]) -> Self {
        let (rays, readings) =
            readings.iter().enumerate().filter_map(|(ray, reading)| Some((ray, (*reading)?))).unzip();
        Self { rays, readings }
    }

    fn lambda(&self) -> Vec<f32> {
        self.readings.iter().map(|reading| reading.confidence).collect()
    }

    fn rho(&self) -> Vec<f32> {
        self.readings.iter().map(|reading| reading.range_m).collect()
    }

    /// Distributes the answers of rays over all directions.
    fn spread(&self, grid: &Grid, directions: usize, answers: &[f32]) -> Likelihood {
        let mut likelihood = vec![1.0; 2 * grid.cells_rho() * directions];
        let planes = likelihood.chunks_exact_mut(directions.max(1));
        for (plane, answers) in planes.zip(answers.chunks_exact(self.rays.len().max(1))) {
            self.rays.iter().zip(answers).for_each(|(ray, answer)| plane[*ray] = *answer);
        }
        likelihood
    }
}
