//! Loads in the loop language: offsets, contiguous lanes, and gathers.
//!
//! In: a load. Out: its expression. Invariant: indices that may be out of range are checked before use; loads that are
//! contiguous along the lanes are slices of the array.

use super::nest::Nests;
use crate::ids::{AxisId, BufferId, ValueId};
use crate::kernel::{Index, Node, Role};
use crate::loops::{Element, Expression, Grain, Kind, Of, Operation, Statement, Type};

/// A load whose lanes are fetched.
#[derive(Clone, Copy)]
pub(super) struct Load<'k> {
    pub(super) value: ValueId,
    pub(super) buffer: BufferId,
    pub(super) indices: &'k [Index],
    pub(super) otherwise: Option<ValueId>,
}

impl Nests<'_> {
    /// Whether this group computes a buffer.
    fn is_own(&self, buffer: BufferId) -> bool {
        self.group.nests.iter().any(|nest| self.kernel.nests[nest.nest].out == buffer)
    }

    /// A uniform value as an integer.
    fn whole(&self, value: ValueId) -> Expression {
        match self.is_whole(value) {
            true => Of::Whole(value).into(),
            false => Operation::AsSigned.of([Of::Once(value).into()]),
        }
    }

    /// The stride of an axis of a buffer.
    fn stride(&self, buffer: BufferId, position: usize) -> Expression {
        if !self.is_own(buffer) {
            return Of::Stride(buffer, position).into();
        }
        let after = self.kernel.buffers[buffer].axes[position + 1..].iter();
        let after = after.filter(|axis| !(self.group.parallel && self.kernel.parallel.contains(axis)));
        let factors: Vec<Expression> = after.map(|axis| Of::Extent(*axis).into()).collect();
        Operation::Product.of(factors)
    }

    /// Whether all uniform indices are in range, and their offset.
    pub(super) fn offset(
        &self,
        buffer: BufferId,
        indices: &[Index],
        skip_lane: bool,
    ) -> (Expression, Expression) {
        let own = self.is_own(buffer);
        let axes = &self.kernel.buffers[buffer].axes;
        let lane = self.kernel.parallel.last().filter(|_| self.group.parallel);
        let (mut inside, mut terms) = (Vec::new(), Vec::new());
        for (position, (index, axis)) in indices.iter().zip(axes).enumerate() {
            if own && self.group.parallel && self.kernel.parallel.contains(axis) {
                continue;
            }
            let stride = self.stride(buffer, position);
            let extent = Expression::from(Of::Extent(*axis));
            match index {
                Index::Axis(axis) if skip_lane && Some(axis) == lane => {}
                Index::Axis(axis) => terms.push(Operation::Strided.of([self.running(*axis), stride])),
                Index::At(at) => {
                    let (at, within) = match self.is_whole(*at) {
                        true => (Expression::from(Of::Whole(*at)), Operation::IsInside),
                        false => (Expression::from(Of::Once(*at)), Operation::IsInsideNumber),
                    };
                    inside.push(within.of([at.clone(), extent]));
                    terms.push(Operation::Strided.of([Operation::AsIndex.of([at]), stride]));
                }
                Index::Turned { axis: turned, by, wraps } if !skip_lane => {
                    let at = self.turned(self.running(*turned), *by, *axis, *wraps);
                    inside.push(Operation::IsInside.of([at.clone(), extent]));
                    terms.push(Operation::Strided.of([Operation::AsIndex.of([at]), stride]));
                }
                Index::Turned { .. } => {}
            }
        }
        let mut offset = Operation::Sum.of(terms);
        if own && self.group.parallel {
            offset = Operation::InLanes.of([offset]);
        }
        (Operation::All.of(inside), offset)
    }

    fn turned(&self, running: Expression, by: ValueId, axis: AxisId, wraps: ValueId) -> Expression {
        Operation::Turned.of([running, self.whole(by), Of::Extent(axis).into(), Of::Once(wraps).into()])
    }

    /// The array of the lanes, as a slice of numbers.
    pub(super) fn source(&self, buffer: BufferId) -> Expression {
        match self.element(buffer) {
            // One cell for all lanes: it is copied.
            Element::Position | Element::Table => Operation::NoSource.alone(),
            Element::Number => Operation::Source.of([Of::Array(buffer).into()]),
        }
    }

    /// The fetched lanes of a load.
    pub(super) fn lanes_at(&self, value: ValueId, buffer: BufferId) -> Expression {
        Operation::LanesAt.of([Of::Place(value).into(), self.source(buffer), Of::Copies(value).into()])
    }

    /// The location of the lanes of a load; loads that are not contiguous are copied, from `slot` of its copies on.
    pub(super) fn fetch(&self, load: Load<'_>, slot: &Expression, grain: Grain) -> Vec<Statement> {
        let Load { value, buffer, indices, otherwise } = load;
        let source = Expression::from(Of::Array(buffer));
        let (inside, offset) = self.offset(buffer, indices, true);
        let broadcast = matches!(self.kernel.buffers[buffer].role, Role::Input { broadcast: true, .. });
        let lane = self.kernel.parallel.last().copied();
        let along =
            indices.iter().zip(&self.kernel.buffers[buffer].axes).find_map(|(index, axis)| match index {
                Index::Axis(running) if Some(*running) == lane => Some((None, *axis)),
                Index::Turned { axis: running, by, wraps } if Some(*running) == lane => {
                    Some((Some((by, wraps)), *axis))
                }
                _ => None,
            });
        let others = self.other_lanes(value).map(|(other, buffer)| self.lanes_at(other, buffer));
        let fill = match (otherwise, others) {
            (_, Some(others)) => others,
            (Some(otherwise), _) if !self.varies(otherwise) => {
                Operation::OneFor.of([Of::Splat(otherwise).into()])
            }
            _ => Operation::OneFor.of([Operation::Zero.alone()]),
        };
        let mut made = Vec::new();
        let copies = Expression::from(Of::Copies(value));
        let is_inside = !inside.operands.is_empty();
        let splat = |cell: Expression| Operation::Splat.of([copies.clone(), slot.clone(), cell]);
        let side_by_side =
            Operation::Fetch.of([copies.clone(), slot.clone(), source.clone(), offset.clone()]);
        let fetched = match along {
            _ if self.is_own(buffer) => Operation::PlaceAt.of([offset]),
            Some((Some((by, wraps)), axis)) => {
                let from = Of::From(value);
                let start = Operation::StartPlus.of([self.whole(*by)]);
                made.push(Statement::Let(from.into(), Type::Signed, start));
                let [from, extent, wraps] = [from, Of::Extent(axis), Of::Once(*wraps)].map(Expression::from);
                let operands =
                    [copies.clone(), slot.clone(), source, offset, from, extent, wraps, fill.clone()];
                Operation::FetchTurned(grain).of(operands)
            }
            Some((None, _)) if broadcast => {
                let number = Operation::Element(Kind::Lane, Element::Number);
                let number = number.of([source, offset]);
                Operation::IfWhole.of([Of::IsWhole(buffer).into(), side_by_side, splat(number)])
            }
            Some((None, _)) => side_by_side,
            None => splat(self.cell(buffer, offset)),
        };
        let place = |place: Expression| Statement::Let(Of::Place(value).into(), Type::Place, place);
        let is_one = |inside: Expression| Statement::Let(Of::Inside(value).into(), Type::Truth, inside);
        match otherwise {
            Some(_) if is_inside => {
                made.push(is_one(inside));
                let fill = Operation::Fill.of([copies.clone(), slot.clone(), fill]);
                made.push(place(Operation::If.of([Of::Inside(value).into(), fetched, fill])));
            }
            _ => made.push(place(fetched)),
        }
        if self.is_merged(value) && !is_inside {
            made.push(is_one(Operation::All.alone()));
        }
        made
    }

    /// Fetched lanes that are replaced, where they are out of range, by computed lanes.
    pub(super) fn is_merged(&self, value: ValueId) -> bool {
        match &self.kernel.nodes[value] {
            Node::Load { otherwise: Some(otherwise), .. } => {
                self.varies(*otherwise) && self.other_lanes(value).is_none()
            }
            _ => false,
        }
    }

    /// The lanes that replace fetched lanes out of range, if these are fetched too.
    pub(super) fn other_lanes(&self, value: ValueId) -> Option<(ValueId, BufferId)> {
        let Node::Load { otherwise: Some(otherwise), .. } = &self.kernel.nodes[value] else { return None };
        match &self.kernel.nodes[*otherwise] {
            Node::Load { buffer, otherwise: None, indices } if self.is_fetched(*otherwise) => {
                // Lanes that wrap around may be in more than one piece.
                let whole = !indices.iter().any(|index| matches!(index, Index::Turned { .. }));
                (!self.is_own(*buffer) && whole).then_some((*otherwise, *buffer))
            }
            _ => None,
        }
    }

    /// One cell of a buffer, as a number of the lanes.
    fn cell(&self, buffer: BufferId, offset: Expression) -> Expression {
        let element = Operation::Element(Kind::Lane, self.element(buffer));
        element.of([Of::Array(buffer).into(), offset])
    }

    /// A load whose index differs from lane to lane.
    pub(super) fn gather(
        &self,
        buffer: BufferId,
        indices: &[Index],
        otherwise: Option<ValueId>,
        depth: usize,
    ) -> Expression {
        let own = self.is_own(buffer);
        let axes = &self.kernel.buffers[buffer].axes;
        let lane = self.kernel.parallel.last().copied();
        let running = |axis: AxisId| match Some(axis) == lane {
            true => Operation::LaneWithin.alone(),
            false => Of::Running(axis).into(),
        };
        let (mut inside, mut terms) = (vec![Operation::Always.alone()], vec![Operation::Count(0).alone()]);
        for (position, (index, axis)) in indices.iter().zip(axes).enumerate() {
            if own && self.kernel.parallel.contains(axis) {
                continue;
            }
            let stride = self.stride(buffer, position);
            let extent = Expression::from(Of::Extent(*axis));
            match index {
                Index::Axis(axis) => terms.push(Operation::Strided.of([running(*axis), stride])),
                Index::At(at) => {
                    let at = Operation::Wide.of([self.operand(*at, depth)]);
                    inside.push(Operation::IsInsideNumber.of([at.clone(), extent]));
                    terms.push(Operation::Strided.of([Operation::AsIndex.of([at]), stride]));
                }
                Index::Turned { axis: turned, by, wraps } => {
                    let first = match running(*turned) {
                        Expression { operation: Operation::LaneWithin, .. } => running(*turned),
                        axis => Operation::Grouped.of([axis]),
                    };
                    let at = self.turned(first, *by, *axis, *wraps);
                    inside.push(Operation::IsInside.of([at.clone(), extent]));
                    terms.push(Operation::Strided.of([Operation::AsIndex.of([at]), stride]));
                }
            }
        }
        let mut offset = Operation::Sum.of(terms);
        if own {
            offset = Operation::PlusLane.of([Operation::InLanes.of([offset])]);
        }
        let otherwise = otherwise.map_or_else(|| Operation::Zero.alone(), |value| self.operand(value, depth));
        Operation::If.of([Operation::All.of(inside), self.cell(buffer, offset), otherwise])
    }
}
