//! A network: finite variables and tables of numbers over them.
//!
//! In: a model with numbers for its parameters, whose variables are all finite. Out: a [`Network`], its variables
//! numbered. Invariant: each table is row-major over its variables, the last one fastest, and the product of all tables
//! is the joint distribution.

use super::refused::{self, Refused};
use crate::distribution::{Distribution, Instance, Setting};
use crate::error::Error;
use crate::exec::scalar::{Extended, Scalar};
use crate::ids::FactorId;
use crate::memory;
use crate::model::{Factor, Form, Model};
use std::collections::BTreeMap;

/// A table over some variables.
#[derive(Clone, PartialEq, Debug)]
pub struct FactorTable {
    /// The variables, the last one fastest; a table that distributes a variable has it last.
    pub variables: Vec<usize>,
    /// The numbers.
    pub values: Vec<f64>,
}

impl FactorTable {
    /// The share of nonzero cells.
    pub(super) fn density(&self) -> f64 {
        let some = self.values.iter().filter(|value| **value != 0.0).count();
        some as f64 / self.values.len().max(1) as f64
    }
}

/// Finite variables, and tables over them.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Network {
    /// The number of values of each variable.
    pub cardinalities: Vec<usize>,
    /// The tables. If `table_of` names table i for a variable, table i distributes its last variable given the others.
    pub tables: Vec<FactorTable>,
    /// For each variable the table that distributes it.
    pub table_of: Vec<Option<usize>>,
    /// The contexts in which a form refused a number: the table has a uniform row there, which no answer depends on.
    pub refused: Vec<Refused>,
    /// By their numbers, the tables with probabilities that f64 cannot represent: the same cells, with separate
    /// exponents.
    pub wide: BTreeMap<usize, Vec<Extended>>,
}

/// Upper limit on the numbers of one table.
const MOST_CELLS: usize = 1 << 28;

impl Network {
    /// The tables of a model, with the numbers that the host gives: a variable for each element of a family.
    ///
    /// # Errors
    /// A variable that is not finite, a plate, a number that was not given, or a table of more than 2²⁸ numbers.
    pub fn of(setting: &Setting<'_>) -> Result<Self, Error> {
        let model = setting.model;
        if model.plate.is_some() {
            return Err(refused(model, "it is repeated over a plate".to_owned()));
        }
        let mut network = Network::default();
        for id in model.variables.ids() {
            if !model.variables[id].domain.is_finite() {
                let reason = format!("`{}` is not finite", model.variable_name(id));
                return Err(refused(model, reason));
            }
            let slots = setting.slots_of(id);
            network.cardinalities.extend(slots.map(|_| setting.count(id)));
        }
        network.table_of = vec![None; network.cardinalities.len()];
        let (mut assignment, mut room) = (vec![0.0; setting.slots()], room());
        for id in model.factors.ids() {
            for instance in setting.instances(id)? {
                let table = network.table(setting, &instance, &mut assignment, &mut room)?;
                for left in &instance.left {
                    network.table_of[*left] = Some(network.tables.len());
                }
                network.tables.push(table);
            }
        }
        Ok(network)
    }

    /// The tables of some factors alone, none of which is assumed to sum to one, so that none is dropped as barren.
    /// Their variables and those in the slots `wanted` are renumbered; returns the number of each slot, `usize::MAX`
    /// where it has none.
    ///
    /// # Errors
    /// As [`Network::of`].
    pub(crate) fn part(
        setting: &Setting<'_>,
        factors: &[FactorId],
        wanted: &[usize],
    ) -> Result<(Self, Vec<usize>), Error> {
        let mut network = Network::default();
        for id in setting.model.variables.ids() {
            network.cardinalities.extend(setting.slots_of(id).map(|_| setting.count(id)));
        }
        let (mut assignment, mut room) = (vec![0.0; setting.slots()], room());
        for id in factors {
            for instance in setting.instances(*id)? {
                let table = network.table(setting, &instance, &mut assignment, &mut room)?;
                network.tables.push(table);
            }
        }
        let mut used = vec![false; setting.slots()];
        let slots = network.tables.iter().flat_map(|table| &table.variables).chain(wanted);
        slots.for_each(|slot| used[*slot] = true);
        let mut numbers = vec![usize::MAX; setting.slots()];
        let mut cardinalities = Vec::new();
        for slot in (0..used.len()).filter(|slot| used[*slot]) {
            numbers[slot] = cardinalities.len();
            cardinalities.push(network.cardinalities[slot]);
        }
        let of_tables = network.tables.iter_mut().flat_map(|table| &mut table.variables);
        let of_refused = network.refused.iter_mut().flat_map(|refused| &mut refused.at);
        for variable in of_tables.chain(of_refused.map(|(variable, _)| variable)) {
            *variable = numbers[*variable];
        }
        network.table_of = vec![None; cardinalities.len()];
        network.cardinalities = cardinalities;
        Ok((network, numbers))
    }

    /// The tables of some factors, which distribute all ancestors of their variables, as [`Network::part`]: each is known to
    /// sum to one.
    ///
    /// # Errors
    /// As [`Network::of`].
    pub(crate) fn ancestral(
        setting: &Setting<'_>,
        factors: &[FactorId],
        wanted: &[usize],
    ) -> Result<(Self, Vec<usize>), Error> {
        let (mut network, numbers) = Self::part(setting, factors, wanted)?;
        let mut table = 0;
        for id in factors {
            for instance in setting.instances(*id)? {
                instance.left.iter().for_each(|left| network.table_of[numbers[*left]] = Some(table));
                table += 1;
            }
        }
        Ok((network, numbers))
    }

    /// The table of an instance; `assignment` is all zeros before and after; its cells are subtracted from `room`.
    fn table(
        &mut self,
        setting: &Setting<'_>,
        instance: &Instance,
        assignment: &mut [f64],
        room: &mut f64,
    ) -> Result<FactorTable, Error> {
        let factor = &setting.model.factors[instance.factor];
        // Written numbers are in the order of the decomposition.
        if let Form::Constants(numbers) = &factor.form
            && factor.products.is_empty()
        {
            take(room, numbers.len(), setting, factor)?;
            let right = factor.right.iter().map(|use_| setting.slots_of(use_.variable).start);
            return Ok(FactorTable {
                variables: right.chain(instance.left.iter().copied()).collect(),
                values: numbers.clone(),
            });
        }
        let read = setting.reads(instance);
        let parents: Vec<usize> = read.into_iter().filter(|slot| !instance.left.contains(slot)).collect();
        let variables = [parents.as_slice(), &instance.left].concat();
        let extents = variables.iter().map(|variable| self.cardinalities[*variable]);
        let cells = extents.clone().try_fold(1usize, usize::checked_mul).filter(|cells| *cells <= MOST_CELLS);
        let cells = cells.ok_or_else(|| Error::TooLarge {
            name: setting.model.head(factor),
            cells: extents.map(|extent| extent as f64).product(),
            most: MOST_CELLS as f64,
            help: FEWER.to_owned(),
        })?;
        take(room, cells, setting, factor)?;
        let mut values: Vec<f64> = Vec::with_capacity(cells);
        let mut wide: Option<Vec<Extended>> = None;
        let entries: usize = instance.left.iter().map(|left| self.cardinalities[*left]).product();
        while values.len() < cells {
            match setting.distribution(instance, assignment) {
                Ok(Distribution::Finite(probabilities)) => values.extend(probabilities),
                Ok(Distribution::Wide(probabilities)) => {
                    if wide.is_none() {
                        take(room, 2 * cells, setting, factor)?;
                    }
                    let wide = wide.get_or_insert_default();
                    wide.extend(values[wide.len()..].iter().map(|p| Extended::from_f64(*p)));
                    values.extend(probabilities.iter().map(|p| p.to_f64()));
                    wide.extend(probabilities);
                }
                Err(Error::Number { form, context, message }) if self.refused.len() < refused::MOST => {
                    let at = parents.iter().map(|parent| (*parent, assignment[*parent] as usize)).collect();
                    let words = [form, context, message];
                    self.refused.push(Refused { table: self.tables.len(), at, words });
                    values.extend(std::iter::repeat_n(1.0 / entries as f64, entries));
                }
                Err(error) => return Err(error),
                Ok(_) => {
                    let reason = format!("`{}` has no table of numbers", setting.model.head(factor));
                    return Err(refused(setting.model, reason));
                }
            }
            for parent in parents.iter().rev() {
                assignment[*parent] += 1.0;
                if assignment[*parent] < self.cardinalities[*parent] as f64 {
                    break;
                }
                assignment[*parent] = 0.0;
            }
        }
        if let Some(mut wide) = wide {
            wide.extend(values[wide.len()..].iter().map(|p| Extended::from_f64(*p)));
            self.wide.insert(self.tables.len(), wide);
        }
        Ok(FactorTable { variables, values })
    }

    /// The variables that a variable depends on directly.
    pub fn parents(&self, variable: usize) -> impl Iterator<Item = usize> {
        let table = self.table_of[variable].map(|table| &self.tables[table].variables[..]);
        table.unwrap_or_default().iter().copied().filter(move |parent| *parent != variable)
    }
}

/// The remedy that the error for a too large table suggests.
const FEWER: &str = "give the variable fewer parents, or make their domains smaller";

/// The number of cells that fit in memory.
fn room() -> f64 {
    memory::free().map_or(f64::INFINITY, |bytes| (bytes / 8.0).floor())
}

/// Subtracts the cells of a table from those that fit in memory.
fn take(room: &mut f64, cells: usize, setting: &Setting<'_>, factor: &Factor) -> Result<(), Error> {
    let cells = cells as f64;
    if cells > *room {
        let name = setting.model.head(factor);
        return Err(Error::TooLarge { name, cells, most: *room, help: FEWER.to_owned() });
    }
    *room -= cells;
    Ok(())
}

fn refused(model: &Model, reason: String) -> Error {
    Error::Unplanned { question: format!("the marginals of {}", model.name), reason }
}
