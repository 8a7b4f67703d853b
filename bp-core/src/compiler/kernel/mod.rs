//! Kernels: loops over arrays of numbers, without any notion of probability.
//!
//! In: a lowered plan. Out: a list of [`Nest`]s for a back end to run or to print. Invariant: a nest computes each cell
//! of one buffer from buffers that earlier nests have finished, by a pure expression; so that cells are independent,
//! and threads, SIMD lanes and GPU threads are correct by construction.
//!
//! A nest means: *for every cell of `out`, fold `value` over the axes of `reduce`*. Expressions are nodes in one arena;
//! equal nodes have equal ids. Named extents are known only at run time. Kernels have no notion of time: a filter is a
//! host loop that runs kernels and swaps buffers.

mod build;
mod constants;
mod key;
mod plate;
mod rewrite;
pub mod schedule;
mod shift;
mod usual;
mod validate;
mod values;
mod words;

pub use build::KernelBuilder;
pub(crate) use constants::with_tables;
pub use key::{Coordinate, Displacements, GridAxis, InputKey, OutputKey, Size, SizeKey};
pub(crate) use plate::with_plate;
pub(crate) use rewrite::{rewritten, without_copies};
pub(crate) use shift::share_between_neighbours;
pub(crate) use usual::{USUAL_DISPLACEMENTS, has_loop, with_usual_displacements};
pub use values::{Numbers, Values};
pub use words::in_words;

use crate::error::Error;
use crate::ids::{Arena, AxisId, BufferId, SetId, ValueId};
use crate::operators::{Binary, Mass, OPERANDS, Unary};

/// The extent of an axis: `offset`, or `size + offset` with a size that is known only at run time.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Extent {
    /// A size given at run time.
    pub size: Option<SizeKey>,
    /// The offset.
    pub offset: i64,
}

impl Extent {
    /// A known extent.
    pub fn constant(count: usize) -> Self {
        Self { size: None, offset: count as i64 }
    }

    /// An extent that is known at run time.
    pub fn sized(size: SizeKey) -> Self {
        Self { size: Some(size), offset: 0 }
    }

    /// The number, if no size is needed.
    pub fn known(&self) -> Option<usize> {
        self.size.is_none().then(|| usize::try_from(self.offset).unwrap_or(0))
    }
}

/// One loop.
#[derive(Clone, PartialEq, Debug)]
pub struct Axis {
    /// The name of its variable.
    pub name: String,
    /// Its extent.
    pub extent: Extent,
}

impl Axis {
    /// Its number of values for this size.
    ///
    /// # Errors
    /// The axis would have no values.
    pub(crate) fn count(&self, size: usize) -> Result<usize, Error> {
        let extent = i64::try_from(size).unwrap_or(i64::MAX).saturating_add(self.extent.offset);
        let none =
            || Error::input(&self.name, format!("it would have {extent} values; at least 1 is needed"));
        usize::try_from(extent).ok().filter(|count| *count > 0).ok_or_else(none)
    }
}

/// The kind of a buffer.
#[derive(Clone, PartialEq, Debug)]
pub enum Role {
    /// Given by the host.
    Input {
        /// Its key.
        key: InputKey,
        /// The value if the host gives none.
        default: Option<f64>,
        /// Whether it may be given without its parallel axes, one value for all.
        broadcast: bool,
    },
    /// Constants of the kernel, one for each cell.
    Table {
        /// The input that replaces them, if the host may give one.
        key: Option<InputKey>,
        /// The numbers.
        numbers: Vec<f64>,
    },
    /// Antecedents of displacements: integers given by the host.
    Positions(Displacements, Coordinate),
    /// Computed by one nest for others.
    Scratch,
    /// Computed for the host.
    Output(OutputKey),
}

impl Role {
    /// The key of an input that the host may give as numbers.
    pub fn input(&self) -> Option<&InputKey> {
        match self {
            Self::Input { key, .. } => Some(key),
            Self::Table { key, .. } => key.as_ref(),
            _ => None,
        }
    }

    /// The key of an output.
    pub fn output(&self) -> Option<OutputKey> {
        match self {
            Self::Output(key) => Some(*key),
            _ => None,
        }
    }
}

/// An array, its last axis contiguous.
#[derive(Clone, PartialEq, Debug)]
pub struct Buffer {
    /// The name for the host.
    pub name: String,
    /// Its kind.
    pub role: Role,
    /// Its axes, slowest first.
    pub axes: Vec<AxisId>,
    /// For an input of values of a variable: the variable. A kernel reads their ordinals; the binding of inputs
    /// converts.
    pub values: Option<Values>,
}

/// The check of a computed buffer. Back ends count the cells that fail.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Check {
    /// Each cell is the total of one context: above 0, or the context is impossible. NaN is an invalid number.
    Total,
    /// No cell may be NaN.
    Number,
}

/// An index of a load.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub enum Index {
    /// The current index of this axis.
    Axis(AxisId),
    /// A computed index.
    At(ValueId),
    /// The current index of this axis plus `by`, which does not depend on that axis; it wraps around at the ends if
    /// `wraps` is not 0.
    Turned {
        /// The axis.
        axis: AxisId,
        /// The offset.
        by: ValueId,
        /// Whether the ends meet.
        wraps: ValueId,
    },
}

/// A node of an expression.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub enum Node {
    /// A number, by its bits.
    Constant(u64),
    /// The current index of an axis, from 0.
    Axis(AxisId),
    /// An element of a buffer; `otherwise` if an index is out of range.
    Load {
        /// The buffer.
        buffer: BufferId,
        /// The indices, one for each axis of the buffer.
        indices: Vec<Index>,
        /// The value out of range; without it, indices are in range by construction.
        otherwise: Option<ValueId>,
    },
    /// An operator on one value.
    Unary(Unary, ValueId),
    /// An operator on two.
    Binary(Binary, ValueId, ValueId),
    /// The second value if the first is not 0, else the third.
    Select(ValueId, ValueId, ValueId),
    /// The probability of an interval.
    Mass(Mass, [ValueId; OPERANDS]),
}

impl Node {
    /// The law of which it is the probability of an interval.
    pub fn integrated(&self) -> Option<Mass> {
        let Node::Mass(law, _) = self else { return None };
        Some(*law)
    }

    /// The axes whose current indices the node itself reads, without its operands.
    pub fn axes(&self) -> Vec<AxisId> {
        match self {
            Node::Axis(axis) => vec![*axis],
            Node::Load { indices, .. } => (indices.iter())
                .filter_map(|index| match index {
                    Index::Axis(axis) | Index::Turned { axis, .. } => Some(*axis),
                    Index::At(_) => None,
                })
                .collect(),
            _ => Vec::new(),
        }
    }
}

/// A fold.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Fold {
    /// Σ, from 0.
    Sum,
    /// Π, from 1.
    Product,
    /// From −∞.
    Maximum,
}

/// The reduction of a nest.
#[derive(Clone, PartialEq, Debug)]
pub enum Reduce {
    /// One value for each cell.
    None,
    /// A fold over these axes, which `out` lacks.
    Fold(Fold, Vec<AxisId>),
    /// A first-order linear recurrence along an axis of `out`: with i′ the element before i,
    /// out\[first\] = initial and out\[i\] = keep\[i′\] · out\[i′\] + value\[i′\].
    Scan {
        /// The axis.
        axis: AxisId,
        /// From the last element to the first.
        backward: bool,
        /// The factor of the previous element.
        keep: ValueId,
        /// The first element.
        initial: ValueId,
    },
}

/// For every cell of a buffer `out`, a fold of an expression.
#[derive(Clone, PartialEq, Debug)]
pub struct Nest {
    /// The buffer.
    pub out: BufferId,
    /// The reduction.
    pub reduce: Reduce,
    /// The expression.
    pub value: ValueId,
}

/// Loops over arrays of numbers. Made by [`KernelBuilder`].
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Kernel {
    /// Its name.
    pub name: String,
    /// The loops.
    pub axes: Arena<AxisId, Axis>,
    /// The arrays.
    pub buffers: Arena<BufferId, Buffer>,
    /// The nodes of all expressions.
    pub nodes: Arena<ValueId, Node>,
    /// The nests, in order.
    pub nests: Vec<Nest>,
    /// The sizes of extents.
    pub sizes: Vec<Size>,
    /// The names of the sets whose grids and displacements are read.
    pub sets: Vec<(SetId, String)>,
    /// The axes of the plate, slowest first: every cell along them is independent of the others.
    pub parallel: Vec<AxisId>,
    /// The checks of computed buffers.
    pub checks: Vec<(BufferId, Check)>,
}

impl Kernel {
    /// The sizes that the host gives, in order of first use.
    pub fn sizes(&self) -> Vec<&Size> {
        self.size_keys().into_iter().map(|key| self.size(key)).collect()
    }

    /// The keys of the sizes in use, in order of first use.
    pub(crate) fn size_keys(&self) -> Vec<SizeKey> {
        let axes = self.axes.values().map(|axis| &axis.extent);
        // A domain whose values are given has a size too.
        let domains = self.buffers.values().filter_map(|buffer| match &buffer.values {
            Some(Values { numbers: Numbers::Whole { count, .. }, .. }) => Some(count),
            _ => None,
        });
        let mut keys: Vec<SizeKey> = Vec::new();
        for key in axes.chain(domains.flatten()).filter_map(|extent| extent.size) {
            if !keys.contains(&key) {
                keys.push(key);
            }
        }
        keys
    }

    /// A size in use.
    pub fn size(&self, key: SizeKey) -> &Size {
        let found = self.sizes.iter().find(|size| size.key == key);
        found.expect("internal: a kernel knows its sizes")
    }

    /// The name of a set whose grid or displacements are read.
    pub fn set_name(&self, set: SetId) -> &str {
        let found = self.sets.iter().find(|(known, _)| *known == set);
        &found.expect("internal: a kernel knows its sets").1
    }

    /// The number of cells of these axes, if it is known and can be counted.
    pub(crate) fn known_cells<'a>(&self, axes: impl IntoIterator<Item = &'a AxisId>) -> Option<usize> {
        axes.into_iter().try_fold(1usize, |cells, axis| cells.checked_mul(self.axes[*axis].extent.known()?))
    }

    /// The same kernel for given sizes, with their extents known.
    ///
    /// # Errors
    /// An axis that would have no values.
    pub fn with_sizes(&self, size: impl Fn(&str) -> Option<usize>) -> Result<Self, Error> {
        let mut kernel = self.clone();
        let size = |key: SizeKey| size(&self.size(key).name);
        for axis in kernel.axes.ids() {
            if let Some(size) = self.axes[axis].extent.size.and_then(size) {
                kernel.axes[axis].extent = Extent::constant(self.axes[axis].count(size)?);
            }
        }
        for buffer in self.buffers.ids() {
            let Some(Values { numbers: Numbers::Whole { count, .. }, .. }) =
                &mut kernel.buffers[buffer].values
            else {
                continue;
            };
            for extent in count {
                if let Some(known) = extent.size.and_then(size) {
                    *extent = Extent { size: None, offset: known as i64 + extent.offset };
                }
            }
        }
        Ok(kernel)
    }

    /// The same kernel with the sizes known that have a default.
    ///
    /// # Errors
    /// An axis that would have no values.
    pub fn with_default_sizes(&self) -> Result<Self, Error> {
        self.with_sizes(|name| self.sizes.iter().find(|size| size.name == name)?.default)
    }

    /// The buffers that the host gives, in order.
    pub fn inputs(&self) -> impl Iterator<Item = (BufferId, &Buffer)> {
        let is_given = |role: &Role| role.input().is_some() || matches!(role, Role::Positions(..));
        self.buffers.iter().filter(move |(_, buffer)| is_given(&buffer.role))
    }

    /// The buffers that the host gets, in order.
    pub fn outputs(&self) -> impl Iterator<Item = (BufferId, OutputKey)> {
        self.buffers.iter().filter_map(|(id, buffer)| Some((id, buffer.role.output()?)))
    }

    /// The buffer of an input.
    pub fn input(&self, key: &InputKey) -> Option<BufferId> {
        self.buffers.find(|buffer| buffer.role.input() == Some(key))
    }

    /// The operands of a node.
    pub fn operands(&self, id: ValueId) -> Vec<ValueId> {
        match &self.nodes[id] {
            Node::Constant(_) | Node::Axis(_) => Vec::new(),
            Node::Unary(_, operand) => vec![*operand],
            Node::Binary(_, left, right) => vec![*left, *right],
            Node::Select(condition, then, otherwise) => vec![*condition, *then, *otherwise],
            Node::Mass(_, operands) => operands.to_vec(),
            Node::Load { indices, otherwise, .. } => {
                let mut operands: Vec<ValueId> = Vec::new();
                for index in indices {
                    match index {
                        Index::Axis(_) => {}
                        Index::At(at) => operands.push(*at),
                        Index::Turned { by, wraps, .. } => operands.extend([*by, *wraps]),
                    }
                }
                operands.extend(otherwise);
                operands
            }
        }
    }
}
