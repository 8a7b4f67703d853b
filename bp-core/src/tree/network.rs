//! A network: finite variables and tables of numbers over some of them.
//!
//! In: a [`Model`] whose variables are all finite. Out: a [`Network`], variables by number. Invariant: each table is
//! row-major over its variables, the last one fastest, and the product of all tables is the joint distribution.

use crate::error::Error;
use crate::ids::{FactorId, Id, VariableId};
use crate::model::{Factor, Form, Model};

/// A table over some variables.
#[derive(Clone, PartialEq, Debug)]
pub struct Table {
    /// The variables, the last one fastest; the one that it distributes, where it is one, is the last.
    pub variables: Vec<usize>,
    /// The numbers.
    pub values: Vec<f64>,
}

impl Table {
    /// The share of its cells that are not zero.
    pub(super) fn density(&self) -> f64 {
        let some = self.values.iter().filter(|value| **value != 0.0).count();
        some as f64 / self.values.len().max(1) as f64
    }
}

/// Finite variables and tables over them.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Network {
    /// How many values each variable has.
    pub cardinalities: Vec<usize>,
    /// The tables. Table i distributes its last variable given the others, if `parents` says so.
    pub tables: Vec<Table>,
    /// For each variable the table that distributes it.
    pub table_of: Vec<Option<usize>>,
}

/// The most numbers that one table may have.
const MOST_CELLS: usize = 1 << 28;

impl Network {
    /// The tables of a model, with the parameters' own values.
    ///
    /// # Errors
    /// A variable that is not finite, a plate or family, or a form without a table.
    pub fn of(model: &Model) -> Result<Self, Error> {
        let mut network = Network::default();
        for id in model.variables.ids() {
            let variable = &model.variables[id];
            let count =
                variable.domain.count().filter(|_| variable.family.is_none() && model.plate.is_none());
            let count = count.ok_or_else(|| {
                refused(model, format!("`{}` has no list of values", model.variable_name(id)))
            })?;
            network.cardinalities.push(count);
        }
        network.table_of = vec![None; network.cardinalities.len()];
        for (id, factor) in model.factors.iter() {
            let table = network.table(model, id, factor)?;
            for use_ in &factor.left {
                network.table_of[use_.variable.position()] = Some(network.tables.len());
            }
            network.tables.push(table);
        }
        Ok(network)
    }

    fn table(&self, model: &Model, id: FactorId, factor: &Factor) -> Result<Table, Error> {
        let variables: Vec<usize> =
            factor.right.iter().chain(&factor.left).map(|use_| use_.variable.position()).collect();
        let cells = variables
            .iter()
            .try_fold(1usize, |cells, variable| cells.checked_mul(self.cardinalities[*variable]));
        let cells = cells.filter(|cells| *cells <= MOST_CELLS).ok_or_else(|| Error::TooLarge {
            name: model.head(factor),
            cells: variables.iter().map(|variable| self.cardinalities[*variable] as f64).product(),
            most: MOST_CELLS as f64,
            help: "give it fewer parents".to_owned(),
        })?;
        let mut values = Vec::with_capacity(cells);
        if let Form::Constants(numbers) = &factor.form {
            return Ok(Table { variables, values: numbers.clone() });
        }
        if let Form::Table(rows) = &factor.form {
            for entry in rows.iter().flatten() {
                let number = model.evaluate(*entry, &|_| None);
                values.push(number.ok_or_else(|| {
                    refused(model, format!("`{}` is not made of numbers", model.head(factor)))
                })?);
            }
            return Ok(Table { variables, values });
        }
        let mut ordinals = vec![0usize; variables.len()];
        for _ in 0..cells {
            let number = |variable: VariableId| {
                let place = variables.iter().position(|known| *known == variable.position())?;
                Some(model.variables[variable].domain.number(ordinals[place]))
            };
            let ordinal = *ordinals.last().expect("internal: a factor has a left side");
            let p = density(model, factor, &factor.form, ordinal, &number);
            values.push(p.ok_or_else(|| {
                refused(model, format!("`{}` has no table of numbers", model.head(&model.factors[id])))
            })?);
            for (ordinal, variable) in ordinals.iter_mut().zip(&variables).rev() {
                *ordinal += 1;
                if *ordinal < self.cardinalities[*variable] {
                    break;
                }
                *ordinal = 0;
            }
        }
        Ok(Table { variables, values })
    }

    /// The variables that a variable depends on directly.
    pub fn parents(&self, variable: usize) -> impl Iterator<Item = usize> {
        let table = self.table_of[variable].map(|table| &self.tables[table].variables[..]);
        table.unwrap_or_default().iter().copied().filter(move |parent| *parent != variable)
    }
}

fn refused(model: &Model, reason: String) -> Error {
    Error::Unplanned { question: format!("the marginals of {}", model.name), reason }
}

/// The probability of a value, for the forms that need nothing but their parents.
fn density(
    model: &Model,
    factor: &Factor,
    form: &Form,
    ordinal: usize,
    number: &impl Fn(VariableId) -> Option<f64>,
) -> Option<f64> {
    let [left] = factor.left.as_slice() else { return None };
    let domain = &model.variables[left.variable].domain;
    let of = |id| model.evaluate(id, number);
    Some(match form {
        Form::Uniform => 1.0 / domain.count()? as f64,
        Form::Bernoulli(p) => {
            let p = of(*p)?;
            if ordinal == 1 { p } else { 1.0 - p }
        }
        Form::Categorical(entries) => of(*entries.get(ordinal)?)?,
        Form::Dirac(value) => f64::from(u8::from(domain.ordinal_at(of(*value)?) == Some(ordinal))),
        Form::If { condition, then, otherwise } => {
            let branch = if of(*condition)? != 0.0 { then } else { otherwise };
            density(model, factor, branch, ordinal, number)?
        }
        _ => return None,
    })
}
