//! Invalid numbers of a form: their density is NaN.
//!
//! In: the numbers of a form, as values of a kernel. Out: the value computed from them, or NaN where the form refuses
//! one of them. Invariant: the conditions are those of `forms/` and `law/`; they depend on the numbers alone, so that
//! known numbers cost nothing and those of a parameter are checked once.
//!
//! NaN propagates to the answer through every sum and product; the caller of the kernel then finds the form with
//! `Setting::not_a_number`.

use super::Lowering;
use crate::error::Error;
use crate::forms::{bernoulli, row, surely, truncated, weights};
use crate::ids::{ExpressionId, ValueId};
use crate::law::{Constraint, Law};
use crate::model::{Expression, Model, row_tolerance};
use std::collections::{BTreeSet, HashMap};

impl Lowering<'_> {
    /// The value where the condition holds, else NaN.
    pub(super) fn only_if(&mut self, holds: ValueId, value: ValueId) -> ValueId {
        let nothing = self.builder.constant(f64::NAN);
        self.builder.select(holds, value, nothing)
    }

    /// The values of some expressions.
    pub(super) fn expressions(&mut self, ids: &[ExpressionId]) -> Result<Vec<ValueId>, Error> {
        ids.iter().map(|id| self.expression(*id)).collect()
    }

    /// A probability; rounding errors beyond [0, 1] are clamped.
    pub(super) fn probability(&mut self, id: ExpressionId) -> Result<ValueId, Error> {
        self.sharing(|lowering| lowering.chosen_probability(id))
    }

    /// Each branch of the choices separately, so that a branch that is constant in all loops is checked once. Shared branches
    /// are lowered once, and depth takes no stack: branches come before the choice between them.
    fn chosen_probability(&mut self, root: ExpressionId) -> Result<ValueId, Error> {
        let (mut waiting, mut arms) = (vec![root], HashMap::new());
        let mut found = BTreeSet::from([root]);
        while let Some(id) = waiting.pop() {
            let Expression::If { then, otherwise, .. } = self.model.expressions[id] else { continue };
            let below = match self.arms(id) {
                Some(chain) => [arms.entry(id).or_insert(chain).rest].to_vec(),
                None => vec![then, otherwise],
            };
            waiting.extend(below.into_iter().filter(|branch| found.insert(*branch)));
        }
        let mut values: HashMap<ExpressionId, ValueId> = HashMap::new();
        for id in found {
            let chain = match arms.get(&id) {
                Some(arms) => {
                    self.chain(arms, values[&arms.rest], |number| !(0.0..=1.0).contains(&number))?
                }
                None => None,
            };
            let value = match (chain, &self.model.expressions[id]) {
                (Some(value), _) => value,
                (None, Expression::If { condition, then, otherwise }) if !arms.contains_key(&id) => {
                    let condition = self.expression(*condition)?;
                    self.builder.select(condition, values[then], values[otherwise])
                }
                (None, _) => self.checked_probability(id)?,
            };
            values.insert(id, value);
        }
        Ok(values[&root])
    }

    /// A probability that is not a choice, or a choice that is checked as a whole.
    fn checked_probability(&mut self, id: ExpressionId) -> Result<ValueId, Error> {
        let value = self.expression(id)?;
        if surely::is_probability(self.model, id) {
            return Ok(value);
        }
        let holds = bernoulli::holds(&mut self.builder, value, tolerance(self.model, id));
        let nearest = self.nearest_probability(id, value);
        Ok(self.only_if(holds, nearest))
    }

    /// The probabilities of a row, which sum to one.
    pub(super) fn row(&mut self, entries: &[ExpressionId]) -> Result<Vec<ValueId>, Error> {
        let values = self.expressions(entries)?;
        let model = self.model;
        let tolerance = |position: usize| {
            let id = entries[position];
            (!surely::is_probability(model, id)).then(|| tolerance(model, id))
        };
        let holds = row::holds(&mut self.builder, &values, tolerance);
        let entry = |(value, entry): (&ValueId, &ExpressionId)| {
            let nearest = self.nearest_probability(*entry, *value);
            self.only_if(holds, nearest)
        };
        Ok(values.iter().zip(entries).map(entry).collect())
    }

    /// A computed probability with rounding errors beyond [0, 1] clamped.
    fn nearest_probability(&mut self, id: ExpressionId, value: ValueId) -> ValueId {
        match surely::is_probability(self.model, id) || !self.model.is_computed(id) {
            true => value,
            false => bernoulli::nearest(&mut self.builder, value),
        }
    }

    /// A weight, which is finite and not negative.
    pub(super) fn weight(&mut self, id: ExpressionId) -> Result<ValueId, Error> {
        let value = self.expression(id)?;
        let holds = weights::holds(&mut self.builder, value);
        Ok(self.only_if(holds, value))
    }

    /// Whether an expression satisfies a constraint.
    pub(super) fn keeps(&mut self, id: ExpressionId, constraint: Constraint) -> Result<ValueId, Error> {
        if constraint == Constraint::Real && surely::is_finite(self.model, id) {
            return Ok(self.builder.constant(1.0));
        }
        let value = self.expression(id)?;
        Ok(constraint.holds(&mut self.builder, value))
    }

    /// Whether one bound is less than the other.
    pub(super) fn are_bounds(&mut self, bounds: [ExpressionId; 2]) -> Result<ValueId, Error> {
        let bounds = [self.expression(bounds[0])?, self.expression(bounds[1])?];
        Ok(truncated::holds(&mut self.builder, bounds))
    }

    /// The parameters of a law; rounding errors of computed probabilities are clamped.
    pub(super) fn parameters(&mut self, law: Law, arguments: &[ExpressionId]) -> Result<Vec<ValueId>, Error> {
        let mut values = self.expressions(arguments)?;
        for ((value, id), (_, constraint)) in values.iter_mut().zip(arguments).zip(law.parameters()) {
            if constraint.is_probability() && !surely::is_probability(self.model, *id) {
                let tolerance = tolerance(self.model, *id);
                *value = bernoulli::rounded(&mut self.builder, *value, tolerance);
            }
        }
        Ok(values)
    }

    /// Whether the parameters of a law are valid.
    pub(super) fn law_holds(&mut self, law: Law, arguments: &[ExpressionId]) -> Result<ValueId, Error> {
        let parameters = self.parameters(law, arguments)?;
        let model = self.model;
        let is_surely = |position: usize, constraint| {
            constraint == Constraint::Real && surely::is_finite(model, arguments[position])
        };
        Ok(law.holds(&mut self.builder, &parameters, is_surely))
    }
}

/// The tolerance of a probability outside [0, 1]: only a computed number is rounded.
fn tolerance(model: &Model, id: ExpressionId) -> f64 {
    if model.is_computed(id) { row_tolerance(1) } else { 0.0 }
}
