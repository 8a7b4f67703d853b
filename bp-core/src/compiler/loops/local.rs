//! Names in loops.
//!
//! In: the axis, array or value that a name belongs to. Out: a name. Invariant: names are unique; a printer spells them, and
//! nothing parses them.

use crate::ids::{AxisId, BufferId, ValueId};

/// The object of a name.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub(crate) enum Of {
    /// The number of values of an axis.
    Extent(AxisId),
    /// The current index of an axis.
    Running(AxisId),
    /// An array.
    Array(BufferId),
    /// The planes of an array that a piece computes.
    Planes(BufferId),
    /// The stride of one of its axes.
    Stride(BufferId, usize),
    /// Whether an array that may be given once is given for each element of the plate.
    IsWhole(BufferId),
    /// A value that is uniform over a block, in f64.
    Once(ValueId),
    /// The same, if it is an integer.
    Whole(ValueId),
    /// The same, in the type of the lanes.
    Splat(ValueId),
    /// The same, for each iteration of an item's loop.
    Splats(ValueId),
    /// One lane of a value.
    Lane(ValueId),
    /// Lanes of a value computed at an outer depth.
    Kept(ValueId),
    /// Fetched lanes of a load.
    Fetched(ValueId),
    /// Their location.
    Place(ValueId),
    /// Their location, for each iteration of an item's loop.
    Places(ValueId),
    /// Memory for those that are not contiguous.
    Copies(ValueId),
    /// Their first index along a turned axis.
    From(ValueId),
    /// Whether the other indices of a load are in range.
    Inside(ValueId),
    /// An index of a load.
    Index(ValueId, usize),
    /// One lane of a computed array.
    Cell(BufferId),
    /// A tile of it.
    Tile(BufferId),
    /// Tiles of it that other items of a run read.
    Tiles(BufferId),
    /// Lanes computed on the stack.
    Made,
    /// Lanes computed in place.
    Own,
    /// The accumulator of a fold.
    Folded,
    /// The accumulators of the folds of several cells.
    Cells,
    /// The state of a scan.
    State,
}

/// A name. Nests whose short axes are unrolled have a copy of it for each combination of their indices.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub(crate) struct Local {
    pub(crate) of: Of,
    pub(crate) copy: Vec<usize>,
}

impl From<Of> for Local {
    fn from(of: Of) -> Self {
        Self { of, copy: Vec::new() }
    }
}

impl Local {
    pub(crate) fn new(of: Of, copy: &[usize]) -> Self {
        Self { of, copy: copy.to_vec() }
    }

    /// The value of the name, if each copy of a nest has its own.
    pub(crate) fn copied_value(&self) -> Option<ValueId> {
        match self.of {
            Of::Once(value)
            | Of::Whole(value)
            | Of::Splat(value)
            | Of::Fetched(value)
            | Of::Lane(value)
            | Of::Copies(value)
            | Of::Place(value)
            | Of::From(value)
            | Of::Inside(value) => Some(value),
            _ => None,
        }
    }
}
