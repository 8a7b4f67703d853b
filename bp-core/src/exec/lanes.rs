//! Lanes: kernels run at run time, one walk of each expression per block of cells.
//!
//! In: a kernel and its inputs, in f32 or f64. Out: its outputs. Invariant: blocks are independent and each is
//! computed in the same order whatever the number of threads, so results do not depend on it.
//!
//! The plate's rows are shared out among threads (rayon); each thread walks its rows in blocks of as many
//! lanes as the caches hold, and evaluates the schedule's values for a whole block before the next value.

mod block;

use super::inputs::{Array, Bound};
use super::scalar::Scalar;
use super::{Inputs, Outputs};
use crate::error::Error;
use crate::ids::{BufferId, Id};
use crate::kernel::schedule::{Group, Schedule};
use crate::kernel::{Kernel, Role};
use block::{Block, Piece};
use rayon::prelude::*;

/// Work for a thread at a time, in cells.
const CHUNK_CELLS: usize = 8192;

/// A kernel that is ready to be run again and again.
#[derive(Clone, Debug)]
pub struct Lanes {
    kernel: Kernel,
    schedule: Schedule,
}

impl Lanes {
    /// Schedules a kernel.
    pub fn new(kernel: Kernel) -> Self {
        let schedule = Schedule::of(&kernel);
        Self { kernel, schedule }
    }

    /// The kernel.
    pub fn kernel(&self) -> &Kernel {
        &self.kernel
    }

    /// How many values each axis of an output has.
    ///
    /// # Errors
    /// An input that is missing or does not fit.
    pub fn extents<T: Scalar>(&self, output: &str, inputs: &Inputs<'_, T>) -> Result<Vec<usize>, Error> {
        let bound = inputs.bind(&self.kernel)?;
        let buffer = self.kernel.buffer(output).expect("internal: the output exists");
        Ok(self.kernel.buffers[buffer].axes.iter().map(|axis| bound.extent(*axis)).collect())
    }

    /// Runs the kernel.
    ///
    /// # Errors
    /// An input that is missing or does not fit.
    pub fn run<T: Scalar>(&self, inputs: &Inputs<'_, T>) -> Result<Outputs<T>, Error> {
        let mut outputs = Outputs { arrays: Vec::new() };
        self.run_into(inputs, &mut outputs)?;
        Ok(outputs)
    }

    /// Runs the kernel again, into the arrays of an earlier answer: large ones are not asked of the system anew.
    ///
    /// # Errors
    /// As [`Lanes::run`]; the earlier answer is gone then.
    pub fn run_into<T: Scalar>(&self, inputs: &Inputs<'_, T>, outputs: &mut Outputs<T>) -> Result<(), Error> {
        let bound = inputs.bind(&self.kernel)?;
        let mut earlier = std::mem::take(&mut outputs.arrays).into_iter();
        let mut made: Vec<Vec<T>> = Vec::new();
        for (id, buffer) in self.kernel.buffers.iter() {
            let mut cells = match buffer.role {
                Role::Output => earlier.next().map(|(_, cells)| cells).unwrap_or_default(),
                _ => Vec::new(),
            };
            let full =
                matches!(buffer.role, Role::Scratch | Role::Output) && !self.schedule.local[id.position()];
            if full {
                cells.resize(bound.length(id), T::ZERO);
            }
            made.push(cells);
        }
        let strides: Vec<Vec<usize>> =
            self.kernel.buffers.ids().map(|buffer| bound.strides(buffer)).collect();
        for group in &self.schedule.groups {
            self.group(&bound, &strides, group, &mut made);
        }
        let found = self.kernel.outputs();
        outputs.arrays = found
            .map(|(id, buffer)| (buffer.name.clone(), std::mem::take(&mut made[id.position()])))
            .collect();
        Ok(())
    }

    fn group<T: Scalar>(
        &self,
        bound: &Bound<'_, T>,
        strides: &[Vec<usize>],
        group: &Group,
        made: &mut [Vec<T>],
    ) {
        let targets: Vec<BufferId> = (group.nests.iter())
            .map(|nest| self.kernel.nests[nest.nest].out)
            .filter(|out| !self.schedule.local[out.position()])
            .collect();
        let mut taken: Vec<(BufferId, Vec<T>)> =
            targets.iter().map(|out| (*out, std::mem::take(&mut made[out.position()]))).collect();
        let parallel: &[_] = if group.parallel { &self.kernel.parallel } else { &[] };
        let (rows, lanes) = match parallel {
            [] => (1, 1),
            [lane] => (1, bound.extent(*lane)),
            [rows @ .., lane] => (rows.iter().map(|axis| bound.extent(*axis)).product(), bound.extent(*lane)),
        };
        // Rows are shared out; where there is only one, its lanes are.
        let (units, unit) = if rows > 1 { (rows, lanes) } else { (lanes, 1) };
        let per_chunk = (CHUNK_CELLS / unit).clamp(1, units);
        let mut pieces: Vec<Piece<'_, T>> = (0..units.div_ceil(per_chunk))
            .map(|chunk| {
                let first = chunk * per_chunk;
                Piece::new(first, per_chunk.min(units - first), rows > 1)
            })
            .collect();
        for (out, cells) in &mut taken {
            if parallel.is_empty() {
                pieces[0].add(*out, cells);
                continue;
            }
            for plane in cells.chunks_mut(units * unit) {
                for (piece, part) in pieces.iter_mut().zip(plane.chunks_mut(per_chunk * unit)) {
                    piece.add(*out, part);
                }
            }
        }
        let finished: &[Vec<T>] = made;
        let run = |piece: &mut Piece<'_, T>| {
            Block::new(&self.kernel, &self.schedule, bound, finished, strides, group).piece(piece, lanes);
        };
        match pieces.len() {
            1 => pieces.iter_mut().for_each(run),
            _ => pieces.par_iter_mut().for_each(run),
        }
        for (out, cells) in taken {
            made[out.position()] = cells;
        }
    }
}
