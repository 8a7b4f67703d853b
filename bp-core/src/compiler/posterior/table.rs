//! A conditional distribution as a table of numbers.
//!
//! In: the cells of an output, its variables and its extents. Out: a [`Table`]. Invariant: the numbers of one context
//! are contiguous; contexts are in the order of the known variables in the question, the last fastest (the plate's
//! index is the very last), and within a context the searched ones likewise. An impossible context is a row of zeros.

use super::numbers::Numbers;
use crate::exec::scalar::{Extended, Scalar};
use crate::ids::VariableId;
use crate::model::{Ask, Domain, IndexSpace, Model, SetKind};
use crate::radix;
use serde::Serialize;
use std::ops::Range;

/// A conditional distribution: one row of numbers for each context.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Table {
    /// The question, as a user would type it.
    pub question: String,
    /// The known variables with a context for each value.
    pub right: Vec<Column>,
    /// The searched ones.
    pub left: Vec<Column>,
    /// The numbers, contiguous for each context.
    #[serde(rename = "table")]
    pub numbers: Numbers,
    /// The same with separate exponents, if they were computed so.
    #[serde(skip)]
    pub(crate) extended: Option<Vec<Extended>>,
}

/// One variable of a table, or one element of a family.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Column {
    /// The variable; `None` for the instants of a question over time.
    #[serde(skip)]
    pub variable: Option<VariableId>,
    /// The position of its element in a family; 0 of a variable alone.
    #[serde(skip)]
    pub element: usize,
    /// Its name.
    pub name: String,
    /// The names of its values, in order.
    pub values: Vec<String>,
}

impl Table {
    /// From the cells of an output, whose axes are those of its variables and then the plate's; the ask comes with its
    /// text.
    pub(crate) fn read(
        model: &Model,
        (ask, question): (&Ask, String),
        variables: &[VariableId],
        cells: Vec<f64>,
        extended: Option<Vec<Extended>>,
        extents: &[usize],
    ) -> Self {
        let searched = |id: VariableId| ask.searched.iter().position(|item| item.variable == id);
        let (mut axes, mut on_plate) = (Vec::new(), None);
        let mut next = 0;
        for id in variables {
            match count_of_axes(model, *id, searched(*id).is_some()) {
                // It ranges over the plate's own grid, whose axes come last.
                None => on_plate = Some(*id),
                Some(count) => {
                    axes.push((*id, next..next + count));
                    next += count;
                }
            }
        }
        let rest = next..extents.len();
        axes.extend(on_plate.or(model.plate_index()).map(|id| (id, rest)));
        let (mut left, right): (Vec<_>, Vec<_>) =
            axes.into_iter().partition(|(id, _)| searched(*id).is_some());
        // Asks that share a joint may name its variables in another order.
        left.sort_by_key(|(id, _)| searched(*id));
        let order: Vec<usize> = right.iter().chain(&left).flat_map(|(_, axes)| axes.clone()).collect();
        let columns = |axes: &[(VariableId, Range<usize>)]| {
            axes.iter().flat_map(|(id, axes)| columns(model, *id, &extents[axes.clone()])).collect()
        };
        Self {
            question,
            right: columns(&right),
            left: columns(&left),
            numbers: transposed(cells, extents, &order).into(),
            extended: extended.map(|cells| transposed(cells, extents, &order)),
        }
    }

    /// The number of numbers in a context.
    pub(crate) fn width(&self) -> usize {
        self.left.iter().map(|column| column.values.len()).product()
    }

    /// The numbers with separate exponents.
    pub(crate) fn extended(&self) -> Vec<Extended> {
        let widened = || self.numbers.iter().map(|number| Extended::from_f64(*number)).collect();
        self.extended.clone().unwrap_or_else(widened)
    }

    /// The numbers of each context.
    pub(crate) fn contexts(&self) -> impl Iterator<Item = &[f64]> {
        self.numbers.chunks(self.width())
    }
}

impl Column {
    /// Whether two columns are of the same variable, and the same element of a family.
    pub(crate) fn is(&self, other: &Self) -> bool {
        (self.variable, self.element) == (other.variable, other.element)
    }

    /// The value of each column at a position, the last fastest.
    pub(crate) fn ordinals(columns: &[Column], position: usize) -> Vec<usize> {
        radix::in_order(position, columns.iter().map(|column| column.values.len()))
    }
}

/// The columns of a variable: one for each element of a family, else one, which for a grid has its cells.
fn columns(model: &Model, id: VariableId, extents: &[usize]) -> Vec<Column> {
    let name = model.variable_name(id);
    let named = |count: usize| (0..count).map(|ordinal| model.value_name(id, ordinal)).collect();
    let column = |element, name, values| Column { variable: Some(id), element, name, values };
    match (model.variables[id].family, extents) {
        (Some(family), _) => {
            let first = match family.over {
                IndexSpace::Range(range) => range.low,
                IndexSpace::Set(_) => 0,
            };
            let element = |position: usize| model.element_name(id, first + position as i64);
            extents.iter().enumerate().map(|(at, count)| column(at, element(at), named(*count))).collect()
        }
        (None, [count]) => vec![column(0, name, named(*count))],
        (None, _) => {
            let mut places = vec![String::new()];
            for extent in extents {
                let comma = if places[0].is_empty() { "" } else { "," };
                places = (places.iter())
                    .flat_map(|place| (0..*extent).map(move |at| format!("{place}{comma}{at}")))
                    .collect();
            }
            vec![column(0, name, places)]
        }
    }
}

/// Cells with permuted axes; the last is contiguous before and after.
fn transposed<T: Copy>(cells: Vec<T>, extents: &[usize], order: &[usize]) -> Vec<T> {
    if order.is_sorted() {
        return cells;
    }
    let strides = radix::strides(extents);
    let axes = order.iter().map(|axis| (extents[*axis], strides[*axis])).collect();
    radix::offsets(axes).map(|at| cells[at]).collect()
}

/// The number of axes of a variable in an output; `None` if it shares those of the plate.
fn count_of_axes(model: &Model, variable: VariableId, searched: bool) -> Option<usize> {
    let declared = &model.variables[variable];
    if let Some(family) = declared.family {
        return Some(model.index_count(&family.over).unwrap_or(1));
    }
    match declared.domain {
        Domain::Set(set) if searched && model.plate.is_some_and(|plate| plate.set == set) => None,
        Domain::Set(set) if model.sets[set].kind == SetKind::Grid => Some(3),
        _ => Some(1),
    }
}
