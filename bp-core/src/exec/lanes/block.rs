//! One thread's walk: blocks of lanes, one value at a time.
//!
//! In: a group of nests and a [`Piece`] of the plate. Out: that piece of the group's buffers. Invariant: a value
//! is computed before it is needed, because a schedule's levels are in the order of the arena.

mod arithmetic;
mod loads;

use super::BLOCK;
use super::{Array, Bound, Scalar};
use crate::ids::{AxisId, BufferId, Id, ValueId};
use crate::kernel::schedule::{Group, Loops, Schedule};
use crate::kernel::{Fold, Kernel, Node, Reduce};
use arithmetic::{Lane, apply_fold, binary, unary};

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
    varying: Vec<T>,
    /// Where each varying value's lanes begin.
    slot: Vec<usize>,
    /// What this group makes, by buffer: serial cells × lanes.
    made: Vec<Vec<T>>,
    strides: Vec<Vec<usize>>,
    folded: Vec<T>,
}

impl<'b, T: Scalar> Block<'b, T> {
    pub(super) fn new(
        kernel: &'b Kernel,
        schedule: &'b Schedule,
        bound: &'b Bound<'b, T>,
        finished: &'b [Vec<T>],
        group: &'b Group,
    ) -> Self {
        let stride = if group.parallel { BLOCK } else { 1 };
        let (mut slot, mut slots) = (vec![0; kernel.nodes.len()], 0);
        for value in group.nests.iter().flat_map(|nest| nest.levels.iter().flatten()) {
            if schedule.is_varying(*value) && slot[value.position()] == 0 {
                slots += 1;
                slot[value.position()] = slots;
            }
        }
        let mut made = vec![Vec::new(); kernel.buffers.len()];
        let mut strides: Vec<Vec<usize>> = kernel.buffers.ids().map(|buffer| bound.strides(buffer)).collect();
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
            strides[out.position()] = own;
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
            varying: vec![T::ZERO; (slots + 1) * stride],
            slot,
            made,
            strides,
            folded: vec![T::ZERO; stride],
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
        let mut planes = vec![0; self.kernel.buffers.len()];
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
                    for (lane, state) in state.iter_mut().enumerate() {
                        *state = self.lane(*keep, lane) * *state + self.lane(nest.value, lane);
                    }
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
        match self.schedule.is_varying(value) && self.group.parallel {
            true => self.varying[self.slot[value.position()] * self.stride + lane],
            false => T::from_f64(self.uniform[value.position()]),
        }
    }

    fn fold(&mut self, fold: Fold, value: ValueId) {
        if !(self.schedule.is_varying(value) && self.group.parallel) {
            let number = T::from_f64(self.uniform[value.position()]);
            self.folded[..self.width]
                .iter_mut()
                .for_each(|folded| *folded = apply_fold(fold, *folded, number));
            return;
        }
        let start = self.slot[value.position()] * self.stride;
        let values = &self.varying[start..start + self.width];
        match fold {
            Fold::Sum => {
                self.folded.iter_mut().zip(values).for_each(|(folded, value)| *folded = *folded + *value)
            }
            Fold::Product => {
                self.folded.iter_mut().zip(values).for_each(|(folded, value)| *folded = *folded * *value);
            }
            Fold::Maximum => {
                self.folded
                    .iter_mut()
                    .zip(values)
                    .for_each(|(folded, value)| *folded = folded.maximum(*value));
            }
        }
    }

    /// Where the running cell of a buffer that this group makes begins.
    fn place(&self, buffer: BufferId) -> usize {
        let axes = self.kernel.buffers[buffer].axes.iter().zip(&self.strides[buffer.position()]);
        axes.map(|(axis, stride)| self.running[axis.position()] * stride).sum()
    }

    fn store(&mut self, out: BufferId, value: ValueId) {
        let position = self.place(out);
        let target = &mut self.made[out.position()][position..position + self.width];
        if self.schedule.is_varying(value) && self.group.parallel {
            let start = self.slot[value.position()] * self.stride;
            target.copy_from_slice(&self.varying[start..start + target.len()]);
        } else {
            target.fill(T::from_f64(self.uniform[value.position()]));
        }
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
        let start = self.slot[id.position()] * self.stride;
        let width = self.width;
        if let Node::Load { buffer, indices, otherwise } = &self.kernel.nodes[id] {
            self.load_lanes(start, *buffer, indices, *otherwise);
            return;
        }
        let mut target = std::mem::take(&mut self.varying);
        {
            let (before, rest) = target.split_at_mut(start);
            let (out, after) = rest.split_at_mut(self.stride);
            let out = &mut out[..width];
            let lanes = |value: ValueId| -> Lane<'_, T> {
                if !self.schedule.is_varying(value) {
                    return Lane::One(T::from_f64(self.uniform[value.position()]));
                }
                let at = self.slot[value.position()] * self.stride;
                Lane::Many(if at < start {
                    &before[at..at + width]
                } else {
                    &after[at - start - self.stride..at - start - self.stride + width]
                })
            };
            match &self.kernel.nodes[id] {
                Node::Axis(axis) => {
                    let first = self.running[axis.position()];
                    for (lane, out) in out.iter_mut().enumerate() {
                        *out = T::from_f64((first + lane) as f64);
                    }
                }
                Node::Unary(operator, operand) => unary(*operator, out, lanes(*operand)),
                Node::Binary(operator, left, right) => binary(*operator, out, lanes(*left), lanes(*right)),
                Node::Select(condition, then, otherwise) => {
                    let (condition, then, otherwise) = (lanes(*condition), lanes(*then), lanes(*otherwise));
                    for (lane, out) in out.iter_mut().enumerate() {
                        let chosen = condition.at(lane) != T::ZERO;
                        *out = if chosen { then.at(lane) } else { otherwise.at(lane) };
                    }
                }
                Node::Constant(_) | Node::Load { .. } => unreachable!("internal: handled before"),
            }
        }
        self.varying = target;
    }
}
