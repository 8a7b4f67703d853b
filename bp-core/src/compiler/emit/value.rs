//! Values in the loop language: numbers that are uniform over a block, and numbers of one lane.
//!
//! In: a node. Out: its expression, and how Rust writes its operators. Invariant: operands have been named before.

use super::nest::Nests;
use crate::ids::{AxisId, BufferId, ValueId};
use crate::kernel::{Index, Node, Role};
use crate::loops::{Element, Expression, Kind, Of, Operation, Statement, Type};
use crate::operators::{Binary, Unary};

impl Nests<'_> {
    /// The current index of an axis; for the lanes' axis, that of the first lane.
    pub(super) fn running(&self, axis: AxisId) -> Expression {
        let lane = self.group.parallel && self.kernel.parallel.last() == Some(&axis);
        if lane { Operation::Start.alone() } else { Of::Running(axis).into() }
    }

    /// Whether a value is an integer from the host.
    pub(super) fn is_whole(&self, value: ValueId) -> bool {
        match &self.kernel.nodes[value] {
            Node::Load { buffer, otherwise: None, .. } => {
                !self.varies(value) && matches!(self.kernel.buffers[*buffer].role, Role::Positions(..))
            }
            _ => false,
        }
    }

    fn is_infinity(&self, value: ValueId) -> bool {
        matches!(self.kernel.nodes[value], Node::Constant(bits) if f64::from_bits(bits) == f64::INFINITY)
    }

    fn is_nan(&self, value: ValueId) -> bool {
        matches!(self.kernel.nodes[value], Node::Constant(bits) if f64::from_bits(bits).is_nan())
    }

    /// Whether a value is computed once for the question, before the loops of its nest.
    fn is_outside_loops(&self, value: ValueId) -> bool {
        !self.group.parallel && self.group.nests.iter().any(|nest| nest.levels[0].contains(&value))
    }

    /// The type of the elements of an array.
    pub(super) fn element(&self, buffer: BufferId) -> Element {
        match self.kernel.buffers[buffer].role {
            Role::Positions(..) => Element::Position,
            Role::Table { .. } => Element::Table,
            _ => Element::Number,
        }
    }

    /// Computes a number that is uniform over a block, in f64.
    pub(super) fn settled(&self, value: ValueId) -> Vec<Statement> {
        let once = |made: Expression| Statement::Let(Of::Once(value).into(), Type::Once, made);
        match &self.kernel.nodes[value] {
            Node::Load { buffer, indices, .. } if self.is_whole(value) => {
                let (_, offset) = self.offset(*buffer, indices, false);
                let position = Operation::Position.of([Of::Array(*buffer).into(), offset]);
                let whole = Of::Whole(value);
                vec![
                    Statement::Let(whole.into(), Type::Signed, position),
                    once(Operation::Number.of([whole.into()])),
                ]
            }
            _ => vec![once(self.uniform(value))],
        }
    }

    /// The number in the type of the lanes.
    pub(super) fn splat(&self, value: ValueId) -> Statement {
        let narrow = Operation::Narrow.of([Of::Once(value).into()]);
        Statement::Let(Of::Splat(value).into(), Type::Lane, narrow)
    }

    fn uniform(&self, value: ValueId) -> Expression {
        let u = |value: &ValueId| Expression::from(Of::Once(*value));
        match &self.kernel.nodes[value] {
            Node::Constant(bits) => Operation::Constant(Kind::Once, *bits).alone(),
            Node::Axis(axis) => Operation::Number.of([self.running(*axis)]),
            Node::Unary(operator, operand) => Operation::Unary(Kind::Once, *operator).of([u(operand)]),
            Node::Binary(operator, left, right) => {
                Operation::Binary(Kind::Once, *operator).of([u(left), u(right)])
            }
            Node::Select(condition, then, otherwise)
                if self.is_nan(*otherwise) && self.is_outside_loops(value) =>
            {
                Operation::OnlyIf.of([u(condition), u(then)])
            }
            Node::Select(condition, then, otherwise) => {
                Operation::Select(Kind::Once).of([u(condition), u(then), u(otherwise)])
            }
            Node::Mass(law, operands) => {
                Operation::Mass(Kind::Once, *law).of(operands.iter().map(u).collect::<Vec<_>>())
            }
            Node::Load { buffer, indices, otherwise } => {
                let (inside, offset) = self.offset(*buffer, indices, false);
                let element = Operation::Element(Kind::Once, self.element(*buffer));
                let cell = element.of([Of::Array(*buffer).into(), offset]);
                match otherwise {
                    Some(otherwise) => Operation::If.of([inside, cell, u(otherwise)]),
                    None => cell,
                }
            }
        }
    }

    /// One lane of a value.
    pub(super) fn lane(&self, value: ValueId, depth: usize) -> Expression {
        let x = |value: &ValueId| self.operand(*value, depth);
        match &self.kernel.nodes[value] {
            Node::Constant(bits) => Operation::Constant(Kind::Lane, *bits).alone(),
            Node::Axis(_) => Operation::RunningLane.alone(),
            Node::Unary(operator, operand) => Operation::Unary(Kind::Lane, *operator).of([x(operand)]),
            Node::Binary(Binary::Less, left, right) if self.is_infinity(*right) => {
                Operation::IsBelowInfinity.of([x(left)])
            }
            Node::Binary(operator, left, right) => {
                Operation::Binary(Kind::Lane, *operator).of([x(left), x(right)])
            }
            Node::Select(condition, then, otherwise) => {
                Operation::Select(Kind::Lane).of([x(condition), x(then), x(otherwise)])
            }
            Node::Mass(law, operands) => {
                Operation::Mass(Kind::Lane, *law).of(operands.iter().map(x).collect::<Vec<_>>())
            }
            Node::Load { buffer, indices, otherwise } if self.is_fetched(value) => {
                let otherwise = otherwise.as_ref().map_or_else(|| Operation::Zero.alone(), x);
                let lane = self.kernel.parallel.last().copied();
                let turned =
                    indices.iter().zip(&self.kernel.buffers[*buffer].axes).find_map(|(index, axis)| {
                        match index {
                            Index::Turned { axis: running, wraps, .. } if Some(*running) == lane => {
                                Some((wraps, axis))
                            }
                            _ => None,
                        }
                    });
                let mut inside = vec![Of::Inside(value).into()];
                if let Some((wraps, axis)) = turned {
                    let [wraps, from, extent] =
                        [Of::Once(*wraps), Of::From(value), Of::Extent(*axis)].map(Expression::from);
                    inside.push(Operation::IsLaneInside.of([wraps, from, extent]));
                }
                let fetched = Operation::LaneOf(Of::Fetched(value).into()).alone();
                Operation::If.of([Operation::All.of(inside), fetched, otherwise])
            }
            Node::Load { buffer, indices, otherwise } => self.gather(*buffer, indices, *otherwise, depth),
        }
    }
}

pub(super) fn constant(number: f64) -> String {
    if number.is_finite() {
        format!("{number:?}f64")
    } else if number.is_nan() {
        "f64::NAN".to_owned()
    } else {
        format!("{}f64::INFINITY", if number < 0.0 { "-" } else { "" })
    }
}

/// An operator of a number of the lanes.
pub(super) fn unary(operator: Unary, x: &str) -> String {
    let function = match operator {
        Unary::Not => return format!("T::ONE - {x}"),
        Unary::Negate => return format!("-{x}"),
        Unary::Absolute => "absolute",
        Unary::Exponential => "exponential",
        Unary::NaturalLogarithm => "natural_logarithm",
        Unary::SquareRoot => "square_root",
        Unary::Floor => "round_down",
        Unary::Ceiling => "round_up",
        Unary::Round => "round",
        Unary::Sine => "sine",
        Unary::Cosine => "cosine",
        Unary::BinaryLogarithm => "binary_logarithm",
        Unary::LnGamma => "ln_gamma",
        Unary::LnBessel => "ln_bessel",
        Unary::NormalCumulative => "normal_cumulative",
        Unary::EntropyTerm => "entropy_term",
    };
    format!("Scalar::{function}({x})")
}

pub(super) fn arithmetic(operator: Binary, left: &str, right: &str, kind: &str, zero: &str) -> String {
    let truth = |condition: String| format!("<{kind} as Scalar>::truth({condition})");
    match operator {
        Binary::Add | Binary::Subtract | Binary::Multiply | Binary::Divide => {
            format!("{left} {} {right}", operator.notation().1)
        }
        Binary::Minimum => format!("Scalar::minimum({left}, {right})"),
        Binary::Maximum => format!("Scalar::maximum({left}, {right})"),
        Binary::Power => format!("Scalar::power({left}, {right})"),
        Binary::Remainder => format!("Scalar::remainder({left}, {right})"),
        Binary::ArcTangent => format!("Scalar::arc_tangent({left}, {right})"),
        Binary::And => truth(format!("({left} != {zero}) & ({right} != {zero})")),
        Binary::Or => truth(format!("{left} != {zero} || {right} != {zero}")),
        _ => truth(format!("{left} {} {right}", operator.notation().1)),
    }
}
