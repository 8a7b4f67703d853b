//! Nodes in the loop language, and the WGSL text of their operators.
//!
//! In: a node whose operands have names. Out: its statement. Invariant: indices that may be out of range are checked
//! before use.

use super::Pass;
use crate::ids::{BufferId, ValueId};
use crate::kernel::{Index, Node, Role};
use crate::loops::{Expression, Kind, Of, Operation, Statement, Type};
use crate::operators::{Binary, Unary};

impl Pass<'_> {
    pub(super) fn value(&self, value: ValueId) -> Vec<Statement> {
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
            Node::Mass(..) => unreachable!("internal: refused before it is written"),
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

pub(super) fn constant(number: f64) -> String {
    // Numbers out of the range of f32 become its largest or smallest number, since a literal must not overflow.
    let single = number as f32;
    match single.is_finite() {
        true => format!("f32({single:?})"),
        false if number.is_nan() => "(infinity() - infinity())".to_owned(),
        false => format!("{}infinity()", if number < 0.0 { "-" } else { "" }),
    }
}

pub(super) fn unary(operator: Unary, x: &str) -> String {
    match operator {
        Unary::Negate => format!("-{x}"),
        Unary::Not => format!("1.0 - {x}"),
        Unary::Absolute => format!("abs({x})"),
        Unary::Exponential => format!("exp({x})"),
        Unary::NaturalLogarithm => format!("log({x})"),
        Unary::SquareRoot => format!("sqrt({x})"),
        Unary::Floor => format!("floor({x})"),
        Unary::Ceiling => format!("ceil({x})"),
        Unary::Round => format!("sign({x}) * floor(abs({x}) + 0.5)"),
        Unary::Sine => format!("sin({x})"),
        Unary::Cosine => format!("cos({x})"),
        Unary::BinaryLogarithm => format!("log2({x})"),
        Unary::LnGamma => format!("ln_gamma({x})"),
        Unary::LnBessel => format!("ln_bessel({x})"),
        Unary::NormalCumulative => format!("normal_cumulative({x})"),
        Unary::EntropyTerm => format!("entropy_term({x})"),
    }
}

pub(super) fn binary(operator: Binary, x: &str, y: &str) -> String {
    let truth = |condition: String| format!("select(0.0, 1.0, {condition})");
    match operator {
        Binary::Add | Binary::Subtract | Binary::Multiply | Binary::Divide => {
            format!("{x} {} {y}", operator.notation().1)
        }
        Binary::Minimum => format!("min({x}, {y})"),
        Binary::Maximum => format!("max({x}, {y})"),
        Binary::Power => format!("power({x}, {y})"),
        Binary::Remainder => format!("{x} - {y} * floor({x} / {y})"),
        Binary::ArcTangent => format!("atan2({x}, {y})"),
        Binary::And => truth(format!("{x} != 0.0 && {y} != 0.0")),
        Binary::Or => truth(format!("{x} != 0.0 || {y} != 0.0")),
        _ => truth(format!("{x} {} {y}", operator.notation().1)),
    }
}
