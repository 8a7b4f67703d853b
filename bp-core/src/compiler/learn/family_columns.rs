//! Columns of families: one for each element.
//!
//! In: a program, the columns of a table. Out: how the columns of a family are named, where they are not there. Invariant: an element
//! is named by its index, as in a question.

use super::program::Program;
use crate::data::Records;
use crate::door::Advice;
use crate::ids::VariableId;
use crate::model::Model;
use crate::spelling::quoted;

/// Whether a column has the name of a whole family.
pub(super) fn is_family(model: &Model, column: &str) -> bool {
    let families = model.variables.ids().filter(|id| model.variables[*id].family.is_some());
    families.map(|id| model.variable_name(id)).any(|name| name == column.trim())
}

/// A family none of whose elements has a column.
pub(super) fn without_columns(program: &Program, table: &Records) -> Option<String> {
    let model = &program.model;
    let families = model.variables.ids().filter(|id| model.variables[*id].family.is_some());
    let has_column = |id: &VariableId| {
        program.slots.iter().any(|slot| slot.variable == *id && table.columns.contains(&slot.name))
    };
    let mut open = families.filter(|id| !has_column(id) && !model.hidden.contains(id));
    open.next().map(|id| model.spelled(id))
}

/// The first index of a family.
pub(super) fn first_of(model: &Model, name: &str) -> i64 {
    let family = model.variable(name).and_then(|id| model.variables[id].family);
    family.map_or(1, |family| family.over.first())
}

/// The message for a column of a whole family.
pub(super) fn elements_apart(model: &Model, name: &str) -> String {
    let shown = quoted(name);
    let first = first_of(model, name);
    format!(
        "column `{name}`: `{shown}` is a family; its elements have columns of their own, such as `{shown}[{first}]`; a table with \
         a row for each element is given by `{}`",
        Advice::Rows
    )
}
