//! Keys of the sizes, inputs and outputs of a kernel.
//!
//! In: ids of the model that the kernel was lowered from. Out: a key for each value that passes between a kernel and
//! its host. Invariant: back ends, readers and writers match on keys; names are made once, when the kernel is built,
//! for the host's calls and messages.

use crate::ids::{ParameterId, SetId, VariableId};

/// An axis of a grid.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum GridAxis {
    /// Away from the centre.
    Depth,
    /// Upwards.
    Rows,
    /// Around.
    Lanes,
}

impl GridAxis {
    /// The axes, slowest first.
    pub const ALL: [Self; 3] = [Self::Depth, Self::Rows, Self::Lanes];

    /// Its name: `Grid.depth`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Depth => "depth",
            Self::Rows => "rows",
            Self::Lanes => "lanes",
        }
    }
}

/// A number that is known at run time and bounds loops.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum SizeKey {
    /// The number of elements of a set.
    Set(SetId),
    /// The extent of a grid along an axis.
    Grid(SetId, GridAxis),
    /// A parameter of kind size.
    Parameter(ParameterId),
}

/// A size of a kernel.
#[derive(Clone, PartialEq, Debug)]
pub struct Size {
    /// Its key.
    pub key: SizeKey,
    /// The name for the host.
    pub name: String,
    /// Its default.
    pub default: Option<usize>,
}

/// An input of a kernel.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub enum InputKey {
    /// A parameter of the program.
    Parameter(ParameterId),
    /// The marginal distribution of a variable after the previous step.
    Previous(VariableId),
    /// A named value of a variable in the question: `w` in `Wet = w`.
    Value(VariableId, String),
    /// A number of the normal law carried from the previous instant: a mean, or a covariance.
    Law(usize),
    /// The answer of another program, by the path of its question.
    Answer(String),
    /// Whether the lanes of a grid are periodic.
    Wraps(SetId),
}

/// The coordinate in a table of positions.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Coordinate {
    /// The position along the depth.
    Depth,
    /// The row.
    Row,
    /// The rotation in lanes.
    Turn,
}

impl Coordinate {
    /// The coordinates in the order of a cell.
    pub const ALL: [Self; 3] = [Self::Depth, Self::Row, Self::Turn];

    /// Its name: the field of [`Moves`](crate::space::Moves) that holds it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Depth => "depth",
            Self::Row => "row",
            Self::Turn => "turn",
        }
    }
}

/// Displacements on a grid.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Displacements {
    /// The displacements of a set, given by the host.
    Of(SetId),
    /// One cell back along each axis of a grid.
    Steps(SetId),
}

/// The key of an output.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum OutputKey {
    /// The answer of an ask, by its position in the plan.
    Ask(usize),
    /// ln P(evidence).
    LnEvidence,
    /// The normalising constant.
    Total,
    /// A number of the normal law carried to the next instant: the means, then the covariances, row by row up to the
    /// diagonal.
    Law(usize),
    /// A number of the normal law of the searched variables, in the same order.
    Moment(usize),
}
