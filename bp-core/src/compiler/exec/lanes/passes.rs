//! The passes of a kernel, and the kinds of their axes.
//!
//! In: a kernel's schedule, all extents. Out: passes. Invariant: a pass reads only results of earlier passes.
//!
//! A group of the plate is one pass: its last axis becomes lanes, or all of them if they are contiguous everywhere.
//! Small nests without a plate are merged and unrolled into numbers. A large one has its innermost axes as lanes: those
//! of its result, or those that it folds if these are longer.

use super::build::Builder;
use super::code::Pass;
use super::layout::Layout;
use super::shape::{Known, Shape};
use crate::ids::{AxisId, BufferId, Id};
use crate::kernel::schedule::{Group, Loops, Schedule};
use crate::kernel::{Index, Node, Reduce, Role};
use std::collections::HashSet;

/// Limit of the values of a nest that is unrolled into numbers, and of all nests that share such a pass.
const SMALL: usize = 256;
const MOST_NUMBERS: usize = 4096;

/// Limit of the values of an unrolled group of the plate.
const MOST_UNROLLED: usize = 30_000;

/// Limit of the values within the remaining loops.
const MOST_WITHIN: usize = 256;

/// Limit of the lanes of a row in one block, so that values common to all rows are computed once.
const ONE_BLOCK: usize = 512;

/// Limits of the lanes of merged axes.
const MANY_LANES: usize = 1024;
const FEW_LANES: usize = 16;

/// Limit of the lanes folded together, by memory. The others are a loop.
const MOST_FOLDED: usize = 1 << 20;

/// The passes of a kernel, with numbers of this many bytes.
pub(super) fn passes(known: &Known<'_>, schedule: &Schedule, bytes: usize) -> Vec<Pass> {
    let mut readers = vec![Vec::new(); known.kernel.buffers.len()];
    for nest in schedule.groups.iter().flat_map(|group| &group.nests) {
        for value in nest.levels.iter().flatten() {
            if let Node::Load { buffer, .. } = &known.kernel.nodes[*value] {
                readers[buffer.position()].push(nest.nest);
            }
        }
    }
    let (passes, small) = (Vec::new(), Vec::new());
    let mut choice = Choice { known, schedule, bytes, readers, passes, small, values: 0 };
    for group in &schedule.groups {
        choice.add(group);
    }
    choice.finish_small();
    choice.passes
}

struct Choice<'c> {
    known: &'c Known<'c>,
    schedule: &'c Schedule,
    bytes: usize,
    /// Which nests read each buffer.
    readers: Vec<Vec<usize>>,
    passes: Vec<Pass>,
    /// Pending small nests, and their values.
    small: Vec<&'c Loops>,
    values: usize,
}

impl<'c> Choice<'c> {
    fn add(&mut self, group: &'c Group) {
        if group.parallel {
            self.finish_small();
            return self.plate(group);
        }
        for nest in &group.nests {
            let values = self.values_of(nest);
            if values > SMALL {
                self.finish_small();
                self.large(nest);
                continue;
            }
            if self.values + values > MOST_NUMBERS || self.searches_small(nest) {
                self.finish_small();
            }
            self.small.push(nest);
            self.values += values;
        }
    }

    fn extent(&self, axis: &AxisId) -> usize {
        self.known.extents[axis.position()]
    }

    fn product(&self, axes: &[AxisId]) -> usize {
        axes.iter().map(|axis| self.extent(axis)).fold(1, usize::saturating_mul)
    }

    fn out(&self, nest: &Loops) -> BufferId {
        self.known.kernel.nests[nest.nest].out
    }

    /// The values of a nest that is unrolled.
    fn values_of(&self, nest: &Loops) -> usize {
        let values = nest.levels.iter().map(Vec::len).sum::<usize>().max(1);
        self.product(&nest.outer).saturating_mul(self.product(&nest.inner)).saturating_mul(values)
    }

    /// Whether a nest reads a small one at an index known only at run time.
    fn searches_small(&self, nest: &Loops) -> bool {
        let kernel = self.known.kernel;
        nest.levels.iter().flatten().any(|value| match &kernel.nodes[*value] {
            Node::Load { buffer, indices, .. } => {
                let searched = |index: &Index| match index {
                    Index::Axis(_) => false,
                    Index::At(at) => !matches!(kernel.nodes[*at], Node::Constant(_)),
                    Index::Turned { .. } => true,
                };
                indices.iter().any(searched) && self.small.iter().any(|small| self.out(small) == *buffer)
            }
            _ => false,
        })
    }

    fn finish_small(&mut self) {
        let small = std::mem::take(&mut self.small);
        self.values = 0;
        if small.is_empty() {
            return;
        }
        let own: HashSet<usize> = small.iter().map(|nest| nest.nest).collect();
        let local = |buffer: BufferId| {
            self.known.kernel.buffers[buffer].role == Role::Scratch
                && self.readers[buffer.position()].iter().all(|nest| own.contains(nest))
        };
        let shape = Shape { one_block: true, ..Shape::default() };
        let built = Builder::build(self.known, &shape, &small, local);
        let built = built.expect("internal: what small nests read of each other is known");
        self.passes.push(Layout::of(built, &shape, self.known.extents, self.bytes));
    }

    fn plate(&mut self, group: &Group) {
        let kernel = self.known.kernel;
        let nests: Vec<&Loops> = group.nests.iter().collect();
        let (last, rows) = kernel.parallel.split_last().expect("internal: a parallel group has axes");
        let mut shape = Shape { rows: rows.to_vec(), lanes: vec![*last], ..Shape::default() };
        if self.is_plain(group) {
            (shape.rows, shape.lanes) = (Vec::new(), kernel.parallel.clone());
        }
        shape.one_block = self.product(&shape.lanes) <= ONE_BLOCK;
        let local = |buffer: BufferId| self.schedule.local[buffer.position()];
        let values: usize = nests.iter().map(|nest| self.values_of(nest)).fold(0, usize::saturating_add);
        let unrolled = match values <= MOST_UNROLLED {
            true => Builder::build(self.known, &shape, &nests, local),
            false => None,
        };
        let built = unrolled.unwrap_or_else(|| {
            shape.unroll = Some(MOST_WITHIN);
            let built = Builder::build(self.known, &shape, &nests, local);
            built.expect("internal: loops that are left find everything")
        });
        self.passes.push(Layout::of(built, &shape, self.known.extents, self.bytes));
    }

    /// Whether the plate can be one row: every buffer is read at the current cell, and its plate axes are the last
    /// ones.
    fn is_plain(&self, group: &Group) -> bool {
        let (kernel, parallel) = (self.known.kernel, &self.known.kernel.parallel);
        group.nests.iter().flat_map(|nest| nest.levels.iter().flatten()).all(|value| {
            match &kernel.nodes[*value] {
                Node::Axis(axis) => !parallel.contains(axis),
                Node::Load { buffer, indices, .. } => {
                    let runs = |index: &Index| match index {
                        Index::Axis(axis) | Index::Turned { axis, .. } => parallel.contains(axis),
                        Index::At(_) => false,
                    };
                    let axes = &kernel.buffers[*buffer].axes;
                    let strides = &self.known.strides[buffer.position()];
                    let first = axes.len().saturating_sub(parallel.len());
                    let at_end = axes.ends_with(parallel)
                        && indices[first..]
                            .iter()
                            .zip(parallel)
                            .all(|(index, axis)| *index == Index::Axis(*axis))
                        && (strides.is_empty() || strides[axes.len() - 1] > 0);
                    let elsewhere = indices[..if at_end { first } else { indices.len() }].iter().any(runs);
                    !elsewhere
                }
                _ => true,
            }
        })
    }

    /// The last of these axes, merged, up to the limit of lanes.
    fn last_axes(&self, axes: &[AxisId]) -> usize {
        let mut first = axes.len().saturating_sub(1);
        while first > 0 && self.product(&axes[first - 1..]) <= MANY_LANES {
            first -= 1;
        }
        first
    }

    /// A large nest without a plate.
    fn large(&mut self, nest: &Loops) {
        let kernel = self.known.kernel;
        let axes = &kernel.buffers[self.out(nest)].axes;
        let mut shape = Shape { unroll: Some(MOST_WITHIN), ..Shape::default() };
        match &kernel.nests[nest.nest].reduce {
            Reduce::Scan { axis, .. } => {
                let after = axes.iter().position(|own| own == axis).map_or(0, |at| at + 1);
                shape.lanes = axes[after..][self.last_axes(&axes[after..])..].to_vec();
            }
            _ => {
                let (first, inner) = (self.last_axes(axes), self.last_axes(&nest.inner));
                let (own, folded) = (self.product(&axes[first..]), self.product(&nest.inner[inner..]));
                shape.folded = own < FEW_LANES && folded > own && folded <= MOST_FOLDED;
                (shape.rows, shape.lanes) = match shape.folded {
                    true => (axes.clone(), nest.inner[inner..].to_vec()),
                    false => (axes[..first].to_vec(), axes[first..].to_vec()),
                };
            }
        }
        shape.one_block = shape.folded || self.product(&shape.lanes) <= MANY_LANES;
        let built = Builder::build(self.known, &shape, &[nest], |_| false);
        let built = built.expect("internal: loops that are left find everything");
        self.passes.push(Layout::of(built, &shape, self.known.extents, self.bytes));
    }
}
