//! From the cells of an output to rows with named values.
//!
//! In: an output of a kernel, its extents, and what the host gave. Out: rows. Invariant: a value that was given when
//! asked is named like any other; the largest is sought within each context, not among contexts.

use super::{Figure, Row, argmax};
use crate::error::Error;
use crate::exec::Inputs;
use crate::ids::VariableId;
use crate::lower::Output;
use crate::model::{Ask, Domain, IndexSpace, Model, Reduction, SetKind, Value};
use std::collections::BTreeMap;
use std::ops::Range;

pub(super) struct Reading<'r> {
    model: &'r Model,
    ask: &'r Ask,
    cells: &'r [f64],
    extents: &'r [usize],
    inputs: &'r Inputs<'r, f64>,
    /// Which axes of the output each variable has.
    axes: Vec<(VariableId, Range<usize>)>,
    /// The axes of the plate, where no variable ranges over them.
    plate: Range<usize>,
}

impl<'r> Reading<'r> {
    pub(super) fn new(
        model: &'r Model,
        ask: &'r Ask,
        output: &Output,
        cells: &'r [f64],
        extents: &'r [usize],
        inputs: &'r Inputs<'r, f64>,
    ) -> Self {
        let (mut axes, mut on_plate) = (Vec::new(), Vec::new());
        let mut next = 0;
        for variable in &output.variables {
            match count_of_axes(model, *variable) {
                // It ranges over the plate's own grid, whose axes come last.
                None => on_plate.push(*variable),
                Some(count) => {
                    axes.push((*variable, next..next + count));
                    next += count;
                }
            }
        }
        let rest = next..extents.len();
        let plate = if on_plate.is_empty() { rest.clone() } else { extents.len()..extents.len() };
        axes.extend(on_plate.into_iter().map(|variable| (variable, rest.clone())));
        Self { model, ask, cells, extents, inputs, axes, plate }
    }

    pub(super) fn rows(&self) -> Result<Vec<Row>, Error> {
        let positions = 0..self.cells.len();
        let chosen: Vec<usize> = match &self.ask.reduction {
            Reduction::Entropy => positions.collect(),
            Reduction::Probability => positions.filter(|position| self.is_wanted(*position)).collect(),
            Reduction::Maximum => self.largest(None)?.into_iter().map(|tied| tied[0]).collect(),
            Reduction::Argmax { nearest } => self.largest(nearest.as_deref())?.concat(),
            _ => unreachable!("internal: the planner refuses what is not answered yet"),
        };
        Ok(chosen.into_iter().map(|position| self.row(position)).collect())
    }

    /// The positions of the largest, for each context in which there is one.
    fn largest(&self, nearest: Option<&str>) -> Result<Vec<Vec<usize>>, Error> {
        let field = match nearest {
            None => None,
            Some(name) => Some(
                self.inputs
                    .find(name)
                    .ok_or_else(|| Error::input(name, "it was not given; it breaks ties"))?,
            ),
        };
        if let (Some(field), Some(name)) = (field, nearest)
            && field.len() != self.cells.len()
        {
            let (found, expected) = (field.len(), self.cells.len());
            let message = format!("{found} numbers were given, but {expected} are expected");
            return Err(Error::input(name, message));
        }
        let mut contexts: BTreeMap<Vec<usize>, Vec<usize>> = BTreeMap::new();
        for position in (0..self.cells.len()).filter(|position| self.is_wanted(*position)) {
            let ordinals = self.ordinals(position);
            let known = self.axes.iter().filter(|(variable, _)| !self.is_searched(*variable));
            let axes = known.map(|(_, axes)| axes.clone()).chain([self.plate.clone()]).flatten();
            contexts.entry(axes.map(|axis| ordinals[axis]).collect()).or_default().push(position);
        }
        let best = contexts.into_values().map(|positions| {
            let scores: Vec<f64> = positions.iter().map(|position| self.cells[*position]).collect();
            let field: Option<Vec<f64>> =
                field.map(|field| positions.iter().map(|position| field[*position]).collect());
            argmax(&scores, field.as_deref()).into_iter().map(|tied| positions[tied]).collect()
        });
        Ok(best.filter(|tied: &Vec<usize>| !tied.is_empty()).collect())
    }

    fn is_searched(&self, variable: VariableId) -> bool {
        self.ask.searched.iter().any(|searched| searched.variable == variable)
    }

    /// Whether a cell lies at the values at which the question wants its variables.
    fn is_wanted(&self, position: usize) -> bool {
        let ordinals = self.ordinals(position);
        self.axes.iter().all(|(variable, axes)| {
            let searched = self.ask.searched.iter().find(|searched| searched.variable == *variable);
            match searched.and_then(|searched| searched.at.as_ref()) {
                Some(Value::Ordinal(ordinal)) => ordinals[axes.start] == *ordinal,
                Some(Value::Given(name)) => {
                    self.given(name, position).is_none_or(|given| ordinals[axes.start] as f64 == given)
                }
                _ => true,
            }
        })
    }

    /// What was given under a name: one number for all, or one for each element of the plate.
    fn given(&self, name: &str, position: usize) -> Option<f64> {
        let values = self.inputs.find(name)?;
        values.get(position % values.len().max(1)).copied()
    }

    fn ordinals(&self, position: usize) -> Vec<usize> {
        let (mut rest, mut ordinals) = (position, vec![0; self.extents.len()]);
        for (axis, extent) in self.extents.iter().enumerate().rev() {
            ordinals[axis] = rest % extent;
            rest /= extent;
        }
        ordinals
    }

    fn row(&self, position: usize) -> Row {
        let ordinals = self.ordinals(position);
        let place = |axes: &Range<usize>| {
            ordinals[axes.clone()].iter().map(usize::to_string).collect::<Vec<_>>().join(",")
        };
        let mut values: Vec<(String, String)> = Vec::new();
        for (variable, axes) in &self.axes {
            let (id, name) = (*variable, self.model.variable_name(*variable));
            match (self.model.variables[id].family, axes.len()) {
                (Some(family), _) => {
                    let first = match family.over {
                        IndexSpace::Range(range) => range.low,
                        IndexSpace::Set(_) => 0,
                    };
                    values.extend(axes.clone().enumerate().map(|(element, axis)| {
                        let element = first + element as i64;
                        (format!("{name}[{element}]"), self.model.value_name(id, ordinals[axis]))
                    }));
                }
                (None, 1) => values.push((name, self.model.value_name(id, ordinals[axes.start]))),
                (None, _) => values.push((name, place(axes))),
            }
        }
        if let (Some(index), false) = (self.model.plate_index(), self.plate.is_empty()) {
            values.push((self.model.variable_name(index), place(&self.plate)));
        }
        for searched in &self.ask.searched {
            let shown = self.axes.iter().any(|(variable, _)| *variable == searched.variable);
            if let (Some(at), false) = (&searched.at, shown) {
                let name = self.model.variable_name(searched.variable);
                values.push((name, self.value_at(searched.variable, at, position)));
            }
        }
        let figure = match self.ask.reduction {
            Reduction::Entropy => Figure::Entropy { entropy: self.cells[position] },
            _ => Figure::Probability { p: self.cells[position] },
        };
        Row { values, figure }
    }

    fn value_at(&self, variable: VariableId, at: &Value, position: usize) -> String {
        let finite = self.model.variables[variable].domain.is_finite();
        match at {
            Value::Ordinal(ordinal) => self.model.value_name(variable, *ordinal),
            Value::Real(number) => number.to_string(),
            Value::Given(name) => match self.given(name, position) {
                Some(ordinal) if finite => self.model.value_name(variable, ordinal as usize),
                Some(number) => number.to_string(),
                None => name.clone(),
            },
        }
    }
}

/// How many axes a variable has in an output; `None` where it shares those of the plate.
fn count_of_axes(model: &Model, variable: VariableId) -> Option<usize> {
    let declared = &model.variables[variable];
    if let Some(family) = declared.family {
        return Some(model.index_count(&family.over).unwrap_or(1));
    }
    match declared.domain {
        Domain::Set(set) if model.plate.is_some_and(|plate| plate.set == set) => None,
        Domain::Set(set) if model.sets[set].kind == SetKind::Grid => Some(3),
        _ => Some(1),
    }
}
