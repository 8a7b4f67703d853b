//! Lanes: kernels executed at run time, as a flat program of tight loops over blocks of cells.
//!
//! In: a kernel and its inputs, in f32 or f64. Out: its outputs. Invariant: each cell is computed in the same order for
//! any number of threads, so that results do not depend on it.
//!
//! When all extents are known, the schedule becomes a flat program: [`passes`] assigns the axes, [`build`] unrolls
//! short loops, so that indices and conditions become constants and equal values are merged, [`layout`] fuses
//! instructions and assigns slots. The program and its memory are reused by the next run with the same extents.
//! `machine` executes it: pieces of the plate are divided among threads (rayon).

mod arithmetic;
mod build;
mod code;
mod layout;
mod loads;
mod machine;
mod passes;
mod reads;
mod shape;
mod values;

use super::inputs::{Array, Bound};
use super::scalar::Scalar;
use super::{Inputs, Outputs};
use crate::error::Error;
use crate::ids::{BufferId, Id};
use crate::kernel::schedule::Schedule;
use crate::kernel::{Kernel, Role};
use code::Pass;
use machine::{Machine, Piece};
use rayon::prelude::*;
use reads::Arrays;
use shape::Known;
use std::any::Any;
use std::sync::Mutex;

/// Size of a thread's work unit, in cells.
const CHUNK_CELLS: usize = 8192;

/// A kernel prepared for repeated runs.
#[derive(Debug)]
pub struct Lanes {
    kernel: Kernel,
    schedule: Schedule,
    /// Programs of earlier runs, each a [`Ready`] of its precision: one for each concurrent run.
    ready: Mutex<Vec<Box<dyn Any + Send>>>,
}

impl Clone for Lanes {
    fn clone(&self) -> Self {
        Self { kernel: self.kernel.clone(), schedule: self.schedule.clone(), ready: Mutex::default() }
    }
}

/// The kind of an input, as far as a program depends on it.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Given {
    /// By the kernel itself.
    Own,
    Whole,
    Once,
    Default,
}

/// A program for given extents and kinds of inputs, with its memory.
#[derive(Debug)]
struct Ready<T: Scalar> {
    extents: Vec<usize>,
    given: Vec<Given>,
    defaults: Vec<T>,
    passes: Vec<Pass>,
    /// Passes that depend on no input, and whether they have run.
    settled: Vec<bool>,
    has_run: bool,
    /// Machines that no thread uses, by pass.
    machines: Vec<Mutex<Vec<Machine<T>>>>,
    /// The arrays that passes compute for each other and for the host, by buffer.
    made: Vec<Vec<T>>,
}

fn given<T: Scalar>(array: &Array<'_, T>) -> Given {
    match array {
        Array::Broadcast(_) => Given::Once,
        Array::Default => Given::Default,
        Array::Owned(_) => Given::Own,
        _ => Given::Whole,
    }
}

impl<T: Scalar> Ready<T> {
    fn new(kernel: &Kernel, schedule: &Schedule, bound: &Bound<'_, T>) -> Self {
        let extents: Vec<usize> = kernel.axes.ids().map(|axis| bound.extent(axis)).collect();
        let strides: Vec<Vec<usize>> = kernel.buffers.ids().map(|buffer| bound.strides(buffer)).collect();
        let bytes = size_of::<T>();
        let given: Vec<Given> = bound.arrays.values().map(given).collect();
        let own = |buffer: BufferId| given[buffer.position()] == Given::Own;
        let narrow = bytes < size_of::<f64>();
        let known = Known { kernel, extents: &extents, strides: &strides, own: &own, narrow };
        let passes = passes::passes(&known, schedule, bytes);
        let mut made = vec![Vec::new(); kernel.buffers.len()];
        for (buffer, _) in passes.iter().flat_map(|pass| &pass.made) {
            made[buffer.position()] = match kernel.buffers[*buffer].role {
                Role::Output(_) => Vec::new(),
                _ => vec![T::ZERO; bound.length(*buffer)],
            };
        }
        let mut stays: Vec<bool> = kernel.buffers.ids().map(own).collect();
        let mut settled = Vec::new();
        for pass in &passes {
            let is_output = |buffer: BufferId| kernel.buffers[buffer].role.output().is_some();
            settled.push(pass.is_settled(|buffer| stays[buffer.position()], is_output));
            pass.made.iter().for_each(|(buffer, _)| stays[buffer.position()] = settled[settled.len() - 1]);
        }
        Self {
            given,
            defaults: kernel.buffers.ids().map(|buffer| T::from_f64(bound.default(buffer))).collect(),
            machines: passes.iter().map(|_| Mutex::default()).collect(),
            extents,
            passes,
            settled,
            has_run: false,
            made,
        }
    }

    fn fits(&self, kernel: &Kernel, bound: &Bound<'_, T>) -> bool {
        kernel.axes.ids().zip(&self.extents).all(|(axis, extent)| bound.extent(axis) == *extent)
            && bound.arrays.values().zip(&self.given).all(|(array, known)| given(array) == *known)
    }

    fn run(&mut self, kernel: &Kernel, bound: &Bound<'_, T>) {
        for ((pass, machines), settled) in self.passes.iter().zip(&self.machines).zip(&self.settled) {
            if *settled && self.has_run {
                continue;
            }
            let mut taken: Vec<Vec<T>> =
                pass.made.iter().map(|(out, _)| std::mem::take(&mut self.made[out.position()])).collect();
            let numbers = kernel.buffers.ids().map(|id| match &bound.arrays[id] {
                Array::Given(cells) | Array::Broadcast(cells) | Array::Owned(cells) => cells,
                Array::Default => &self.defaults[id.position()..][..1],
                Array::Positions(_) => &[],
                Array::Made => self.made[id.position()].as_slice(),
            });
            let positions = bound.arrays.values().map(|array| match array {
                Array::Positions(cells) => *cells,
                _ => [].as_slice(),
            });
            let arrays = Arrays { numbers: numbers.collect(), positions: positions.collect() };
            let run = |piece: &mut Piece<'_, T>| {
                let spare = machines.lock().expect("internal: no thread has failed").pop();
                let mut machine = spare.unwrap_or_else(|| Machine::new(pass, kernel.axes.len()));
                machine.piece(pass, &arrays, piece);
                machines.lock().expect("internal: no thread has failed").push(machine);
            };
            let mut pieces = pieces(pass, &mut taken);
            match pieces.len() {
                1 => pieces.iter_mut().for_each(run),
                _ => pieces.par_iter_mut().for_each(run),
            }
            for ((out, _), cells) in pass.made.iter().zip(taken) {
                self.made[out.position()] = cells;
            }
        }
        self.has_run = true;
    }
}

/// Divides the rows of a pass among threads; if there is only one, its lanes.
fn pieces<'p, T>(pass: &Pass, made: &'p mut [Vec<T>]) -> Vec<Piece<'p, T>> {
    let (rows, cells) = pass.rows_of_cells();
    let (units, unit) = if pass.has_rows() { (rows, cells) } else { (pass.lanes, 1) };
    let work = if pass.has_rows() { pass.lanes } else { 1 };
    let per_piece = (CHUNK_CELLS / work).clamp(1, units);
    let whole = per_piece == units;
    let mut pieces: Vec<Piece<'_, T>> = (0..units.div_ceil(per_piece))
        .map(|piece| {
            let first = piece * per_piece;
            let parts = made.iter().map(|_| Vec::new()).collect();
            Piece { first, count: per_piece.min(units - first), whole, parts }
        })
        .collect();
    for (number, cells) in made.iter_mut().enumerate() {
        if whole {
            pieces[0].parts[number].push(cells);
            continue;
        }
        for plane in cells.chunks_mut(units * unit) {
            for (piece, part) in pieces.iter_mut().zip(plane.chunks_mut(per_piece * unit)) {
                piece.parts[number].push(part);
            }
        }
    }
    pieces
}

impl Lanes {
    /// Schedules a kernel.
    pub fn new(kernel: Kernel) -> Self {
        let schedule = Schedule::of(&kernel);
        Self { kernel, schedule, ready: Mutex::default() }
    }

    /// The kernel.
    pub fn kernel(&self) -> &Kernel {
        &self.kernel
    }

    /// Runs the kernel.
    ///
    /// # Errors
    /// An input that is missing or does not fit.
    pub fn run<T: Scalar>(&self, inputs: &Inputs<'_, T>) -> Result<Outputs<T>, Error> {
        Ok(self.run_shaped(inputs)?.0)
    }

    /// Runs the kernel; also returns the extent of each axis of each output.
    ///
    /// # Errors
    /// As [`Lanes::run`].
    pub fn run_shaped<T: Scalar>(
        &self,
        inputs: &Inputs<'_, T>,
    ) -> Result<(Outputs<T>, Vec<Vec<usize>>), Error> {
        let bound = inputs.bind(&self.kernel)?;
        let mut outputs = Outputs { arrays: Vec::new() };
        self.run_bound(&bound, &mut outputs);
        let axes = |id: BufferId| self.kernel.buffers[id].axes.iter();
        let extents = |id: BufferId| axes(id).map(|axis| bound.extent(*axis)).collect();
        Ok((outputs, self.kernel.outputs().map(|(id, _)| extents(id)).collect()))
    }

    /// Runs the kernel again, into the arrays of an earlier answer, without new allocations.
    ///
    /// # Errors
    /// As [`Lanes::run`]; the earlier answer is then unchanged.
    pub fn run_into<T: Scalar>(&self, inputs: &Inputs<'_, T>, outputs: &mut Outputs<T>) -> Result<(), Error> {
        self.run_bound(&inputs.bind(&self.kernel)?, outputs);
        Ok(())
    }

    fn run_bound<T: Scalar>(&self, bound: &Bound<'_, T>, outputs: &mut Outputs<T>) {
        let kept = self.ready.lock().expect("internal: no run has failed").pop();
        let kept = kept.and_then(|kept| kept.downcast::<Ready<T>>().ok());
        let kept = kept.filter(|ready| ready.fits(&self.kernel, bound));
        let mut ready = kept.unwrap_or_else(|| Box::new(Ready::new(&self.kernel, &self.schedule, bound)));
        let known = outputs.arrays.iter().map(|(key, _)| *key);
        if !known.eq(self.kernel.outputs().map(|(_, key)| key)) {
            outputs.arrays = self.kernel.outputs().map(|(_, key)| (key, Vec::new())).collect();
        }
        for ((id, _), (_, cells)) in self.kernel.outputs().zip(&mut outputs.arrays) {
            cells.resize(bound.length(id), T::ZERO);
            std::mem::swap(cells, &mut ready.made[id.position()]);
        }
        ready.run(&self.kernel, bound);
        for ((id, _), (_, cells)) in self.kernel.outputs().zip(&mut outputs.arrays) {
            std::mem::swap(cells, &mut ready.made[id.position()]);
        }
        self.ready.lock().expect("internal: no run has failed").push(ready);
    }
}
