//! Hearing: interaural cues as evidence for the map (`models/binaural.bp`).
//!
//! In: the interaural time and level differences of one moment, and the heading. Out: their likelihood for each cell of
//! the map, empty or occupied. Invariant: the expected cues of a cell are those of a spherical head at the exact angle
//! of the cell's centre; a cell that does not match is uninformative, so hearing is evidence for occupancy, and almost
//! none for emptiness.

use crate::error::Error;
use crate::frame::Spherical;
use crate::grid::Grid;
use crate::map::{Heading, Likelihood};
use crate::programs::binaural;
use crate::world::sensors::{CHANNELS, Cues, cues_of};

/// The calibrated ears.
#[derive(Clone, Debug)]
pub struct Hearing {
    grid: Grid,
    cells: usize,
    heading: Heading,
    mu_tau: Vec<f32>,
    mu_l: Vec<f32>,
    answer: binaural::reading::Answer<f32>,
    sounding: binaural::source::Answer<f32>,
}

/// Answers either question for observed cues.
macro_rules! asked {
    ($question:ident, $hearing:expr, $cues:expr, $answer:expr) => {
        binaural::$question()
            .grid($hearing.cells)
            .channels(CHANNELS)
            .mu_tau(&$hearing.mu_tau)
            .mu_l(&$hearing.mu_l)
            .tau(&[$cues.itd_s as f32])
            .l(&$cues.ild_db.map(|level| level as f32))
            .run_into($answer)
    };
}

impl Hearing {
    /// Ears on a spherical head that faces ahead, calibrated for each cell of a grid.
    pub fn calibrated(grid: &Grid) -> Self {
        let cells = grid.cells();
        let mut hearing = Self {
            grid: grid.clone(),
            cells,
            heading: Heading::default(),
            mu_tau: vec![0.0; cells],
            mu_l: vec![0.0; CHANNELS * cells],
            answer: Default::default(),
            sounding: Default::default(),
        };
        hearing.calibrate();
        hearing
    }

    /// The same ears on a turned head: the expected cues of each cell of the map.
    pub fn turned(&mut self, heading: Heading) -> &mut Self {
        if heading != self.heading {
            self.heading = heading;
            self.calibrate();
        }
        self
    }

    fn calibrate(&mut self) {
        for index in 0..self.cells {
            let cell = self.grid.cell(index).expect("internal: an index below the number of cells");
            let centre = self.grid.centre(cell);
            let cues = cues_of(Spherical { azimuth: self.heading.relative(centre.azimuth), ..centre });
            self.mu_tau[index] = cues.itd_s as f32;
            for (channel, level) in cues.ild_db.iter().enumerate() {
                self.mu_l[channel * self.cells + index] = *level as f32;
            }
        }
    }

    /// The likelihood of cues: P(τ ΔL | O C).
    ///
    /// # Errors
    /// Only the kernel's own checks, which valid data pass.
    pub fn likelihood(&mut self, cues: &Cues) -> Result<Likelihood, Error> {
        asked!(reading, self, cues, &mut self.answer)?;
        let likelihood = self.answer.distribution();
        // The density of the cues is the same in every cell that does not match; only ratios matter to the map.
        let most = likelihood.iter().fold(f32::MIN_POSITIVE, |most, value| most.max(*value));
        Ok(likelihood.iter().map(|value| value / most).collect())
    }

    /// P(S = 1 | τ ΔL) of each cell: the posterior of the source.
    ///
    /// # Errors
    /// Only the kernel's own checks, which valid data pass.
    pub fn sounding(&mut self, cues: &Cues) -> Result<&[f32], Error> {
        asked!(source, self, cues, &mut self.sounding)?;
        Ok(self.sounding.p(true))
    }
}
