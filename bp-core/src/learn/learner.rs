//! Learning from cases, one after the other.
//!
//! In: a model, then cases. Out: a [`Learned`] model and a [`Report`](super::Report), whenever they are wanted. Invariant:
//! what is learned depends on the cases and how often each came, not on their order: a stream and a batch are the same.

use super::case::Case;
use super::distribution::{Cell, Learnable, Seen, cells_of};
use super::estimate::estimate;
use super::hidden::{Incomplete, maximise};
use super::report::report;
use super::statistics::Statistic;
use super::{Learned, Settings};
use crate::data::{Table, Values};
use crate::error::Error;
use crate::ids::{Id, VariableId};
use crate::model::Model;
use std::collections::{BTreeMap, HashMap};

/// What has been seen so far.
#[derive(Clone, Debug)]
pub struct Learner {
    pub(super) learnable: Learnable,
    statistics: Vec<Statistic>,
    /// Cases of which a learned form misses something, and how often each came.
    incomplete: BTreeMap<Vec<Option<u64>>, f64>,
    pub(super) cases: usize,
    /// How often each variable was seen.
    pub(super) seen: Vec<usize>,
}

impl Learner {
    /// Nothing has been seen yet.
    ///
    /// # Errors
    /// Nothing is to be learned, or something cannot be.
    pub fn new(model: &Model) -> Result<Self, Error> {
        let learnable = Learnable::new(model)?;
        let statistics = learnable.distributions.iter().map(|it| Statistic::of(&it.kind)).collect();
        let seen = vec![0; model.variables.len()];
        Ok(Self { learnable, statistics, incomplete: BTreeMap::new(), cases: 0, seen })
    }

    /// A case was seen.
    ///
    /// # Errors
    /// A number is no value of its variable; nothing is learned of the case then.
    pub fn observe(&mut self, case: &Case) -> Result<(), Error> {
        self.learnable.check(case)?;
        let factors = self.learnable.factors.clone();
        let whole = factors.iter().all(|factor| case.missing(&self.learnable.family(*factor)) == 0);
        if whole {
            let mut located: Vec<(usize, Seen)> = Vec::new();
            for factor in factors {
                located.extend(self.learnable.locate(factor, &|variable| case.number(variable))?);
            }
            for (position, seen) in located {
                grow(&self.learnable, &mut self.statistics);
                self.statistics[position].add(&seen, 1.0);
            }
        } else {
            *self.incomplete.entry(case.key()).or_default() += 1.0;
        }
        self.cases += 1;
        for (position, count) in self.seen.iter_mut().enumerate() {
            *count += usize::from(case.number(VariableId::new(position)).is_some());
        }
        Ok(())
    }

    /// All cases of a table were seen; columns that name no variable are left out.
    ///
    /// # Errors
    /// A cell is no value of its variable: the error names file, row, column and value. No column names a variable.
    pub fn observe_table(&mut self, table: &Table) -> Result<(), Error> {
        let model = self.learnable.model.clone();
        let columns: Vec<(usize, VariableId, Values<'_>)> = (table.columns.iter().enumerate())
            .filter_map(|(position, column)| Some((position, model.variable(column)?)))
            .map(|(position, variable)| (position, variable, Values::new(&model, variable, &|_| None)))
            .collect();
        if columns.is_empty() {
            let message = format!(
                "no column names a variable of `{}`; the columns are {}",
                model.name,
                table.columns.iter().map(|column| format!("`{column}`")).collect::<Vec<_>>().join(", ")
            );
            return Err(Error::input(table.path.display().to_string(), message));
        }
        for row in 0..table.len() {
            let mut case = Case::new(&model);
            for (position, variable, values) in &columns {
                if let Some(value) = table.cell(row, *position, values)? {
                    case = case.with(*variable, value.number);
                }
            }
            self.observe(&case)?;
        }
        Ok(())
    }

    /// The model with what has been learned so far.
    ///
    /// # Errors
    /// A law that the cases do not tell; hidden variables of which no exact question can be asked.
    pub fn learned(&self) -> Result<Learned, Error> {
        self.learned_with(&Settings::default(), &mut |_, _| {})
    }

    /// The same, with settings for hidden variables, and a function that is told each iteration and the ln L there.
    ///
    /// # Errors
    /// See [`Learner::learned`].
    pub fn learned_with(
        &self,
        settings: &Settings,
        progress: &mut dyn FnMut(usize, f64),
    ) -> Result<Learned, Error> {
        let mut learnable = self.learnable.clone();
        let mut statistics = self.statistics.clone();
        let mut hidden = Incomplete::new(&mut learnable, &self.incomplete, &mut statistics)?;
        grow(&learnable, &mut statistics);
        let (outcomes, statistics, expectation) = match hidden.is_empty() {
            true => {
                let keep = vec![false; statistics.len()];
                (estimate(&mut learnable, &statistics, &keep)?, statistics, None)
            }
            false => {
                let keep = self.given(&learnable);
                maximise(&mut learnable, &mut hidden, &statistics, &keep, settings, progress)?
            }
        };
        let report = report(self, &learnable, &statistics, &outcomes, expectation);
        Ok(Learned { learnable, report })
    }

    /// Which distributions have values before anything is learned: parameters with defaults.
    fn given(&self, learnable: &Learnable) -> Vec<bool> {
        let mut declared: HashMap<Cell, bool> = HashMap::new();
        let mut is_given = |cell: Cell| {
            *declared.entry(cell).or_insert_with(|| match cell {
                Cell::Place(parameter, _) => {
                    self.learnable.unknowns.parameters[&parameter].is_none()
                        && !self.learnable.model.parameters[parameter].default.is_empty()
                }
                Cell::Entry(_) => false,
            })
        };
        let given = |it: &super::distribution::Distribution, is_given: &mut dyn FnMut(Cell) -> bool| {
            cells_of(&it.kind).into_iter().all(is_given)
        };
        learnable.distributions.iter().map(|it| given(it, &mut is_given)).collect()
    }
}

/// Distributions may be met while cases are looked at.
pub(super) fn grow(learnable: &Learnable, statistics: &mut Vec<Statistic>) {
    let new = &learnable.distributions[statistics.len().min(learnable.distributions.len())..];
    statistics.extend(new.iter().map(|it| Statistic::of(&it.kind)));
}
