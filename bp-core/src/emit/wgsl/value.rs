//! Nodes as WGSL: one `let` for each.
//!
//! In: a node whose operands have been named. Out: its line. Invariant: indices that may lie outside are checked before
//! they are used.

use super::Pass;
use crate::emit::text::Text;
use crate::ids::{BufferId, Id, ValueId};
use crate::kernel::{Index, Node, Role};
use crate::operators::{Binary, Unary};

impl Pass<'_> {
    pub(super) fn value(&self, value: ValueId, text: &mut Text) {
        let name = format!("v{}", value.position());
        let v = |value: &ValueId| format!("v{}", value.position());
        let expression = match &self.kernel.nodes[value] {
            Node::Constant(bits) => constant(f64::from_bits(*bits)),
            Node::Axis(axis) => format!("f32(i{})", axis.position()),
            Node::Unary(operator, operand) => unary(*operator, &v(operand)),
            Node::Binary(operator, left, right) => binary(*operator, &v(left), &v(right)),
            Node::Select(condition, then, otherwise) => {
                format!("select({}, {}, {} != 0.0)", v(otherwise), v(then), v(condition))
            }
            Node::Load { buffer, indices, otherwise } => {
                let (inside, element) = self.load(&name, *buffer, indices, text);
                match (otherwise, inside.is_empty()) {
                    (Some(otherwise), false) => {
                        text.line(format!("var {name} = {};", v(otherwise)));
                        text.open(format!("if {}", inside.join(" && ")));
                        text.line(format!("{name} = {element};"));
                        text.close();
                        return;
                    }
                    _ => element,
                }
            }
        };
        text.line(format!("let {name}: f32 = {expression};"));
    }

    /// What must hold for an element to be there, and the element. Places that are computed get names of their own.
    fn load(
        &self,
        name: &str,
        buffer: BufferId,
        indices: &[Index],
        text: &mut Text,
    ) -> (Vec<String>, String) {
        let mut inside = Vec::new();
        let axes = &self.kernel.buffers[buffer].axes;
        let mut places = Vec::new();
        for (position, (index, axis)) in indices.iter().zip(axes).enumerate() {
            let extent = self.extent(*axis);
            let place = match index {
                Index::Axis(axis) => {
                    places.push(format!("i{}", axis.position()));
                    continue;
                }
                Index::At(at) => match (&self.kernel.nodes[*at], self.kernel.axes[*axis].extent.known()) {
                    (Node::Constant(bits), Some(known))
                        if (0.0..known as f64).contains(&f64::from_bits(*bits)) =>
                    {
                        places.push(format!("{}", f64::from_bits(*bits) as usize));
                        continue;
                    }
                    _ => format!("i32(v{})", at.position()),
                },
                Index::Turned { axis, by, wraps } => format!(
                    "turned(i{} + i32(v{}), {extent}, v{})",
                    axis.position(),
                    by.position(),
                    wraps.position()
                ),
            };
            let at = format!("{name}_{position}");
            text.line(format!("let {at} = {place};"));
            inside.push(format!("{at} >= 0 && {at} < {extent}"));
            places.push(at);
        }
        let element = self.element(buffer, places.into_iter());
        match self.kernel.buffers[buffer].role {
            Role::Positions(..) => (inside, format!("f32({element})")),
            _ => (inside, element),
        }
    }
}

fn constant(number: f64) -> String {
    // The largest and smallest numbers of f32 stand for what lies beyond them; a literal must not overflow.
    let single = number as f32;
    match single.is_finite() {
        true => format!("f32({single:?})"),
        false if number.is_nan() => "(infinity() - infinity())".to_owned(),
        false => format!("{}infinity()", if number < 0.0 { "-" } else { "" }),
    }
}

fn unary(operator: Unary, x: &str) -> String {
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

fn binary(operator: Binary, x: &str, y: &str) -> String {
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
