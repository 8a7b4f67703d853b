//! The flat program of a kernel for given extents: instructions with located operands.
//!
//! In: the output of `build`. Out: plain data that `machine` executes. Invariant: within a level, numbers come before
//! places and places before instructions, and each uses only earlier entries or outer levels.
//!
//! A *number* is the same in all lanes of a block. A *place* is the location of lanes to be read: in the array itself
//! or, if a row wraps around or is out of range, in a copy. An *instruction* is one tight loop over a block. *Levels*
//! are the loops around a block, outermost first: done once, then each axis of the rows, then the block; then the loops
//! of a stage.

use crate::ids::BufferId;
use crate::kernel::Fold;
use crate::operators::{Binary, Mass, OPERANDS, Unary};
use std::collections::BTreeSet;

/// The source of numbers: a buffer in memory, or the planes of a pass that live for a block.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(super) enum Source {
    Whole(BufferId),
    Block(usize),
}

/// One index known at run time: a number, its stride, its extent.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub(super) struct Term {
    pub(super) number: usize,
    pub(super) stride: usize,
    pub(super) extent: usize,
}

/// A cell: of a source of lanes, or of a buffer in memory; a constant offset, and terms.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub(super) struct Address<S> {
    pub(super) source: S,
    pub(super) base: usize,
    pub(super) terms: Vec<Term>,
}

/// The computation of a number.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub(super) enum Numeric {
    Constant(u64),
    /// The current index of an axis, by its position.
    Counter(usize),
    Unary(Unary, usize),
    Binary(Binary, usize, usize),
    Select(usize, usize, usize),
    Mass(Mass, [usize; OPERANDS]),
    /// A cell, or the other number if it is out of range.
    Load(Address<BufferId>, Option<usize>),
    /// Its value after storing in a buffer.
    Stored(usize),
}

impl Numeric {
    /// Calls with each number that it is made of.
    pub(super) fn each(&self, mut call: impl FnMut(usize)) {
        match self {
            Numeric::Constant(_) | Numeric::Counter(_) => {}
            Numeric::Unary(_, a) | Numeric::Stored(a) => call(*a),
            Numeric::Binary(_, a, b) => [*a, *b].into_iter().for_each(call),
            Numeric::Select(a, b, c) => [*a, *b, *c].into_iter().for_each(call),
            Numeric::Mass(_, operands) => operands.iter().copied().for_each(call),
            Numeric::Load(address, otherwise) => {
                address.terms.iter().map(|term| term.number).chain(*otherwise).for_each(call);
            }
        }
    }
}

/// The order of lanes in a row that is read in place.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub(super) enum Along {
    /// From the address on.
    Straight,
    /// From an offset after the current lane, the first number; wrapped if the second is not 0.
    Turned { by: usize, wraps: usize, extent: usize },
    /// At the offsets of a pattern.
    Pattern(usize),
}

/// Lanes that are read in place.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub(super) struct Place {
    pub(super) address: Address<Source>,
    pub(super) along: Along,
    /// The value out of range.
    pub(super) otherwise: Option<usize>,
}

impl Place {
    /// Calls with each number that it is found by.
    pub(super) fn numbers(&self, mut call: impl FnMut(usize)) {
        self.address.terms.iter().map(|term| term.number).chain(self.otherwise).for_each(&mut call);
        if let Along::Turned { by, wraps, .. } = self.along {
            [by, wraps].into_iter().for_each(call);
        }
    }
}

/// An operand of an instruction.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(super) enum Operand {
    Number(usize),
    Slot(usize),
    Place(usize),
}

/// What gives a block of lanes; `O` is the type of operands.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub(super) enum Work<O> {
    Computed(Computed<O>),
    Read(Read<O>),
}

/// The comparison of a choice.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(super) enum Comparison {
    Greater,
    NotEqual,
}

impl Comparison {
    /// The comparison of an operator, if choices are made by it.
    pub(super) fn of(operator: Binary) -> Option<Self> {
        match operator {
            Binary::Greater => Some(Comparison::Greater),
            Binary::NotEqual => Some(Comparison::NotEqual),
            _ => None,
        }
    }
}

/// The computation of a block of lanes from others.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub(super) enum Computed<O> {
    Unary(Unary, O),
    Binary(Binary, O, O),
    Select(O, O, O),
    Mass(Mass, [O; OPERANDS]),
    /// The third operand where a comparison of the first two holds, else the fourth.
    Choose(Comparison, O, O, O, O),
    /// (a · b) · c
    Product(O, O, O),
    /// a · b + c · d
    Mixture(O, O, O, O),
    /// a + b · c
    AddProduct(O, O, O),
}

/// A block of lanes that is read.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub(super) enum Read<O> {
    /// The numbers of a pattern.
    Pattern(usize),
    /// A place that is copied: because of values out of range, or of its pattern.
    Fetch(usize, Option<O>),
    /// Cells that are located lane by lane: index, stride and extent of each axis; and the value out of range.
    Gather(Source, Box<[(O, usize, usize)]>, Option<O>),
}

impl<O: Copy> Work<O> {
    /// With other operands.
    pub(super) fn map<P>(&self, mut name: impl FnMut(O) -> P) -> Work<P> {
        match self {
            Work::Computed(computed) => Work::Computed(match computed {
                Computed::Unary(operator, a) => Computed::Unary(*operator, name(*a)),
                Computed::Binary(operator, a, b) => Computed::Binary(*operator, name(*a), name(*b)),
                Computed::Select(a, b, c) => Computed::Select(name(*a), name(*b), name(*c)),
                Computed::Mass(law, operands) => Computed::Mass(*law, operands.map(name)),
                Computed::Choose(comparison, a, b, c, d) => {
                    Computed::Choose(*comparison, name(*a), name(*b), name(*c), name(*d))
                }
                Computed::Product(a, b, c) => Computed::Product(name(*a), name(*b), name(*c)),
                Computed::Mixture(a, b, c, d) => Computed::Mixture(name(*a), name(*b), name(*c), name(*d)),
                Computed::AddProduct(a, b, c) => Computed::AddProduct(name(*a), name(*b), name(*c)),
            }),
            Work::Read(read) => Work::Read(match read {
                Read::Pattern(pattern) => Read::Pattern(*pattern),
                Read::Fetch(place, other) => Read::Fetch(*place, other.map(name)),
                Read::Gather(source, terms, other) => {
                    let terms = terms.iter().map(|(index, stride, extent)| (name(*index), *stride, *extent));
                    Read::Gather(*source, terms.collect(), other.map(&mut name))
                }
            }),
        }
    }

    /// Calls with each operand.
    pub(super) fn each(&self, call: impl FnMut(O)) {
        self.map(call);
    }
}

/// The planes in which a block is stored: of the results of the pass, or of those that live for a block.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Planes {
    Made(usize),
    Block(usize),
}

/// The target of a block: one of some planes.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Target<P = Planes> {
    pub(super) planes: P,
    pub(super) base: usize,
    pub(super) terms: Vec<Term>,
}

/// One loop over a block.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Instruction {
    Set(usize, Work<Operand>),
    /// Computed in its target, planes of the results of the pass.
    Write(Target<usize>, Work<Operand>),
    Store(Target, Operand),
    Keep(usize, Operand),
    /// The first lane of a slot accumulates all lanes, one after the other.
    Fold(usize, Fold, Operand),
}

/// The work of one level.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Code {
    pub(super) numbers: Vec<(usize, Numeric)>,
    pub(super) places: Vec<usize>,
    pub(super) instructions: Vec<Instruction>,
}

/// A loop of a stage.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Loop {
    /// The axis, by its position.
    pub(super) axis: usize,
    pub(super) extent: usize,
    pub(super) backward: bool,
}

/// Loops within a block; none if all of them have been unrolled.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Stage {
    pub(super) loops: Vec<Loop>,
    /// The number of those outside the reduction.
    pub(super) outer: usize,
    /// Level by level; the first is that of the block.
    pub(super) levels: Vec<Code>,
    /// Before, within and after the inner loops.
    pub(super) begin: Vec<Instruction>,
    pub(super) each: Vec<Instruction>,
    pub(super) end: Vec<Instruction>,
}

/// One pass over rows of lanes.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Pass {
    /// Axes of the rows, by position, and their extents, outermost first.
    pub(super) rows: Vec<(usize, usize)>,
    /// Lanes of a row, and of a block.
    pub(super) lanes: usize,
    pub(super) block: usize,
    /// Whether the lanes are folded, so that a row gives one cell.
    pub(super) folded: bool,
    /// The results, with the number of planes of rows × lanes.
    pub(super) made: Vec<(BufferId, usize)>,
    /// The buffers in memory that are read.
    pub(super) reads: BTreeSet<BufferId>,
    /// For each buffer that lives for a block, its number of planes.
    pub(super) of_block: Vec<usize>,
    pub(super) constants: Vec<(usize, f64)>,
    pub(super) numbers: usize,
    pub(super) slots: usize,
    pub(super) places: Vec<Place>,
    pub(super) patterns: Vec<Vec<u32>>,
    /// The levels: once, and for each axis of the rows; if a row is one block, the last of these is the block's.
    pub(super) levels: Vec<Code>,
    pub(super) stages: Vec<Stage>,
}

impl Pass {
    /// Whether rows are divided among threads, rather than the lanes of the only one.
    pub(super) fn has_rows(&self) -> bool {
        self.folded || self.rows.iter().any(|(_, extent)| *extent > 1)
    }

    /// Whether it depends on no input: it reads only such arrays, and has no outputs for the host.
    pub(super) fn is_settled(
        &self,
        stays: impl Fn(BufferId) -> bool,
        is_output: impl Fn(BufferId) -> bool,
    ) -> bool {
        self.reads.iter().all(|buffer| stays(*buffer))
            && !self.made.iter().any(|(buffer, _)| is_output(*buffer))
    }

    /// Rows, and the cells of each.
    pub(super) fn rows_of_cells(&self) -> (usize, usize) {
        let rows = self.rows.iter().map(|(_, extent)| extent).product();
        (rows, if self.folded { 1 } else { self.lanes })
    }

    /// The cells of a plane.
    pub(super) fn plane(&self) -> usize {
        let (rows, cells) = self.rows_of_cells();
        rows * cells
    }
}
