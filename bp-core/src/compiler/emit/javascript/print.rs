//! The printer of loops as JavaScript.
//!
//! In: statements of the loop language. Out: lines. Invariant: all numbers are f64; an operand of an operator is a name, a
//! literal or an element, so that none needs parentheses.

use crate::emit::text::Text;
use crate::ids::{BufferId, Id};
use crate::kernel::{Fold, Kernel};
use crate::loops::{Expression, Kind, Local, Of, Operation, Statement};
use crate::operators::{Binary, Mass, Unary};

pub(super) struct Printer<'k> {
    pub(super) kernel: &'k Kernel,
}

impl Printer<'_> {
    /// Statements that run under a condition.
    pub(super) fn guarded(&self, condition: &str, all: &[Statement], text: &mut Text) {
        text.open(format!("if ({condition})"));
        for one in all {
            match one {
                Statement::Scope(body) => self.statements(body, text),
                other => self.statement(other, text),
            }
        }
        text.close();
    }

    fn statements(&self, all: &[Statement], text: &mut Text) {
        all.iter().for_each(|one| self.statement(one, text));
    }

    fn name(&self, local: &Local) -> String {
        match local.of {
            Of::Extent(axis) => {
                let known = self.kernel.axes[axis].extent.known();
                known.expect("internal: all sizes are known").to_string()
            }
            Of::Running(axis) => format!("i{}", axis.position()),
            Of::Lane(value) => format!("v{}", value.position()),
            Of::Index(value, index) => format!("v{}_{index}", value.position()),
            Of::Folded => "folded".to_owned(),
            Of::State => "state".to_owned(),
            of => unreachable!("internal: {of:?} is not of one cell"),
        }
    }

    fn expression(&self, it: &Expression) -> String {
        let parts: Vec<String> = it.operands.iter().map(|operand| self.expression(operand)).collect();
        let part: Vec<&str> = parts.iter().map(String::as_str).collect();
        match (&it.operation, part.as_slice()) {
            (Operation::Local(local), []) => self.name(local),
            (Operation::Constant(Kind::Lane, bits), []) => number(f64::from_bits(*bits)),
            (Operation::Number, [x]) => (*x).to_owned(),
            (Operation::Unary(Kind::Lane, operator), [x]) => unary(*operator, x),
            (Operation::Binary(Kind::Lane, operator), [x, y]) => binary(*operator, x, y),
            (Operation::Mass(Kind::Lane, law), operands) => {
                format!("{}({})", mass(*law), operands.join(", "))
            }
            (Operation::Select(Kind::Lane), [condition, then, otherwise]) => {
                format!("{condition} !== 0 ? {then} : {otherwise}")
            }
            (Operation::Count(count), []) => format!("{count}"),
            (Operation::AsSigned, [x]) => format!("signed({x})"),
            (Operation::Turned, [at, by, extent, wraps]) => format!("turned({at} + {by}, {extent}, {wraps})"),
            (Operation::IsInside, [at, extent]) => format!("{at} >= 0 && {at} < {extent}"),
            (Operation::All, conditions) => conditions.join(" && "),
            (Operation::Cell(buffer), indices) => self.element(*buffer, indices),
            (operation, _) => unreachable!("internal: {operation:?} is not of one cell"),
        }
    }

    /// An element of an array, whose last axis is contiguous.
    fn element(&self, buffer: BufferId, indices: &[&str]) -> String {
        let axes = &self.kernel.buffers[buffer].axes;
        let offset =
            axes.iter().zip(indices).fold(String::new(), |offset, (axis, index)| match offset.is_empty() {
                true => (*index).to_owned(),
                false => format!("({offset}) * {} + {index}", self.name(&Of::Extent(*axis).into())),
            });
        format!("b{}[{}]", buffer.position(), if offset.is_empty() { "0" } else { &offset })
    }

    fn statement(&self, it: &Statement, text: &mut Text) {
        let of = |expression: &Expression| self.expression(expression);
        match it {
            Statement::Let(local, _, value) => {
                text.line(format!("const {} = {};", self.name(local), of(value)));
            }
            Statement::LetWhere(local, [otherwise, holds, value]) => {
                let name = self.name(local);
                text.line(format!("const {name} = {} ? {} : {};", of(holds), of(value), of(otherwise)));
            }
            Statement::Set(place, value) => text.line(format!("{} = {};", of(place), of(value))),
            Statement::State(initial) => text.line(format!("let state = {};", of(initial))),
            Statement::Begin(fold) => text.line(format!("let folded = {};", number(fold.start()))),
            Statement::Fold(fold, value) => text.line(match (fold, of(value)) {
                (Fold::Sum, value) => format!("folded += {value};"),
                (Fold::Product, value) => format!("folded *= {value};"),
                (Fold::Maximum, value) => format!("folded = maximum(folded, {value});"),
            }),
            Statement::Scope(body) => {
                text.open("");
                self.statements(body, text);
                text.close();
            }
            Statement::Scan { axis, backward, body } => {
                let (running, extent) = (axis.position(), self.name(&Of::Extent(*axis).into()));
                text.open(match backward {
                    true => format!("for (let i{running} = {extent} - 1; i{running} >= 0; i{running}--)"),
                    false => format!("for (let i{running} = 0; i{running} < {extent}; i{running}++)"),
                });
                self.statements(body, text);
                text.close();
            }
            other => unreachable!("internal: {other:?} is not of one cell"),
        }
    }
}

/// A number as a literal.
pub(super) fn number(number: f64) -> String {
    match number {
        number if number.is_nan() => "NaN".to_owned(),
        f64::INFINITY => "Infinity".to_owned(),
        f64::NEG_INFINITY => "-Infinity".to_owned(),
        number => format!("{number:?}"),
    }
}

/// The function of the probability of an interval.
fn mass(law: Mass) -> &'static str {
    match law {
        Mass::Gamma => "gammaMass",
        Mass::Beta => "betaMass",
        Mass::StudentT => "studentMass",
        Mass::VonMises => "misesMass",
    }
}

fn unary(operator: Unary, x: &str) -> String {
    match operator {
        Unary::Negate => format!("-{x}"),
        Unary::Not => format!("1 - {x}"),
        Unary::Absolute => format!("Math.abs({x})"),
        Unary::Exponential => format!("Math.exp({x})"),
        Unary::NaturalLogarithm => format!("Math.log({x})"),
        Unary::SquareRoot => format!("Math.sqrt({x})"),
        Unary::Floor => format!("Math.floor({x})"),
        Unary::Ceiling => format!("Math.ceil({x})"),
        Unary::Round => format!("round({x})"),
        Unary::Sine => format!("Math.sin({x})"),
        Unary::Cosine => format!("Math.cos({x})"),
        Unary::BinaryLogarithm => format!("Math.log2({x})"),
        Unary::LnGamma => format!("lnGamma({x})"),
        Unary::LnBessel => format!("lnBessel({x})"),
        Unary::NormalCumulative => format!("normalCumulative({x})"),
        Unary::EntropyTerm => format!("entropyTerm({x})"),
    }
}

fn binary(operator: Binary, x: &str, y: &str) -> String {
    let truth = |condition: String| format!("{condition} ? 1 : 0");
    match operator {
        Binary::Add | Binary::Subtract | Binary::Multiply | Binary::Divide => {
            format!("{x} {} {y}", operator.notation().1)
        }
        Binary::Minimum => format!("minimum({x}, {y})"),
        Binary::Maximum => format!("maximum({x}, {y})"),
        Binary::Power => format!("power({x}, {y})"),
        Binary::Remainder => format!("{x} - {y} * Math.floor({x} / {y})"),
        Binary::ArcTangent => format!("Math.atan2({x}, {y})"),
        Binary::Equal => truth(format!("{x} === {y}")),
        Binary::NotEqual => truth(format!("{x} !== {y}")),
        Binary::And => truth(format!("{x} !== 0 && {y} !== 0")),
        Binary::Or => truth(format!("{x} !== 0 || {y} !== 0")),
        _ => truth(format!("{x} {} {y}", operator.notation().1)),
    }
}
