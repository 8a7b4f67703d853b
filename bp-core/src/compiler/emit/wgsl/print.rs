//! The printer of loops as WGSL.
//!
//! In: statements of the loop language, and the layout of arrays. Out: lines. Invariant: an invocation has no lanes; a
//! value is named `v` and its position, and all numbers are f32.

use super::layout::{Layout, Place, Term};
use super::value::{binary, constant, unary};
use crate::emit::text::Text;
use crate::ids::{AxisId, BufferId, Id};
use crate::kernel::{Fold, Kernel, Role};
use crate::loops::{Expression, Kind, Local, Of, Operation, Statement, Type};

pub(super) struct Printer<'k> {
    pub(super) kernel: &'k Kernel,
    pub(super) layout: &'k Layout,
}

impl Printer<'_> {
    fn name(&self, local: &Local) -> String {
        match local.of {
            Of::Extent(axis) => self.extent(axis),
            Of::Running(axis) => format!("i{}", axis.position()),
            Of::Lane(value) => format!("v{}", value.position()),
            Of::Index(value, index) => format!("v{}_{index}", value.position()),
            Of::Folded => "folded".to_owned(),
            Of::State => "state".to_owned(),
            of => unreachable!("internal: {of:?} is not of one invocation"),
        }
    }

    fn extent(&self, axis: AxisId) -> String {
        self.layout.extent(axis).signed()
    }

    fn expression(&self, it: &Expression) -> String {
        let parts: Vec<String> = it.operands.iter().map(|operand| self.expression(operand)).collect();
        let part: Vec<&str> = parts.iter().map(String::as_str).collect();
        match (&it.operation, part.as_slice()) {
            (Operation::Local(local), []) => self.name(local),
            (Operation::Constant(Kind::Lane, bits), []) => constant(f64::from_bits(*bits)),
            (Operation::Number, [x]) => format!("f32({x})"),
            (Operation::Unary(Kind::Lane, operator), [x]) => unary(*operator, x),
            (Operation::Binary(Kind::Lane, operator), [x, y]) => binary(*operator, x, y),
            (Operation::Select(Kind::Lane), [condition, then, otherwise]) => {
                format!("select({otherwise}, {then}, {condition} != 0.0)")
            }
            (Operation::Count(count), []) => format!("{count}"),
            (Operation::AsSigned, [x]) => format!("i32({x})"),
            (Operation::Turned, [at, by, extent, wraps]) => format!("turned({at} + {by}, {extent}, {wraps})"),
            (Operation::IsInside, [at, extent]) => format!("{at} >= 0 && {at} < {extent}"),
            (Operation::All, conditions) => conditions.join(" && "),
            (Operation::Cell(buffer), indices) => self.element(*buffer, indices),
            (operation, _) => unreachable!("internal: {operation:?} is not of one invocation"),
        }
    }

    /// An element of a buffer.
    fn element(&self, buffer: BufferId, indices: &[&str]) -> String {
        let made = &self.kernel.buffers[buffer];
        match self.layout.place(buffer) {
            Place::Private(_) => {
                // An invocation has one cell of the plate, so these axes have no index.
                let own =
                    made.axes.iter().zip(indices).filter(|(axis, _)| !self.kernel.parallel.contains(axis));
                let offset = own.fold(String::new(), |offset, (axis, index)| match offset.is_empty() {
                    true => (*index).to_owned(),
                    false => format!("({offset}) * {} + {index}", self.extent(*axis)),
                });
                let offset = if offset.is_empty() { "0" } else { &offset };
                format!("b{}[{offset}]", buffer.position())
            }
            Place::Stored { first, strides } => {
                let terms = indices.iter().zip(strides).map(|(index, stride)| match stride {
                    Term::Known(1) => format!(" + u32({index})"),
                    stride => format!(" + u32({index}) * {}", stride.unsigned()),
                });
                let array = if matches!(made.role, Role::Positions(..)) { "positions" } else { "numbers" };
                format!("{array}[{}{}]", first.unsigned(), terms.collect::<String>())
            }
        }
    }

    /// Statements.
    pub(super) fn statements(&self, all: &[Statement], text: &mut Text) {
        all.iter().for_each(|one| self.statement(one, text));
    }

    fn statement(&self, it: &Statement, text: &mut Text) {
        let of = |expression: &Expression| self.expression(expression);
        match it {
            Statement::Let(local, Type::Lane, value) => {
                text.line(format!("let {}: f32 = {};", self.name(local), of(value)));
            }
            Statement::Let(local, _, value) => {
                text.line(format!("let {} = {};", self.name(local), of(value)))
            }
            Statement::LetWhere(local, [otherwise, holds, value]) => {
                let name = self.name(local);
                text.line(format!("var {name} = {};", of(otherwise)));
                text.open(format!("if {}", of(holds)));
                text.line(format!("{name} = {};", of(value)));
                text.close();
            }
            Statement::Set(place, value) => text.line(format!("{} = {};", of(place), of(value))),
            Statement::State(initial) => text.line(format!("var state = {};", of(initial))),
            Statement::Begin(fold) => text.line(match fold {
                Fold::Sum => "var folded = f32(0.0);",
                Fold::Product => "var folded = f32(1.0);",
                Fold::Maximum => "var folded = f32(-infinity());",
            }),
            Statement::Fold(fold, value) => text.line(match (fold, of(value)) {
                (Fold::Sum, value) => format!("folded += {value};"),
                (Fold::Product, value) => format!("folded *= {value};"),
                (Fold::Maximum, value) => format!("folded = max(folded, {value});"),
            }),
            Statement::Scope(body) => {
                text.open("");
                self.statements(body, text);
                text.close();
            }
            Statement::Turn(axis, turn, body) => {
                text.open("");
                text.line(format!("const i{}: i32 = {turn};", axis.position()));
                self.statements(body, text);
                text.close();
            }
            Statement::Scan { axis, backward, body } => {
                let (running, extent) = (axis.position(), self.extent(*axis));
                text.open(match backward {
                    true => format!("for (var i{running} = {extent} - 1; i{running} >= 0; i{running}--)"),
                    false => format!("for (var i{running} = 0; i{running} < {extent}; i{running}++)"),
                });
                self.statements(body, text);
                text.close();
            }
            other => unreachable!("internal: {other:?} is not of one invocation"),
        }
    }
}
