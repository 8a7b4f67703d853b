//! The loops of a pass for targets that compute one cell after the other, without lanes: WGSL and JavaScript.
//!
//! In: a nest of a schedule. Out: its statements in the loop language. Invariant: each value is named before it is used,
//! at the depth of the innermost loop that it depends on; an index that may be out of range is checked before it is used.

use crate::ids::{AxisId, BufferId, ValueId};
use crate::kernel::schedule::{Group, Loops};
use crate::kernel::{Index, Kernel, Node, Reduce, Role};
use crate::loops::{Expression, Kind, Of, Operation, Statement, Type};
use crate::operators::Binary;
use std::collections::HashSet;

/// Upper limit on the unrolled iterations of a nest's loops.
const MOST_TURNS: usize = 64;

/// A pass under construction.
pub(super) struct Cellwise<'k> {
    pub(super) kernel: &'k Kernel,
    /// The axes whose current index is fixed outside the pass.
    pub(super) axes: &'k [AxisId],
    /// Whether short loops of nests over a plate are unrolled.
    pub(super) unrolls: bool,
}

impl Cellwise<'_> {
    /// The statements of a nest.
    pub(super) fn nest(&self, group: &Group, loops: &Loops) -> Statement {
        Statement::Scope(self.loops(loops, 0, self.is_written_out(group, loops)))
    }

    /// Whether a nest computes one number.
    pub(super) fn is_number(&self, loops: &Loops) -> bool {
        let nest = &self.kernel.nests[loops.nest];
        nest.reduce == Reduce::None && self.kernel.buffers[nest.out].axes.is_empty()
    }

    /// The statements of nests that compute one number each; a value that several of them share is computed once.
    pub(super) fn numbers(&self, all: &[&Loops]) -> Statement {
        let (mut known, mut made) = (HashSet::new(), Vec::new());
        for loops in all {
            let nest = &self.kernel.nests[loops.nest];
            let new = loops.levels.iter().flatten().filter(|value| known.insert(**value));
            made.extend(new.flat_map(|value| self.value(*value)));
            made.push(Statement::Set(self.cell(nest.out), Of::Lane(nest.value).into()));
        }
        Statement::Scope(made)
    }

    /// Whether loops of known extent are unrolled: over a plate each has few iterations, and values kept between them
    /// then need no array.
    fn is_written_out(&self, group: &Group, loops: &Loops) -> bool {
        let axes = loops.outer.iter().chain(&loops.inner).filter(|axis| !self.axes.contains(axis));
        let known = axes.filter_map(|axis| self.kernel.axes[*axis].extent.known());
        self.unrolls && group.parallel && known.fold(1, usize::saturating_mul) <= MOST_TURNS
    }

    fn level(&self, loops: &Loops, depth: usize) -> Vec<Statement> {
        loops.levels[depth].iter().flat_map(|value| self.value(*value)).collect()
    }

    fn loops(&self, loops: &Loops, depth: usize, written_out: bool) -> Vec<Statement> {
        let nest = &self.kernel.nests[loops.nest];
        let mut made = self.level(loops, depth);
        let (outer, last) = (loops.outer.len(), loops.outer.len() + loops.inner.len());
        if depth < outer {
            let axis = loops.outer[depth];
            let within = self.loops(loops, depth + 1, written_out);
            match self.axes.contains(&axis) {
                true => made.extend(within),
                false => made.extend(self.through(axis, false, written_out, within)),
            }
            return made;
        }
        let v = |value: ValueId| Expression::from(Of::Lane(value));
        let (value, cell) = (v(nest.value), self.cell(nest.out));
        match &nest.reduce {
            Reduce::None => made.push(Statement::Set(cell, value)),
            Reduce::Scan { axis, backward, keep, initial } => {
                made.push(Statement::State(v(*initial)));
                let state = Expression::from(Of::State);
                let operator = |operator: Binary| Operation::Binary(Kind::Lane, operator);
                let next = operator(Binary::Multiply).of([v(*keep), state.clone()]);
                let next = operator(Binary::Add).of([next, value]);
                let mut within = self.level(loops, depth + 1);
                within.push(Statement::Set(cell, state.clone()));
                within.push(Statement::Set(state, next));
                made.extend(self.through(*axis, *backward, written_out, within));
            }
            Reduce::Fold(fold, _) => {
                if depth == outer {
                    made.push(Statement::Begin(*fold));
                }
                match depth < last {
                    true => {
                        let within = self.loops(loops, depth + 1, written_out);
                        made.extend(self.through(loops.inner[depth - outer], false, written_out, within));
                    }
                    false => made.push(Statement::Fold(*fold, value)),
                }
                if depth == outer {
                    made.push(Statement::Set(cell, Of::Folded.into()));
                }
            }
        }
        made
    }

    /// Loops over an axis, or unrolls the loop.
    fn through(
        &self,
        axis: AxisId,
        backward: bool,
        written_out: bool,
        body: Vec<Statement>,
    ) -> Vec<Statement> {
        match self.kernel.axes[axis].extent.known() {
            Some(extent) if written_out => {
                let at = |turn: usize| if backward { extent - 1 - turn } else { turn };
                (0..extent).map(|turn| Statement::Turn(axis, at(turn), body.clone())).collect()
            }
            _ => vec![Statement::Scan { axis, backward, body }],
        }
    }

    /// The current cell of a result buffer.
    fn cell(&self, out: BufferId) -> Expression {
        let running = self.kernel.buffers[out].axes.iter().map(|axis| Of::Running(*axis).into());
        Operation::Cell(out).of(running.collect::<Vec<Expression>>())
    }

    /// A node whose operands have names.
    fn value(&self, value: ValueId) -> Vec<Statement> {
        let name = Of::Lane(value);
        let v = |value: &ValueId| Expression::from(Of::Lane(*value));
        let mut made = Vec::new();
        let expression = match &self.kernel.nodes[value] {
            Node::Constant(bits) => Operation::Constant(Kind::Lane, *bits).alone(),
            Node::Axis(axis) => Operation::Number.of([Of::Running(*axis).into()]),
            Node::Unary(operator, operand) => Operation::Unary(Kind::Lane, *operator).of([v(operand)]),
            Node::Binary(operator, left, right) => {
                Operation::Binary(Kind::Lane, *operator).of([v(left), v(right)])
            }
            Node::Select(condition, then, otherwise) => {
                Operation::Select(Kind::Lane).of([v(condition), v(then), v(otherwise)])
            }
            Node::Mass(law, operands) => {
                Operation::Mass(Kind::Lane, *law).of(operands.iter().map(v).collect::<Vec<_>>())
            }
            Node::Load { buffer, indices, otherwise } => {
                let (inside, element) = self.load(value, *buffer, indices, &mut made);
                match otherwise {
                    Some(otherwise) if !inside.is_empty() => {
                        let parts = [v(otherwise), Operation::All.of(inside), element];
                        made.push(Statement::LetWhere(name.into(), parts));
                        return made;
                    }
                    _ => element,
                }
            }
        };
        made.push(Statement::Let(name.into(), Type::Lane, expression));
        made
    }

    /// The condition under which an element is in range, and the element. Computed indices get names of their own.
    fn load(
        &self,
        value: ValueId,
        buffer: BufferId,
        indices: &[Index],
        made: &mut Vec<Statement>,
    ) -> (Vec<Expression>, Expression) {
        let mut inside = Vec::new();
        let axes = &self.kernel.buffers[buffer].axes;
        let mut places = Vec::new();
        for (position, (index, axis)) in indices.iter().zip(axes).enumerate() {
            let extent = Expression::from(Of::Extent(*axis));
            let whole = |value: ValueId| Operation::AsSigned.of([Of::Lane(value).into()]);
            let place = match index {
                Index::Axis(axis) => {
                    places.push(Of::Running(*axis).into());
                    continue;
                }
                Index::At(at) => match (&self.kernel.nodes[*at], self.kernel.axes[*axis].extent.known()) {
                    (Node::Constant(bits), Some(known))
                        if (0.0..known as f64).contains(&f64::from_bits(*bits)) =>
                    {
                        places.push(Operation::Count(f64::from_bits(*bits) as usize).alone());
                        continue;
                    }
                    _ => whole(*at),
                },
                Index::Turned { axis, by, wraps } => {
                    let (running, wraps) = (Of::Running(*axis).into(), Of::Lane(*wraps).into());
                    Operation::Turned.of([running, whole(*by), extent.clone(), wraps])
                }
            };
            let at = Of::Index(value, position);
            made.push(Statement::Let(at.into(), Type::Signed, place));
            inside.push(Operation::IsInside.of([at.into(), extent]));
            places.push(at.into());
        }
        let element = Operation::Cell(buffer).of(places);
        match self.kernel.buffers[buffer].role {
            Role::Positions(..) => (inside, Operation::Number.of([element])),
            _ => (inside, element),
        }
    }
}
