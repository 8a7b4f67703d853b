//! Where the numbers of a shader stand.
//!
//! In: a kernel and its schedule. Out: for each buffer, whether it lives within an invocation, and else where its elements
//! are in the one array of all numbers. Invariant: what the extents of the kernel settle is a number of the text; only
//! what they leave open is read from `shape`.

use crate::ids::{AxisId, BufferId, Id};
use crate::kernel::schedule::Schedule;
use crate::kernel::{Kernel, Role};

/// Numbers that an invocation keeps of one buffer, at most: more would not stay near it.
const MOST_PRIVATE: usize = 256;

/// A whole number that the text may know.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Term {
    Known(usize),
    /// A place in `shape`.
    Shape(usize),
}

impl Term {
    /// As it is told to people.
    pub(super) fn told(self) -> String {
        match self {
            Self::Known(number) => format!("{number}"),
            Self::Shape(place) => format!("shape[{place}]"),
        }
    }

    /// As `u32`.
    pub(super) fn unsigned(self) -> String {
        match self {
            Self::Known(number) => format!("{number}u"),
            Self::Shape(place) => format!("shape[{place}]"),
        }
    }

    /// As `i32`.
    pub(super) fn signed(self) -> String {
        match self {
            Self::Known(number) => format!("{number}"),
            Self::Shape(place) => format!("i32(shape[{place}])"),
        }
    }
}

/// Where a buffer is.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Place {
    /// In variables of an invocation, which makes and reads it alone: so many.
    Private(usize),
    /// In the array of all numbers, or of all positions.
    Stored {
        /// The first element.
        first: Term,
        /// How far apart neighbours along each axis are.
        strides: Vec<Term>,
    },
}

/// Where everything is. `shape` is an array of `u32`: the bits of ∞, then what the text does not know.
#[derive(Clone, PartialEq, Debug)]
pub struct Layout {
    extents: Vec<Term>,
    places: Vec<Place>,
    /// How many numbers `shape` has.
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
        // Where the next buffer begins, as long as that is known.
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

    /// Whether a buffer stands in the array of all numbers, or of all positions: one after the other, in their order.
    pub fn is_stored(&self, buffer: BufferId) -> bool {
        matches!(self.place(buffer), Place::Stored { .. })
    }
}

/// What a shader can count.
fn countable(number: usize) -> Option<usize> {
    u32::try_from(number).is_ok().then_some(number)
}

/// How many numbers an invocation keeps of a buffer that none but itself reads; none where that is not known, or too many.
fn private(kernel: &Kernel, schedule: &Schedule, buffer: BufferId) -> Option<usize> {
    let own = kernel.buffers[buffer].axes.iter().filter(|axis| !kernel.parallel.contains(axis));
    let count = kernel.known_cells(own)?;
    (schedule.local[buffer.position()] && count <= MOST_PRIVATE).then_some(count)
}
