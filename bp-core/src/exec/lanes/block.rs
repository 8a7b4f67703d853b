//! One thread's walk: blocks of lanes, one value at a time.
//!
//! In: a group of nests and a [`Piece`] of the plate. Out: that piece of the group's buffers. Invariant: a value
//! is computed before it is needed, because a schedule's levels are in the order of the arena.

mod arithmetic;
mod loads;

use super::{Array, Bound, Scalar};
use crate::ids::{AxisId, BufferId, Id, ValueId};
use crate::kernel::schedule::{Group, Loops, Schedule};
use crate::kernel::{Fold, Kernel, Node, Reduce};
use arithmetic::{Lane, Work};
use pulp::Arch;

/// Consecutive rows of the plate (or lanes, where it has one row), and their part of each plane made there.
pub(super) struct Piece<'p, T> {
    first: usize,
    count: usize,
    rows: bool,
    parts: Vec<(BufferId, &'p mut [T])>,
}

impl<'p, T> Piece<'p, T> {
    pub(super) fn new(first: usize, count: usize, rows: bool) -> Self {
        Self { first, count, rows, parts: Vec::new() }
    }

    /// Adds this piece's part of the next plane of a buffer.
    pub(super) fn add(&mut self, buffer: BufferId, part: &'p mut [T]) {
        self.parts.push((buffer, part));
    }
}

/// Bytes of lanes that are held at once: they stay in the second cache of any processor of today.
const MOST_BYTES: usize = 128 << 10;

/// Lanes in a block: as many as the caches hold, so that the walk is paid for.
fn block_lanes<T>(slots: usize) -> usize {
    (MOST_BYTES / (size_of::<T>() * slots.max(1))).clamp(64, 1024) / 64 * 64
}

/// Where the lanes of a value stand.
#[derive(Clone, Copy)]
enum View {
    /// In its own slot.
    Own,
    /// The same number in all lanes: the first of its slot.
    Same,
    /// In the buffer that it reads, from here on.
    There(BufferId, usize),
}

pub(super) struct Block<'b, T> {
    kernel: &'b Kernel,
    schedule: &'b Schedule,
    bound: &'b Bound<'b, T>,
    finished: &'b [Vec<T>],
    group: &'b Group,
    /// Lanes held for each value; one where nothing is parallel.
    stride: usize,
    /// Lanes in use.
    width: usize,
    running: Vec<usize>,
    /// Numbers of uniform values.
    uniform: Vec<f64>,
    /// Lanes of varying values.
    varying: Vec<Vec<T>>,
    /// Which lanes each varying value has.
    slot: Vec<usize>,
    /// Where they really are.
    view: Vec<View>,
    instructions: Arch,
    /// What this group makes, by buffer: serial cells × lanes.
    made: Vec<Vec<T>>,
    /// How far apart neighbours along each axis are, for buffers that are finished, and for those made here.
    strides: &'b [Vec<usize>],
    own_strides: Vec<Vec<usize>>,
    folded: Vec<T>,
    /// For each buffer, how much of it has been copied out.
    planes: Vec<usize>,
}

impl<'b, T: Scalar> Block<'b, T> {
    pub(super) fn new(
        kernel: &'b Kernel,
        schedule: &'b Schedule,
        bound: &'b Bound<'b, T>,
        finished: &'b [Vec<T>],
        strides: &'b [Vec<usize>],
        group: &'b Group,
    ) -> Self {
        let (mut slot, mut slots) = (vec![0; kernel.nodes.len()], 0);
        for value in group.nests.iter().flat_map(|nest| nest.levels.iter().flatten()) {
            if schedule.is_varying(*value) && slot[value.position()] == 0 {
                slots += 1;
                slot[value.position()] = slots;
            }
        }
        let stride = if group.parallel { block_lanes::<T>(slots) } else { 1 };
        let mut made = vec![Vec::new(); kernel.buffers.len()];
        let mut own_strides = vec![Vec::new(); kernel.buffers.len()];
        for nest in &group.nests {
            let out = kernel.nests[nest.nest].out;
            let axes = &kernel.buffers[out].axes;
            let (mut size, mut own) = (stride, vec![0; axes.len()]);
            for (position, axis) in axes.iter().enumerate().rev() {
                if !(group.parallel && kernel.parallel.contains(axis)) {
                    own[position] = size;
                    size *= bound.extent(*axis);
                }
            }
            own_strides[out.position()] = own;
            made[out.position()] = vec![T::ZERO; size];
        }
        Self {
            kernel,
            schedule,
            bound,
            finished,
            group,
            stride,
            width: 1,
            running: vec![0; kernel.axes.len()],
            uniform: vec![0.0; kernel.nodes.len()],
            varying: vec![vec![T::ZERO; stride]; slots + 1],
            slot,
            view: vec![View::Own; kernel.nodes.len()],
            instructions: Arch::new(),
            made,
            strides,
            own_strides,
            folded: vec![T::ZERO; stride],
            planes: vec![0; kernel.buffers.len()],
        }
    }

    /// Runs a piece of the plate.
    pub(super) fn piece(&mut self, piece: &mut Piece<'_, T>, lanes: usize) {
        let (rows, span) = match piece.rows {
            true => (piece.first..piece.first + piece.count, 0..lanes),
            false => (0..1, piece.first..piece.first + piece.count),
        };
        for row in rows {
            self.set_row(row);
            for start in span.clone().step_by(self.stride) {
                self.width = self.stride.min(span.end - start);
                if let (Some(lane), true) = (self.kernel.parallel.last(), self.group.parallel) {
                    self.running[lane.position()] = start;
                }
                let group = self.group;
                for nest in &group.nests {
                    self.nest(nest, 0);
                }
                let offset = match piece.rows {
                    true => (row - piece.first) * lanes + start,
                    false => start - piece.first,
                };
                self.copy_out(piece, offset);
            }
        }
    }

    fn set_row(&mut self, mut row: usize) {
        if !self.group.parallel {
            return;
        }
        let (_, rows) = self.kernel.parallel.split_last().expect("internal: a parallel group has axes");
        for axis in rows.iter().rev() {
            self.running[axis.position()] = row % self.bound.extent(*axis);
            row /= self.bound.extent(*axis);
        }
    }

    fn copy_out(&mut self, piece: &mut Piece<'_, T>, offset: usize) {
        let mut planes = std::mem::take(&mut self.planes);
        planes.fill(0);
        for (buffer, part) in &mut piece.parts {
            let cells = &self.made[buffer.position()];
            if self.group.parallel {
                let plane = &mut planes[buffer.position()];
                part[offset..offset + self.width].copy_from_slice(&cells[*plane..*plane + self.width]);
                *plane += self.stride;
            } else {
                part.copy_from_slice(cells);
            }
        }
        self.planes = planes;
    }

    fn nest(&mut self, loops: &'b Loops, depth: usize) {
        for value in &loops.levels[depth] {
            self.compute(*value);
        }
        let nest = &self.kernel.nests[loops.nest];
        if depth < loops.outer.len() {
            self.through(loops, loops.outer[depth], depth);
            return;
        }
        if depth > loops.outer.len() && depth < loops.outer.len() + loops.inner.len() {
            self.through(loops, loops.inner[depth - loops.outer.len()], depth);
            return;
        }
        match &nest.reduce {
            Reduce::None => self.store(nest.out, nest.value),
            Reduce::Fold(fold, _) if depth == loops.outer.len() => {
                self.folded.fill(T::from_f64(fold.start()));
                match loops.inner.is_empty() {
                    true => self.fold(*fold, nest.value),
                    false => self.through(loops, loops.inner[0], depth),
                }
                let position = self.place(nest.out);
                self.made[nest.out.position()][position..position + self.width]
                    .copy_from_slice(&self.folded[..self.width]);
            }
            Reduce::Fold(fold, _) => self.fold(*fold, nest.value),
            Reduce::Scan { axis, backward, keep, initial } => {
                let mut state: Vec<T> = (0..self.width).map(|lane| self.lane(*initial, lane)).collect();
                let extent = self.bound.extent(*axis);
                for step in 0..extent {
                    self.running[axis.position()] = if *backward { extent - 1 - step } else { step };
                    for value in &loops.levels[depth + 1] {
                        self.compute(*value);
                    }
                    let position = self.place(nest.out);
                    self.made[nest.out.position()][position..position + self.width].copy_from_slice(&state);
                    let work = Work::Step(self.lanes(*keep), self.lanes(nest.value));
                    arithmetic::run(self.instructions, &mut state, work);
                }
            }
        }
    }

    fn through(&mut self, loops: &'b Loops, axis: AxisId, depth: usize) {
        for value in 0..self.bound.extent(axis) {
            self.running[axis.position()] = value;
            self.nest(loops, depth + 1);
        }
    }

    fn lane(&self, value: ValueId, lane: usize) -> T {
        self.lanes(value).at(lane)
    }

    /// The lanes of a value.
    fn lanes(&self, value: ValueId) -> Lane<'_, T> {
        if !(self.schedule.is_varying(value) && self.group.parallel) {
            return Lane::One(T::from_f64(self.uniform[value.position()]));
        }
        let own = &self.varying[self.slot[value.position()]];
        match self.view[value.position()] {
            View::Own => Lane::Many(&own[..self.width]),
            View::Same => Lane::One(own[0]),
            View::There(buffer, at) => Lane::Many(&self.numbers(buffer)[at..at + self.width]),
        }
    }

    fn fold(&mut self, fold: Fold, value: ValueId) {
        let mut folded = std::mem::take(&mut self.folded);
        let work = Work::Fold(fold, self.lanes(value));
        arithmetic::run(self.instructions, &mut folded[..self.width], work);
        self.folded = folded;
    }

    fn strides(&self, buffer: BufferId) -> &[usize] {
        match self.made[buffer.position()].is_empty() {
            true => &self.strides[buffer.position()],
            false => &self.own_strides[buffer.position()],
        }
    }

    /// Where the running cell of a buffer that this group makes begins.
    fn place(&self, buffer: BufferId) -> usize {
        let axes = self.kernel.buffers[buffer].axes.iter().zip(self.strides(buffer));
        axes.map(|(axis, stride)| self.running[axis.position()] * stride).sum()
    }

    fn store(&mut self, out: BufferId, value: ValueId) {
        let position = self.place(out);
        let mut cells = std::mem::take(&mut self.made[out.position()]);
        let target = &mut cells[position..position + self.width];
        match self.lanes(value) {
            Lane::One(number) => target.fill(number),
            Lane::Many(lanes) => target.copy_from_slice(lanes),
        }
        self.made[out.position()] = cells;
    }

    fn compute(&mut self, id: ValueId) {
        let varying = self.schedule.is_varying(id) && self.group.parallel;
        if varying {
            self.compute_lanes(id);
            return;
        }
        let number = |value: &ValueId| self.uniform[value.position()];
        self.uniform[id.position()] = match &self.kernel.nodes[id] {
            Node::Constant(bits) => f64::from_bits(*bits),
            Node::Axis(axis) => self.running[axis.position()] as f64,
            Node::Unary(operator, operand) => operator.apply(number(operand)),
            Node::Binary(operator, left, right) => operator.apply(number(left), number(right)),
            Node::Select(condition, then, otherwise) => {
                if number(condition) != 0.0 {
                    number(then)
                } else {
                    number(otherwise)
                }
            }
            Node::Load { buffer, indices, otherwise } => match self.offset(*buffer, indices, 0) {
                Some(offset) => self.cell(*buffer, offset),
                None => otherwise.as_ref().map_or(0.0, number),
            },
        };
    }

    fn compute_lanes(&mut self, id: ValueId) {
        // A value is not among its own operands, so that its lanes can be taken out.
        let slot = self.slot[id.position()];
        let mut own = std::mem::take(&mut self.varying[slot]);
        let out = &mut own[..self.width];
        let mut view = View::Own;
        let work = match &self.kernel.nodes[id] {
            Node::Load { buffer, indices, otherwise } => {
                view = self.load_lanes(out, *buffer, indices, *otherwise);
                None
            }
            Node::Axis(axis) => {
                let first = self.running[axis.position()];
                for (lane, out) in out.iter_mut().enumerate() {
                    *out = T::from_f64((first + lane) as f64);
                }
                None
            }
            Node::Unary(operator, operand) => Some(Work::Unary(*operator, self.lanes(*operand))),
            Node::Binary(operator, left, right) => {
                Some(Work::Binary(*operator, self.lanes(*left), self.lanes(*right)))
            }
            Node::Select(condition, then, otherwise) => {
                Some(Work::Select(self.lanes(*condition), self.lanes(*then), self.lanes(*otherwise)))
            }
            Node::Constant(_) => unreachable!("internal: a constant is uniform"),
        };
        if let Some(work) = work {
            arithmetic::run(self.instructions, out, work);
        }
        self.varying[slot] = own;
        self.view[id.position()] = view;
    }
}
