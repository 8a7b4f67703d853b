//! Validation of statements.
//!
//! In: statements, and the names defined before them. Out: nothing, or a panic, because an invalid loop is a bug of the
//! compiler. Invariant: every name is defined before its use, in its block or an enclosing one, so that printers need not
//! check it.

use super::expression::Expression;
use super::local::{Local, Of};
use super::statement::Statement;
use std::collections::HashSet;

/// Checks statements; `before` are the names defined outside, besides arrays, their strides and extents.
pub(crate) fn validate(statements: &[Statement], before: impl IntoIterator<Item = Local>) {
    Scope { known: before.into_iter().collect() }.all(statements);
}

struct Scope {
    known: HashSet<Local>,
}

impl Scope {
    fn uses(&self, expression: &Expression) {
        expression.names(&mut |name| self.uses_name(&name));
    }

    fn uses_name(&self, name: &Local) {
        let is_outside =
            matches!(name.of, Of::Extent(_) | Of::Array(_) | Of::Planes(_) | Of::Stride(..) | Of::IsWhole(_));
        assert!(is_outside || self.known.contains(name), "internal: {name:?} is used before it is defined");
    }

    /// Statements in a new block, with some names defined.
    fn block(&mut self, body: &[Statement], more: impl IntoIterator<Item = Of>) {
        let outer = self.known.clone();
        self.known.extend(more.into_iter().map(Local::from));
        self.all(body);
        self.known = outer;
    }

    fn all(&mut self, statements: &[Statement]) {
        statements.iter().for_each(|statement| self.one(statement));
    }

    fn one(&mut self, statement: &Statement) {
        match statement {
            Statement::Let(name, _, value) | Statement::Tile(name, value) => {
                self.uses(value);
                self.known.insert(name.clone());
            }
            Statement::LetWhere(name, parts) => {
                parts.iter().for_each(|part| self.uses(part));
                self.known.insert(name.clone());
            }
            Statement::Block(name) | Statement::Tiles(name, _) => {
                self.known.insert(name.clone());
            }
            Statement::Scope(body) | Statement::ForLanes(_, body) | Statement::ForTiles(body) => {
                self.block(body, []);
            }
            Statement::For(axis, body)
            | Statement::Turn(axis, _, body)
            | Statement::Scan { axis, body, .. } => self.block(body, [Of::Running(*axis)]),
            Statement::Set(place, value) => {
                self.uses(place);
                self.uses(value);
            }
            Statement::BeginLanes(_) => self.uses_name(&Of::Folded.into()),
            Statement::Cells(_, start) => {
                self.uses(start);
                self.known.insert(Of::Cells.into());
            }
            Statement::Begin(_) => {
                self.known.insert(Of::Folded.into());
            }
            Statement::Fold(_, value) => {
                self.uses_name(&Of::Folded.into());
                self.uses(value);
            }
            Statement::StateOfLanes(value) | Statement::State(value) => {
                self.uses(value);
                self.known.insert(Of::State.into());
            }
            Statement::Store(_, plane, value) => {
                self.uses(plane);
                self.uses(value);
            }
            Statement::Own(_, plane) => {
                self.uses(plane);
                self.known.insert(Of::Own.into());
            }
            Statement::Keep { plane, lanes: name, .. } | Statement::KeepTile { plane, tile: name, .. } => {
                self.uses(plane);
                self.uses_name(name);
            }
            Statement::Look(_, name) | Statement::LookAtTile(_, name) | Statement::Shorten(name, _) => {
                self.uses_name(name);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Operation, Type};
    use super::*;
    use crate::ids::{AxisId, Id, ValueId};

    fn number(value: usize) -> Statement {
        let of = Operation::Number.of([Of::Running(AxisId::new(0)).into()]);
        Statement::Let(Of::Once(ValueId::new(value)).into(), Type::Once, of)
    }

    #[test]
    fn a_name_is_defined_in_its_loop() {
        validate(&[Statement::For(AxisId::new(0), vec![number(0)])], []);
        validate(&[number(0)], [Of::Running(AxisId::new(0)).into()]);
    }

    #[test]
    #[should_panic(
        expected = "internal: Local { of: Running(AxisId(0)), copy: [] } is used before it is defined"
    )]
    fn and_not_after_it() {
        validate(&[Statement::For(AxisId::new(0), vec![number(0)]), number(1)], []);
    }
}
