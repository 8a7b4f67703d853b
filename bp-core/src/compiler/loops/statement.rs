//! Statements of loops.
//!
//! In: expressions. Out: statements. Invariant: a name is defined before its use, and once in its block.

use super::expression::Expression;
use super::local::{Local, Of};
use crate::ids::{AxisId, BufferId};
use crate::kernel::Fold;

/// The type of a name.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Type {
    /// A number, f64.
    Once,
    /// A number of the type of the lanes.
    Lane,
    /// A signed integer.
    Signed,
    Truth,
    /// The location of lanes.
    Place,
    /// The lanes of a block.
    Lanes,
    /// The lanes of a tile, where they are.
    Tile,
}

/// The range of a loop over lanes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Lanes {
    /// The lanes of the block.
    Width,
    /// The lanes of the block, rounded up to a whole cache line.
    Filled,
    /// The lanes of a tile.
    Tile,
}

/// The destination of lanes.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Target {
    /// An array of the pass.
    Own(BufferId),
    /// The part of a result that a piece computes.
    Planes(BufferId),
}

/// A check of computed lanes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Look {
    /// Totals that are too small. `is_linear`: products are plain multiplications.
    Totals { is_linear: bool },
    /// NaN, counted immediately.
    Numbers,
    /// NaN, detected by a sum that is NaN if one of the lanes is.
    Doubt,
}

/// A statement.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Statement {
    /// Defines a name.
    Let(Local, Type, Expression),
    /// Defines a number: the third expression if the second is true, else the first.
    LetWhere(Local, [Expression; 3]),
    /// Defines the lanes of a block, initially 0.
    Block(Local),
    /// Defines a tile, initially filled with a number.
    Tile(Local, Expression),
    /// Defines this number of tiles, initially 0.
    Tiles(Local, usize),
    /// A block with its own names.
    Scope(Vec<Statement>),
    /// For each value of an axis.
    For(AxisId, Vec<Statement>),
    /// One iteration: the body with one value of an axis.
    Turn(AxisId, usize, Vec<Statement>),
    /// For each value of an axis, in order: each needs the state of the one before.
    Scan {
        axis: AxisId,
        backward: bool,
        body: Vec<Statement>,
    },
    /// For each lane.
    ForLanes(Lanes, Vec<Statement>),
    /// For each tile of a block.
    ForTiles(Vec<Statement>),
    /// Assigns a number to the first expression.
    Set(Expression, Expression),
    /// Begins the folds of this number of cells, each with this number.
    Cells(usize, Expression),
    /// Initialises a fold: of each lane, or of one number.
    BeginLanes(Fold),
    Begin(Fold),
    /// Folds one more number.
    Fold(Fold, Expression),
    /// Initialises a scan: of each lane, or of one number.
    StateOfLanes(Expression),
    State(Expression),
    /// Stores an f64 in an array, at a plane.
    Store(BufferId, Expression, Expression),
    /// Borrows the lanes of an array of the pass, at a plane, to compute them in place.
    Own(BufferId, Expression),
    /// Stores lanes computed on the stack.
    Keep {
        target: Target,
        plane: Expression,
        lanes: Local,
    },
    /// Checks the lanes of a block.
    Look(Look, Local),
    /// Checks the lanes of a tile, except those that overlap the previous tile.
    LookAtTile(Look, Local),
    /// Stores a tile; `doubt`: it is also added to the sum that detects NaN.
    KeepTile {
        target: Target,
        plane: Expression,
        tile: Local,
        doubt: bool,
    },
    /// Restricts a list to the length of an axis, which removes bounds checks.
    Shorten(Local, AxisId),
}

impl Statement {
    /// Its names, in the order of the text.
    pub(crate) fn names(&self, found: &mut dyn FnMut(Local)) {
        let put = |target: &Target, found: &mut dyn FnMut(Local)| match target {
            Target::Own(buffer) => found(Of::Array(*buffer).into()),
            Target::Planes(buffer) => found(Of::Planes(*buffer).into()),
        };
        match self {
            Self::Let(name, _, value) | Self::Tile(name, value) => {
                found(name.clone());
                value.names(found);
            }
            Self::LetWhere(name, parts) => {
                found(name.clone());
                parts.iter().for_each(|part| part.names(found));
            }
            Self::Block(name) | Self::Tiles(name, _) | Self::Look(_, name) | Self::LookAtTile(_, name) => {
                found(name.clone());
            }
            Self::Shorten(name, axis) => {
                found(name.clone());
                found(Of::Extent(*axis).into());
            }
            Self::For(axis, body) | Self::Scan { axis, body, .. } => {
                found(Of::Running(*axis).into());
                found(Of::Extent(*axis).into());
                body.iter().for_each(|statement| statement.names(found));
            }
            Self::Scope(body) | Self::Turn(_, _, body) | Self::ForLanes(_, body) | Self::ForTiles(body) => {
                body.iter().for_each(|statement| statement.names(found));
            }
            Self::Set(place, value) => {
                place.names(found);
                value.names(found);
            }
            Self::Fold(_, value) | Self::StateOfLanes(value) | Self::State(value) => value.names(found),
            Self::Store(buffer, plane, value) => {
                found(Of::Array(*buffer).into());
                plane.names(found);
                value.names(found);
            }
            Self::Own(buffer, plane) => {
                found(Of::Own.into());
                found(Of::Array(*buffer).into());
                plane.names(found);
            }
            Self::Keep { target, plane, lanes: name } | Self::KeepTile { target, plane, tile: name, .. } => {
                put(target, found);
                plane.names(found);
                found(name.clone());
            }
            Self::BeginLanes(_) | Self::Begin(_) => found(Of::Folded.into()),
            Self::Cells(_, start) => {
                found(Of::Cells.into());
                start.names(found);
            }
        }
    }
}
