//! Directions in view without a reading, as evidence: `models/missing.bp`.
//!
//! In: the view of each look, the likelihood of its readings, the map. Out: likelihoods of the directions that were silent.
//! Invariant: a cell about which no reading ever told anything gets no evidence from silence.

use crate::error::Error;
use crate::map::{Likelihood, Map};
use crate::programs::missing;

/// A likelihood ratio above this, or below its inverse, is evidence about a cell.
const TELLS: f32 = 1.2;

/// What was read so far.
#[derive(Clone, Debug)]
pub struct Missing {
    /// Of each cell, `[ρ][φ][θ]`: 1 if readings told something about it, 0 if none did.
    was_read: Vec<f32>,
    answer: missing::nothing::Answer<f32>,
}

impl Missing {
    /// Nothing was read in any of some cells.
    pub fn new(cells: usize) -> Self {
        Self { was_read: vec![0.0; cells], answer: Default::default() }
    }

    /// What was read, to go on with later.
    pub fn was_read(&self) -> &[f32] {
        &self.was_read
    }

    /// Goes on with what was read earlier; without effect if the numbers are not those of the same cells.
    pub fn restore(&mut self, was_read: &[f32]) {
        if was_read.len() == self.was_read.len() {
            self.was_read.copy_from_slice(was_read);
        }
    }

    /// Adds the likelihood of the silent directions to that of a look's readings, and remembers where readings came from.
    /// `view` is whether each direction in view had a reading; `likelihood` is ones where it had none.
    ///
    /// # Errors
    /// Only the kernel's own checks, which valid data pass.
    pub fn add(
        &mut self,
        map: &Map,
        view: &[Option<bool>],
        likelihood: &mut Likelihood,
    ) -> Result<(), Error> {
        let (directions, bins) = (map.grid().directions(), map.grid().cells_rho());
        let cells = directions * bins;
        let silent: Vec<usize> = (0..directions).filter(|ray| view[*ray] == Some(false)).collect();
        let each = |of: &[f32], first: usize| -> Vec<f32> {
            let none = std::iter::repeat_n(0.0, first * silent.len());
            none.chain((0..bins).flat_map(|rho| silent.iter().map(move |ray| of[rho * directions + ray])))
                .collect()
        };
        if !silent.is_empty() {
            missing::nothing()
                .rays(silent.len())
                .n(bins)
                .hidden(&each(map.occupancy(), 0))
                .was_read(&each(&self.was_read, 1))
                .run_into(&mut self.answer)?;
            let planes = self.answer.distribution().chunks_exact(silent.len());
            for (plane, answers) in likelihood.chunks_exact_mut(directions).zip(planes) {
                silent.iter().zip(answers).for_each(|(ray, answer)| plane[*ray] = *answer);
            }
        }
        let (empty, occupied) = likelihood.split_at(cells);
        for ray in (0..directions).filter(|ray| view[*ray] == Some(true)) {
            for cell in (0..bins).map(|rho| rho * directions + ray) {
                // A surface there gave the reading; or a reading came through the cell, so that a surface there is new, and
                // would be read.
                let (low, high) = (occupied[cell].min(empty[cell]), occupied[cell].max(empty[cell]));
                if high > TELLS * low {
                    self.was_read[cell] = 1.0;
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::{Grid, GridConfiguration};

    /// Four directions of three cells each.
    fn map() -> Map {
        let configuration = GridConfiguration {
            cells_rho: 3,
            rho_min_m: 1.0,
            rho_max_m: 8.0,
            azimuth_cells: 4,
            elevation_cells: 1,
        };
        Map::new(Grid::new(configuration).unwrap()).unwrap()
    }

    #[test]
    fn silence_is_evidence_where_a_reading_was_and_nowhere_else() {
        let (mut map, mut missing) = (map(), Missing::new(12));
        // Direction 0 is read at its second cell: free, surface, hidden.
        let mut read = vec![1f32; 24];
        (read[12], read[4], read[12 + 4]) = (0.01, 0.01, 1.0);
        missing.add(&map, &[Some(true), None, Some(false), None], &mut read).unwrap();
        let silent = &read[2..12];
        assert!(
            silent.iter().step_by(4).all(|empty| (empty / read[12 + 2] - 1.0).abs() < 1e-6),
            "unread: no evidence"
        );
        map.observe(&[&read]).unwrap();
        let before = f64::from(map.occupancy()[4]);
        assert!(before > 0.98);
        let mut nothing = vec![1f32; 24];
        missing.add(&map, &[Some(false), None, None, None], &mut nothing).unwrap();
        // By hand: with a surface there, the first one is there or before it, and silent with probability 0.1. Without it
        // silence is certain, but for a surface before it, of probability 1 − f.
        let f = 1.0 - f64::from(map.occupancy()[0]);
        let expected = 0.1 / (f + 0.1 * (1.0 - f));
        let found = f64::from(nothing[12 + 4] / nothing[4]);
        assert!((found - expected).abs() < 1e-4, "{found}, not {expected}");
        for look in 1..=3 {
            let mut nothing = vec![1f32; 24];
            missing.add(&map, &[Some(false), None, None, None], &mut nothing).unwrap();
            map.observe(&[&nothing]).unwrap();
            println!("look {look}: {}", map.occupancy()[4]);
        }
        assert!(map.occupancy()[4] < 0.1, "three looks are enough: {}", map.occupancy()[4]);
    }
}
