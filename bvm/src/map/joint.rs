//! The map with the joint distribution of O and V carried: `models/cell_joint.bp`.
//!
//! In: P(V) of the step before, and P(O | V). Out: the same answers as `models/cell.bp`. Invariant: where the two marginals say
//! all, as in a map that knows nothing, both programs answer the same.
//!
//! The program reads P(O | V) at the antecedent, also where that is outside the grid. So the kernel runs on a grid with one shell
//! more, which stands for all that is outside: its content is unknown, and its answers are dropped.

use super::VELOCITIES;
use crate::error::Error;
use crate::grid::Grid;
use crate::programs::{cell, cell_joint};
use bp_core::compiler::exec::compiled::Report;
use bp_core::compiler::space::{Edge, Moves, Space};

/// What is carried beside the marginals, and buffers.
#[derive(Clone, Debug)]
pub(super) struct Joint {
    /// P(O = 1 | V) − ½, by `[velocity][ρ][φ][θ]`.
    pub(super) lean: Vec<f32>,
    next: Vec<f32>,
    space: Space,
    moves: Moves,
    /// Cells of the grid, and of the shell outside.
    cells: usize,
    outside: usize,
    observed: cell_joint::observe::Answer<f32>,
    carried: cell_joint::carried::Answer<f32>,
}

impl Joint {
    /// Of a map that knows nothing.
    ///
    /// # Errors
    /// Those of the space.
    pub(super) fn unknown(grid: &Grid) -> Result<Self, Error> {
        let shells = grid.cells_rho();
        let extents = [shells + 1, grid.elevation_cells(), grid.azimuth_cells()];
        let space = Space::new(extents, [Edge::Open, Edge::Pole, Edge::Circle])?;
        let mut moves = space.antecedents(&VELOCITIES);
        let rows = grid.elevation_cells();
        for (at, (depth, row)) in moves.depth.iter_mut().zip(&mut moves.row).enumerate() {
            if *depth < 0 {
                (*depth, *row) = (shells as i32, (at % rows) as i32);
            }
        }
        Ok(Self {
            lean: vec![0.0; VELOCITIES.len() * grid.cells()],
            next: Vec::new(),
            space,
            moves,
            cells: grid.cells(),
            outside: grid.directions(),
            observed: Default::default(),
            carried: Default::default(),
        })
    }

    /// Some numbers by `[…][cell]` with a shell more, of the numbers that `fill` gives.
    fn with_outside(&self, numbers: &[f32], fill: impl Fn(usize) -> f32) -> Vec<f32> {
        let planes = numbers.chunks_exact(self.cells).enumerate();
        let plane = |(at, plane): (usize, &[f32])| {
            plane.iter().copied().chain(std::iter::repeat_n(fill(at), self.outside)).collect::<Vec<f32>>()
        };
        planes.flat_map(plane).collect()
    }

    /// The numbers without the shell.
    fn without_outside(&self, numbers: &[f32]) -> Vec<f32> {
        let planes = numbers.chunks_exact(self.cells + self.outside);
        planes.flat_map(|plane| plane[..self.cells].iter().copied()).collect()
    }

    /// The answers of a step from P(V); what it carries is kept until [`Joint::accept`].
    ///
    /// # Errors
    /// A likelihood of the wrong length.
    pub(super) fn step(
        &mut self,
        (epsilon, motion): (f64, &[f32]),
        velocity: &[f32],
        (sensors, readings): (usize, &[f32]),
        next: &mut cell::observe::Answer<f32>,
    ) -> Result<Report, Error> {
        let velocity = self.with_outside(velocity, |at| motion[at]);
        let lean = self.with_outside(&self.lean, |_| 0.0);
        let readings = self.with_outside(readings, |_| 1.0);
        let question =
            cell_joint::observe(&self.space, &self.moves).epsilon(epsilon).motion(motion).lean(&lean);
        let question = question.previous_v(&velocity).sensors(sensors);
        let report = question.sensors_i_reading(&readings).run_into(&mut self.observed)?;
        *next.distribution_o_mut() = self.without_outside(self.observed.distribution_o());
        *next.distribution_v_mut() = self.without_outside(self.observed.distribution_v());
        *next.entropy_o_v_mut() = self.without_outside(self.observed.entropy_o_v());
        *next.entropy_o_mut() = self.without_outside(self.observed.entropy_o());
        let question =
            cell_joint::carried(&self.space, &self.moves).epsilon(epsilon).motion(motion).lean(&lean);
        let question = question.previous_v(&velocity).sensors(sensors);
        question.sensors_i_reading(&readings).run_into(&mut self.carried)?;
        let carried = self.without_outside(self.carried.distribution());
        self.next.clear();
        for both in carried.chunks_exact(2 * self.cells) {
            let (empty, occupied) = both.split_at(self.cells);
            // A velocity that is impossible says nothing.
            let lean = |(empty, occupied): (&f32, &f32)| {
                if empty + occupied > 0.5 { occupied - 0.5 } else { 0.0 }
            };
            self.next.extend(empty.iter().zip(occupied).map(lean));
        }
        Ok(report)
    }

    /// What the last step would carry, taken away.
    pub(super) fn take(&mut self) -> Vec<f32> {
        std::mem::take(&mut self.next)
    }

    /// Carries what was taken away, but in some cells what the last step would carry.
    pub(super) fn put_back(&mut self, taken: Vec<f32>, replaced: &[usize]) {
        let last = std::mem::replace(&mut self.next, taken);
        for (to, from) in self.next.chunks_exact_mut(self.cells).zip(last.chunks_exact(self.cells)) {
            replaced.iter().for_each(|cell| to[*cell] = from[*cell]);
        }
    }

    /// What the last step carries is that of the step before the next.
    pub(super) fn accept(&mut self) {
        std::mem::swap(&mut self.lean, &mut self.next);
    }
}
