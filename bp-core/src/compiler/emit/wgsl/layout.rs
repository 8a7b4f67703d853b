//! The memory layout of a shader.
//!
//! In: a kernel and its schedule. Out: for each buffer, whether it is private to an invocation, and otherwise the
//! offsets of its elements in the common array. Invariant: offsets determined by known extents are constants of the
//! text; only the others are read from `shape`.

use crate::ids::{AxisId, BufferId, Id};
use crate::kernel::schedule::Schedule;
use crate::kernel::{Kernel, Role};

/// Upper limit on the numbers of one private buffer: a larger one would not fit in registers or local memory.
const MOST_PRIVATE: usize = 256;

/// A whole number: a constant of the text, or one read from `shape`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Term {
    Known(usize),
    /// A position in `shape`.
    Shape(usize),
}

impl Term {
    /// Its notation in comments.
    pub(super) fn text(self) -> String {
        match self {
            Self::Known(number) => format!("{number}"),
            Self::Shape(place) => format!("shape[{place}]"),
        }
    }

    /// Its notation as `u32`.
    pub(super) fn unsigned(self) -> String {
        match self {
            Self::Known(number) => format!("{number}u"),
            Self::Shape(place) => format!("shape[{place}]"),
        }
    }

    /// Its notation as `i32`.
    pub(super) fn signed(self) -> String {
        match self {
            Self::Known(number) => format!("{number}"),
            Self::Shape(place) => format!("i32(shape[{place}])"),
        }
    }
}

/// The location of a buffer.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Place {
    /// Private variables of an invocation, this many.
    Private(usize),
    /// In the array of all numbers, or of all positions.
    Stored {
        /// The first element.
        first: Term,
        /// The stride along each axis.
        strides: Vec<Term>,
    },
}

/// The layout of all buffers. `shape` is an array of `u32`: the bits of ∞, then the numbers that the text does not
/// know.
#[derive(Clone, PartialEq, Debug)]
pub struct Layout {
    extents: Vec<Term>,
    places: Vec<Place>,
    /// The length of `shape`.
    pub(super) length: usize,
}

impl Layout {
    /// The layout of a kernel.
    pub(super) fn of(kernel: &Kernel, schedule: &Schedule) -> Self {
        let mut length = 1;
        let mut open = || {
            length += 1;
            Term::Shape(length - 1)
        };
        let extents =
            kernel.axes.values().map(|axis| axis.extent.known().map_or_else(&mut open, Term::Known));
        let extents: Vec<Term> = extents.collect();
        // The offset of the next buffer, where it is known.
        let (mut numbers, mut positions) = (Some(0), Some(0));
        let mut places = Vec::new();
        for (id, buffer) in kernel.buffers.iter() {
            if let Some(count) = private(kernel, schedule, id) {
                places.push(Place::Private(count));
                continue;
            }
            let next = if matches!(buffer.role, Role::Positions(..)) { &mut positions } else { &mut numbers };
            let first = next.map_or_else(&mut open, Term::Known);
            let mut stride = Some(1);
            let mut strides = Vec::new();
            for axis in buffer.axes.iter().rev() {
                strides.push(stride.map_or_else(&mut open, Term::Known));
                let known = stride.zip(kernel.axes[*axis].extent.known());
                stride = known.and_then(|(stride, extent)| countable(stride.checked_mul(extent)?));
            }
            strides.reverse();
            *next = next.zip(stride).and_then(|(first, count)| countable(first.checked_add(count)?));
            places.push(Place::Stored { first, strides });
        }
        Self { extents, places, length }
    }

    /// The extent of an axis.
    pub(super) fn extent(&self, axis: AxisId) -> Term {
        self.extents[axis.position()]
    }

    pub(super) fn place(&self, buffer: BufferId) -> &Place {
        &self.places[buffer.position()]
    }

    /// Whether a buffer is in the array of all numbers, or of all positions; buffers follow each other in their order.
    pub fn is_stored(&self, buffer: BufferId) -> bool {
        matches!(self.place(buffer), Place::Stored { .. })
    }
}

/// A count that fits in a shader's integers.
fn countable(number: usize) -> Option<usize> {
    u32::try_from(number).is_ok().then_some(number)
}

/// The number of cells of a buffer that is private to an invocation; `None` where it is shared, too large, or of
/// unknown size.
fn private(kernel: &Kernel, schedule: &Schedule, buffer: BufferId) -> Option<usize> {
    let own = kernel.buffers[buffer].axes.iter().filter(|axis| !kernel.parallel.contains(axis));
    let count = kernel.known_cells(own)?;
    (schedule.local[buffer.position()] && count <= MOST_PRIVATE).then_some(count)
}
