//! Expressions of loops: numbers, integers, conditions, and lanes.
//!
//! In: an operation and its operands. Out: an expression. Invariant: operands are in the order of their
//! evaluation; a number has one kind: f64 if it is computed once for a block, else the type of the lanes.

use super::local::{Local, Of};
use crate::ids::BufferId;
use crate::operators::{Binary, Mass, Unary};

/// The type of a number.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Kind {
    /// f64 for lanes of any type: computed once for a block.
    Once,
    /// The type of the lanes.
    Lane,
}

/// The type of the elements of an array.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Element {
    /// Numbers of the type of the lanes.
    Number,
    /// Constants, f64.
    Table,
    /// Integers.
    Position,
}

/// The number of lanes of one fetch.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Grain {
    Block,
    Tile,
}

/// The operation of an expression.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Operation {
    /// A name.
    Local(Local),
    /// One lane of these lanes.
    LaneOf(Local),
    /// The element of a list at an index, its operand.
    At(Local),

    // Numbers.
    Constant(Kind, u64),
    Unary(Kind, Unary),
    Binary(Kind, Binary),
    /// The second operand if the first is not 0, else the third.
    Select(Kind),
    /// The probability of an interval.
    Mass(Kind, Mass),
    /// The second operand if the first is not 0, else NaN: a branch, because the first is rarely 0.
    OnlyIf,
    /// 1 if the operand is below infinity, else 0.
    IsBelowInfinity,
    /// An integer as a number.
    Number,
    /// The index of the current lane, as a number.
    RunningLane,
    /// An element of an array, at an offset, as a number of a kind.
    Element(Kind, Element),
    /// The element as a signed integer.
    Position,
    /// An element of an array, at its indices: a printer computes the offset.
    Cell(BufferId),
    /// A number as f64.
    Wide,
    /// An f64 in the type of the lanes.
    Narrow,
    /// The second operand if the first is true, else the third.
    If,
    /// 0.
    Zero,

    // Integers.
    Count(usize),
    /// The index of an unrolled axis.
    Chosen(usize),
    /// The first lane of the block.
    Start,
    /// The current lane, limited to the last one.
    LaneWithin,
    /// a + b + …; 0 without operands.
    Sum,
    /// a · b · …; 1 without operands.
    Product,
    /// An index times its stride.
    Strided,
    /// A number that is in range, as an index.
    AsIndex,
    /// A number as a signed integer.
    AsSigned,
    /// The same, in parentheses.
    Grouped,
    /// An offset in blocks of lanes.
    InLanes,
    /// The offset of the copies of an iteration.
    Slot,
    /// An offset plus the current lane.
    PlusLane,
    /// index, offset, extent, wraps: the index plus the offset, which wraps around if `wraps` is not 0.
    Turned,
    /// The start of the block plus an offset.
    StartPlus,

    // Conditions.
    /// Whether an integer is at least 0 and below an extent.
    IsInside,
    /// The same of a number.
    IsInsideNumber,
    /// All operands; true without operands.
    All,
    Always,
    /// wraps, from, extent: whether the axis wraps around, or the current lane is in range.
    IsLaneInside,

    // Lanes.
    /// The location of lanes of the same pass.
    PlaceAt,
    /// The second operand if the array of the first is given for each element of the plate, else the third.
    IfWhole,
    Fetch,
    FetchTurned(Grain),
    Splat,
    Fill,
    /// place, source, copies: the lanes at a place.
    LanesAt,
    /// place, source, copies, slot: the tile at a place.
    ReadTile,
    /// place, source, copies: the lanes at a place, at least a tile of them.
    Row,
    /// The tile of such lanes.
    TileOf,
    /// The tile that another item keeps.
    Kept,
    /// One number for all lanes.
    OneFor,
    /// The array of fetched lanes; `NoSource` if it does not hold numbers of the type of the lanes.
    Source,
    NoSource,
}

/// An operation on operands.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Expression {
    pub(crate) operation: Operation,
    pub(crate) operands: Vec<Expression>,
}

impl From<Of> for Expression {
    fn from(of: Of) -> Self {
        Operation::Local(of.into()).alone()
    }
}

impl From<Local> for Expression {
    fn from(local: Local) -> Self {
        Operation::Local(local).alone()
    }
}

impl Operation {
    pub(crate) fn alone(self) -> Expression {
        Expression { operation: self, operands: Vec::new() }
    }

    pub(crate) fn of(self, operands: impl Into<Vec<Expression>>) -> Expression {
        Expression { operation: self, operands: operands.into() }
    }
}

impl Expression {
    pub(crate) fn constant(kind: Kind, number: f64) -> Self {
        Operation::Constant(kind, number.to_bits()).alone()
    }

    /// Its names, in the order of the text.
    pub(crate) fn names(&self, found: &mut dyn FnMut(Local)) {
        match &self.operation {
            Operation::Local(local) | Operation::LaneOf(local) | Operation::At(local) => found(local.clone()),
            _ => {}
        }
        self.operands.iter().for_each(|operand| operand.names(found));
    }

    /// The same with some operations replaced by those of `renamed`.
    pub(crate) fn renamed(&self, renamed: &dyn Fn(&Operation) -> Option<Operation>) -> Self {
        Self {
            operation: renamed(&self.operation).unwrap_or_else(|| self.operation.clone()),
            operands: self.operands.iter().map(|operand| operand.renamed(renamed)).collect(),
        }
    }
}
