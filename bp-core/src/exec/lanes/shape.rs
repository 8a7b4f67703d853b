//! How the axes of a pass run, and what a pass is before it is laid out.
//!
//! In: what `passes` decides, what `build` makes. Out: plain data. Invariant: an axis is a row, or lanes, or a loop of
//! the nests: unrolled, or left as a loop of a stage.

use super::code::{Loop, Target};
use super::values::{Value, Values};
use crate::ids::{AxisId, BufferId};
use crate::kernel::{Fold, Kernel};
use std::ops::Range;

/// How a pass runs.
#[derive(Clone, Debug, Default)]
pub(super) struct Shape {
    pub(super) rows: Vec<AxisId>,
    /// Axes whose cells are lanes, the last one contiguous.
    pub(super) lanes: Vec<AxisId>,
    /// Whether a block has all lanes.
    pub(super) one_block: bool,
    /// Whether the lanes are folded.
    pub(super) folded: bool,
    /// How many values may be made by unrolling a nest; without it, all loops are unrolled.
    pub(super) unroll: Option<usize>,
}

impl Shape {
    /// The level of a block: that of the last axis of the rows, where a row is one block.
    pub(super) fn block_level(&self) -> usize {
        self.rows.len() + usize::from(!self.one_block)
    }
}

/// What is known of a kernel when it runs.
pub(super) struct Known<'k> {
    pub(super) kernel: &'k Kernel,
    pub(super) extents: &'k [usize],
    /// How far apart neighbours along each axis of a buffer are.
    pub(super) strides: &'k [Vec<usize>],
    /// Whether a buffer has the numbers that come with the kernel.
    pub(super) own: &'k dyn Fn(BufferId) -> bool,
    /// Whether storing a number rounds it.
    pub(super) narrow: bool,
}

/// What is done with values.
#[derive(Clone, Debug)]
pub(super) enum Action {
    Store(Target, Value),
    Keep(usize, Value),
    Fold(usize, Fold, Value),
}

impl Action {
    pub(super) fn value(&self) -> Value {
        match self {
            Action::Store(_, value) | Action::Keep(_, value) | Action::Fold(_, _, value) => *value,
        }
    }
}

/// What is done in a stage, and when: with how many lanes made before, or around the inner loops.
#[derive(Debug, Default)]
pub(super) struct Doing {
    pub(super) loops: Vec<Loop>,
    pub(super) outer: usize,
    pub(super) lanes: Range<usize>,
    pub(super) numbers: Range<usize>,
    pub(super) places: Range<usize>,
    pub(super) inside: Vec<(usize, Action)>,
    pub(super) begin: Vec<Action>,
    pub(super) each: Vec<Action>,
    pub(super) end: Vec<Action>,
}

/// A pass before it is laid out.
#[derive(Debug)]
pub(super) struct Built {
    pub(super) values: Values,
    pub(super) stages: Vec<Doing>,
    pub(super) made: Vec<(BufferId, usize)>,
    pub(super) of_block: Vec<usize>,
    pub(super) kept: usize,
}
