//! Tables: entries chosen by the values of variables.
//!
//! In: rows of a factor, and the meanings of its variables. Out: the entry. Invariant: known numbers are an array that
//! comes with the kernel; computed entries are stored once; an entry at a known position is used directly.

use super::{Lowering, Meaning};
use crate::error::Error;
use crate::ids::{BufferId, ExpressionId, ValueId};
use crate::kernel::{Extent, Reduce, Role};
use crate::model::{Factor, VariableUse};
use crate::operators::Binary;

/// The longest table that is lowered to a chain of choices.
const WRITTEN_OUT: usize = 8;

impl Lowering<'_> {
    /// The entry at an ordinal.
    pub(super) fn choose(&mut self, ordinal: ValueId, values: &[ValueId]) -> ValueId {
        if let Some(constant) = self.builder.as_constant(ordinal) {
            // A Dirac's value may lie outside the domain: an indicator then multiplies this entry.
            let inside = constant >= 0.0 && constant < values.len() as f64;
            return if inside { values[constant as usize] } else { self.builder.constant(0.0) };
        }
        let (last, first) = values.split_last().expect("internal: a row has entries");
        let mut chosen = *last;
        for (position, value) in first.iter().enumerate().rev() {
            let position = self.builder.constant(position as f64);
            let here = self.builder.binary(Binary::Equal, ordinal, position);
            chosen = self.builder.select(here, *value, chosen);
        }
        chosen
    }

    /// A table: its rows are a small array, filled once, from which the entry is read.
    pub(super) fn table(&mut self, factor: &Factor, rows: &[Vec<ExpressionId>]) -> Result<ValueId, Error> {
        let position = self.position(factor)?;
        let mut values: Vec<ValueId> = Vec::new();
        for row in rows {
            values.extend(self.row(row)?);
        }
        if self.builder.as_constant(position).is_some() {
            return Ok(self.choose(position, &values));
        }
        let mut axes = std::collections::BTreeSet::new();
        for value in &values {
            axes.extend(self.axes(*value));
        }
        if !axes.is_empty() || values.len() <= WRITTEN_OUT {
            return Ok(self.choose(position, &values));
        }
        let numbers: Option<Vec<f64>> = values.iter().map(|value| self.builder.as_constant(*value)).collect();
        let buffer = match numbers {
            Some(numbers) => self.array(factor, &numbers),
            None => {
                let axis = self.builder.axis(&self.array_name(factor), Extent::constant(values.len()));
                let running = self.builder.running(axis);
                let entry = self.choose(running, &values);
                let name = self.name("table");
                self.builder.made(&name, &[axis], Reduce::None, entry)
            }
        };
        Ok(self.read(factor, buffer, position))
    }

    /// A table of known numbers.
    pub(super) fn constants(&mut self, factor: &Factor, numbers: &[f64]) -> Result<ValueId, Error> {
        let position = self.position(factor)?;
        if let Some(known) = self.builder.as_constant(position) {
            // As in `choose`: a Dirac's value may lie outside the domain.
            let entry = numbers.get(known as usize).filter(|_| known >= 0.0);
            return Ok(self.builder.constant(entry.copied().unwrap_or(0.0)));
        }
        if numbers.len() <= WRITTEN_OUT {
            let values: Vec<ValueId> = numbers.iter().map(|number| self.builder.constant(*number)).collect();
            return Ok(self.choose(position, &values));
        }
        let buffer = self.array(factor, numbers);
        Ok(self.read(factor, buffer, position))
    }

    /// The name of a factor's array; not the factor's own, which may be that of an answer.
    fn array_name(&self, factor: &Factor) -> String {
        format!("table {}", self.model.head(factor))
    }

    /// The array of these numbers of a factor. The branches of an `if` may each have a table with its own array; a
    /// table that is lowered again reuses its array.
    fn array(&mut self, factor: &Factor, numbers: &[f64]) -> BufferId {
        let head = self.array_name(factor);
        let known = self.tables.get(&head).cloned().unwrap_or_default();
        let is_same = |known: &BufferId| matches!(&self.builder.so_far().buffers[*known].role, Role::Table { numbers: own, .. } if own == numbers);
        if let Some(same) = known.iter().copied().find(is_same) {
            return same;
        }
        let name = if known.is_empty() { head.clone() } else { format!("{head}, {}", known.len() + 1) };
        let axis = self.builder.axis(&name, Extent::constant(numbers.len()));
        let buffer =
            self.builder.buffer(&name, Role::Table { key: None, numbers: numbers.to_vec() }, &[axis]);
        self.tables.entry(head).or_default().push(buffer);
        buffer
    }

    /// The position of an entry: row-major, last variable fastest, right-hand variables first.
    fn position(&mut self, factor: &Factor) -> Result<ValueId, Error> {
        let mut position = self.builder.constant(0.0);
        for use_ in factor.right.iter().chain(&factor.left) {
            let Meaning::Ordinal(ordinal) = self.use_meaning(use_)? else {
                return Err(self.unplanned("a table needs finite variables"));
            };
            let count = self.model.variables[use_.variable].domain.count();
            let count = count.expect("internal: a checked table has finite parents");
            let count = self.builder.constant(count as f64);
            position = self.builder.binary(Binary::Multiply, position, count);
            position = self.builder.binary(Binary::Add, position, ordinal);
        }
        Ok(position)
    }

    /// The entry at a position of an array.
    fn read(&mut self, factor: &Factor, buffer: BufferId, position: ValueId) -> ValueId {
        let place = self.builder.at(position);
        let substituted = |use_: &VariableUse| {
            matches!(self.exact.bindings.get(&use_.variable), Some(crate::equation::Binding::Expression(_)))
        };
        if factor.right.iter().chain(&factor.left).any(substituted) {
            let zero = self.builder.constant(0.0);
            return self.builder.load_or(buffer, vec![place], zero);
        }
        self.builder.load(buffer, vec![place])
    }
}
