//! The kinds of the axes of a pass, and a pass before layout.
//!
//! In: the output of `passes` and `build`. Out: plain data. Invariant: an axis is a row, or lanes, or a loop of the
//! nests: unrolled, or left as a loop of a stage.

use super::code::{Loop, Target};
use super::values::{Value, Values};
use crate::ids::{AxisId, BufferId};
use crate::kernel::{Fold, Kernel};
use std::ops::Range;

/// The shape of a pass.
#[derive(Clone, Debug, Default)]
pub(super) struct Shape {
    pub(super) rows: Vec<AxisId>,
    /// Axes whose cells are lanes, the last one contiguous.
    pub(super) lanes: Vec<AxisId>,
    /// Whether a block has all lanes.
    pub(super) one_block: bool,
    /// Whether the lanes are folded.
    pub(super) folded: bool,
    /// Limit of the values of an unrolled nest; `None` if all loops are unrolled.
    pub(super) unroll: Option<usize>,
}

impl Shape {
    /// The level of a block: that of the last axis of the rows, if a row is one block.
    pub(super) fn block_level(&self) -> usize {
        self.rows.len() + usize::from(!self.one_block)
    }
}

/// The known parts of a kernel at run time.
pub(super) struct Known<'k> {
    pub(super) kernel: &'k Kernel,
    pub(super) extents: &'k [usize],
    /// The strides of a buffer.
    pub(super) strides: &'k [Vec<usize>],
    /// Whether a buffer has the kernel's constants.
    pub(super) own: &'k dyn Fn(BufferId) -> bool,
    /// Whether storing a number rounds it.
    pub(super) narrow: bool,
}

/// An action on values.
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

/// The actions of a stage, and their order: lanes computed before, or around the inner loops.
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

/// A pass before layout.
#[derive(Debug)]
pub(super) struct Built {
    pub(super) values: Values,
    pub(super) stages: Vec<Doing>,
    pub(super) made: Vec<(BufferId, usize)>,
    pub(super) of_block: Vec<usize>,
    pub(super) kept: usize,
}
