//! Values as Rust expressions: numbers that are uniform over a block, and numbers of one lane.
//!
//! In: a node. Out: its text. Invariant: operands have been named before.

use super::names::local;
use super::nest::Nests;
use crate::ids::{AxisId, Id, ValueId};
use crate::kernel::{Index, Node, Role};
use crate::operators::{Binary, Unary};

impl Nests<'_> {
    /// The current index of an axis, as usize; for the lanes' axis, that of the first lane.
    pub(super) fn running(&self, axis: AxisId) -> String {
        let lane = self.group.parallel && self.kernel.parallel.last() == Some(&axis);
        if lane { "start".to_owned() } else { format!("i{}", axis.position()) }
    }

    /// Whether a value is an integer from the host: then `z` is that value, as isize.
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

    /// Computes a number that is uniform over a block, in f64.
    pub(super) fn settled(&self, value: ValueId) -> Vec<String> {
        let id = value.position();
        match &self.kernel.nodes[value] {
            Node::Load { buffer, indices, .. } if self.is_whole(value) => {
                let (_, offset) = self.offset(*buffer, indices, false);
                vec![
                    format!("let z{id}: isize = {}[{offset}] as isize;", local("m", *buffer)),
                    format!("let u{id}: f64 = z{id} as f64;"),
                ]
            }
            _ => vec![format!("let u{id}: f64 = {};", self.uniform(value))],
        }
    }

    fn uniform(&self, value: ValueId) -> String {
        let u = |value: &ValueId| format!("u{}", value.position());
        match &self.kernel.nodes[value] {
            Node::Constant(bits) => constant(f64::from_bits(*bits)),
            Node::Axis(axis) => format!("{} as f64", self.running(*axis)),
            Node::Unary(operator, operand) => match operator {
                Unary::Not => format!("1.0 - {}", u(operand)),
                Unary::Negate => format!("-{}", u(operand)),
                // The functions with identical results on every processor are slow without instruction selection.
                operator => format!("Unary::{operator:?}.apply({})", u(operand)),
            },
            Node::Binary(operator, left, right) => arithmetic(*operator, &u(left), &u(right), "f64", "0.0"),
            Node::Select(condition, then, otherwise) => {
                format!("if {} != 0.0 {{ {} }} else {{ {} }}", u(condition), u(then), u(otherwise))
            }
            Node::Load { buffer, indices, otherwise } => {
                let (inside, offset) = self.offset(*buffer, indices, false);
                let cell = match self.kernel.buffers[*buffer].role {
                    Role::Positions(..) => format!("f64::from({}[{offset}])", local("m", *buffer)),
                    _ => format!("{}[{offset}].to_f64()", local("m", *buffer)),
                };
                match otherwise {
                    Some(otherwise) => format!("if {inside} {{ {cell} }} else {{ {} }}", u(otherwise)),
                    None => cell,
                }
            }
        }
    }

    /// One lane of a value.
    pub(super) fn lane(&self, value: ValueId, depth: usize) -> String {
        let x = |value: &ValueId| self.operand(*value, depth);
        match &self.kernel.nodes[value] {
            Node::Constant(bits) => format!("T::from_f64({})", constant(f64::from_bits(*bits))),
            Node::Axis(_) => "T::from_f64((start + l) as f64)".to_owned(),
            Node::Unary(operator, operand) => match operator {
                Unary::Not => format!("T::ONE - {}", x(operand)),
                Unary::Negate => format!("-{}", x(operand)),
                operator => format!("Scalar::{}({})", function(*operator), x(operand)),
            },
            Node::Binary(Binary::Less, left, right) if self.is_infinity(*right) => {
                format!("<T as Scalar>::truth(Scalar::is_below_infinity({}))", x(left))
            }
            Node::Binary(operator, left, right) => arithmetic(*operator, &x(left), &x(right), "T", "T::ZERO"),
            Node::Select(condition, then, otherwise) => {
                format!("if {} != T::ZERO {{ {} }} else {{ {} }}", x(condition), x(then), x(otherwise))
            }
            Node::Load { buffer, indices, otherwise } if self.is_fetched(value) => {
                let id = value.position();
                let otherwise = otherwise.as_ref().map_or_else(|| "T::ZERO".to_owned(), x);
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
                let within = turned.map_or_else(String::new, |(wraps, axis)| {
                    format!(
                        " && (u{} != 0.0 || (from{id} + l as isize >= 0 && from{id} + (l as isize) < {} as isize))",
                        wraps.position(),
                        local("e", *axis)
                    )
                });
                format!("if inside{id}{within} {{ r{id}[l] }} else {{ {otherwise} }}")
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

pub(super) fn function(operator: Unary) -> &'static str {
    match operator {
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
        Unary::Negate | Unary::Not => unreachable!("internal: written as operators"),
    }
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
