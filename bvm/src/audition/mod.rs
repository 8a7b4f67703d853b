//! Hearing: interaural cues as evidence for the map (`models/binaural.bp`).
//!
//! In: the time and level differences of one moment. Out: their likelihood for each cell, empty or occupied, in
//! the head's frame. Invariant: the cues that each cell would make are those of a spherical head, computed once;
//! a cell that does not fit says nothing, so hearing is evidence for occupancy, and almost none for emptiness.

use crate::error::Error;
use crate::grid::Grid;
use crate::map::Likelihood;
use crate::programs::binaural::{self, reading, source};
use crate::world::sensors::{CHANNELS, Cues, cues_of};

/// The calibrated ears.
#[derive(Clone, Debug)]
pub struct Hearing {
    cells: usize,
    mu_tau: Vec<f32>,
    mu_l: Vec<f32>,
    answer: reading::Outputs<f32>,
    sounding: source::Outputs<f32>,
}

/// What both questions are given.
macro_rules! inputs {
    ($question:ident, $hearing:expr, $cues:expr) => {
        $question::Inputs {
            grid: $hearing.cells,
            channels: CHANNELS,
            rate: binaural::DEFAULT_RATE as f32,
            tau_max: binaural::DEFAULT_TAU_MAX as f32,
            l_max: binaural::DEFAULT_L_MAX as f32,
            sigma_tau: binaural::DEFAULT_SIGMA_TAU as f32,
            sigma_l: binaural::DEFAULT_SIGMA_L as f32,
            mu_tau: &$hearing.mu_tau,
            mu_l: &$hearing.mu_l,
            tau: &[$cues.itd_s as f32],
            l: &$cues.ild_db.map(|level| level as f32),
        }
    };
}

impl Hearing {
    /// Ears on a spherical head, calibrated for each cell of a grid.
    pub fn calibrated(grid: &Grid) -> Self {
        let cells = grid.cells();
        let (mut mu_tau, mut mu_l) = (Vec::with_capacity(cells), vec![0.0; CHANNELS * cells]);
        for index in 0..cells {
            let cell = grid.cell(index).expect("internal: an index below the number of cells");
            let cues = cues_of(grid.centre(cell));
            mu_tau.push(cues.itd_s as f32);
            for (channel, level) in cues.ild_db.iter().enumerate() {
                mu_l[channel * cells + index] = *level as f32;
            }
        }
        Self { cells, mu_tau, mu_l, answer: Default::default(), sounding: Default::default() }
    }

    /// The likelihood of cues: P(τ ΔL | O C).
    ///
    /// # Errors
    /// None that data can cause; the kernel's own checks.
    pub fn likelihood(&mut self, cues: &Cues) -> Result<Likelihood, Error> {
        reading::run(&inputs!(reading, self, cues), &mut self.answer)?;
        let likelihood = &self.answer.p_tau_l;
        // The cues' density is the same number in every cell that does not fit; only ratios matter to the map.
        let most = likelihood.iter().fold(f32::MIN_POSITIVE, |most, value| most.max(*value));
        Ok(likelihood.iter().map(|value| value / most).collect())
    }

    /// P(S = 1 | τ ΔL) of each cell: where the sound may come from.
    ///
    /// # Errors
    /// None that data can cause; the kernel's own checks.
    pub fn sounding(&mut self, cues: &Cues) -> Result<&[f32], Error> {
        source::run(&inputs!(source, self, cues), &mut self.sounding)?;
        Ok(&self.sounding.p_s[self.cells..])
    }
}
