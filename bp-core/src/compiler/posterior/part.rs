//! The numbers of an answer, by variable and element.
//!
//! In: the result of a strategy. Out: [`Part`]s, which are looked up by [`Slot`], never by a printed name. Invariant:
//! the slots of a part are in the order of the question; in a finite part the last slot is the fastest, and contexts
//! come before slots.

use super::conditional::ConditionalGaussian;
use super::mixture::{Mixture, density};
use super::named_law::NamedLaw;
use super::named_mixture::NamedMixture;
use super::numbers::Numbers;
use super::table::{Column, Table};
use crate::distribution::Setting;
use crate::ids::VariableId;
use crate::model::Model;
use crate::radix;
use crate::sample::{Draws, Normals};
use crate::shared;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A variable, or an element of a family or of a vector.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Slot {
    /// The variable.
    pub variable: VariableId,
    /// The element, numbered as in the program; `None` for a single variable.
    pub index: Option<i64>,
    /// Its number of values; 0 for a real.
    pub count: usize,
}

/// The distribution of some slots.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Part {
    /// Its instant, from 1, if an answer has several.
    pub instant: Option<usize>,
    /// The known slots with a context for each value.
    pub given: Vec<Slot>,
    /// The searched slots.
    pub of: Vec<Slot>,
    /// Their distribution.
    pub law: PartLaw,
}

/// A distribution of slots.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub enum PartLaw {
    /// A probability (or the density of a given real) for each combination of values, context by context.
    Finite(Numbers),
    /// A normal law.
    Normal {
        /// Means.
        mean: Vec<f64>,
        /// Covariances, row by row.
        covariance: Vec<f64>,
    },
    /// A named law for each slot.
    Laws {
        /// The laws.
        laws: Vec<NamedLaw>,
        /// Covariances, row by row.
        covariance: Vec<f64>,
    },
    /// A mixture of named laws.
    NamedMixture(NamedMixture),
    /// A mixture of normal laws.
    Mixture(Mixture),
    /// Of finite slots and reals together.
    ConditionalGaussian(ConditionalGaussian),
    /// Weighted draws.
    Draws(#[serde(with = "shared")] Arc<Draws>, Vec<Drawn>),
}

impl PartLaw {
    /// The density of reals at a point; 0 where the part has none, NaN where it is not known of several together.
    pub fn density(&self, at: &[f64]) -> f64 {
        match self {
            PartLaw::Normal { mean, covariance } => density(mean, covariance, at),
            PartLaw::Mixture(mixture) => mixture.density(at),
            PartLaw::Laws { laws, .. } => match (laws.as_slice(), at) {
                ([law], [at]) => law.density(*at),
                _ => f64::NAN,
            },
            PartLaw::NamedMixture(mixture) => match at {
                [at] => mixture.density(0, *at),
                _ => f64::NAN,
            },
            PartLaw::Finite(_) | PartLaw::ConditionalGaussian(_) | PartLaw::Draws(..) => 0.0,
        }
    }
}

/// The position of a slot's numbers among draws.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub enum Drawn {
    /// At this position of each draw.
    At(usize),
    /// It was not sampled: each draw has a normal distribution of it.
    Normals(Normals),
}

impl Slot {
    /// The slot with this number in a setting.
    pub fn of(setting: &Setting<'_>, slot: usize) -> Self {
        let variable = setting.variable_of(slot);
        let declared = &setting.model.variables[variable];
        let slots = setting.slots_of(variable);
        let first = declared.family.map(|family| family.over.first());
        let first = first.or((slots.len() > 1).then_some(0));
        let count = if declared.domain.is_finite() { setting.count(variable) } else { 0 };
        Self { variable, index: first.map(|first| first + (slot - slots.start) as i64), count }
    }

    /// Its name as written: `X`, `Z[2]`.
    pub fn name(&self, model: &Model) -> String {
        match self.index {
            Some(index) => model.element_name(self.variable, index),
            None => model.variable_name(self.variable),
        }
    }
}

impl Part {
    /// The part of a table.
    pub(crate) fn of_table(model: &Model, table: &Table) -> Self {
        Self {
            instant: None,
            given: slots(model, &table.right),
            of: slots(model, &table.left),
            law: PartLaw::Finite(table.numbers.clone()),
        }
    }

    /// The number of numbers in a context of a finite part.
    pub fn width(&self) -> usize {
        self.of.iter().map(|slot| slot.count).product()
    }
}

/// The ordinals of slots at a position, the last one fastest.
pub fn ordinals(slots: &[Slot], position: usize) -> Vec<usize> {
    radix::in_order(position, slots.iter().map(|slot| slot.count))
}

/// The columns of a table as slots.
fn slots(model: &Model, columns: &[Column]) -> Vec<Slot> {
    let slot = |column: &Column| {
        let variable = column.variable.expect("internal: instants are parts, not columns");
        let family = model.variables[variable].family;
        let index = family.map(|family| family.over.first() + column.element as i64);
        Slot { variable, index, count: column.values.len() }
    };
    columns.iter().map(slot).collect()
}
