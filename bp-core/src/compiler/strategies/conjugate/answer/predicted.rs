//! What is not observed, predicted from the posteriors of unknowns.
//!
//! In: a [`Posterior`]. Out: the table of a finite variable, or the probability or the density of one value of a real. Invariant: a
//! prediction is the probability of the observation that it would be, in closed form.

use super::super::Conjugate;
use super::super::likelihood::contribution;
use super::Posterior;
use crate::distribution::{Distribution, Instance};
use crate::equation::Strategy;
use crate::error::Error;
use crate::law::Support;
use crate::model::Ask;
use crate::posterior::{Answer, Figure, Row, Table};
use crate::sample::Observations;
use crate::spelling::exact;

impl Posterior<'_> {
    /// The distribution of a finite variable that is not observed.
    pub(super) fn predicted(&self, of: &Conjugate, ask: &Ask) -> Result<Table, Error> {
        let (setting, model) = (self.setting, self.setting.model);
        let variable = ask.searched[0].variable;
        let slots = self.slots(variable);
        let [slot] = slots.as_slice() else {
            let reason = "one element is predicted at a time: ask for each".to_owned();
            return Err(Error::Unplanned { question: model.ask_text(ask), reason });
        };
        let count = setting.count(setting.variable_of(*slot));
        let mut cells = vec![0.0; count];
        if !self.values[*slot].is_nan() {
            cells[self.values[*slot] as usize] = 1.0;
        } else {
            let instance = self.instance(of, *slot)?;
            for (value, cell) in cells.iter_mut().enumerate() {
                let found =
                    contribution(setting, &instance, &[value as f64], &self.values, &self.is_unknown)?;
                *cell = match found.slot {
                    Some(slot) => self.unknowns[&slot].1.predicts(&found.observed, found.ln_factor),
                    None => found.ln_factor.exp(),
                };
            }
        }
        Ok(Table::read(model, (ask, model.ask_text(ask)), &[variable], cells, None, &[count]))
    }

    /// The probability, or the density, of one value of a real that is not observed; `None` of an unknown.
    pub(super) fn predicted_at(
        &self,
        of: &Conjugate,
        ask: &Ask,
        ln_evidence: Option<f64>,
    ) -> Result<Option<Answer>, Error> {
        let (setting, model) = (self.setting, self.setting.model);
        let slots = self.slots(ask.searched[0].variable);
        let ([slot], Some(at)) = (slots.as_slice(), Observations::searched(setting, ask)?) else {
            return Ok(None);
        };
        if self.is_unknown[*slot] {
            return Ok(None);
        }
        let figure = if self.values[*slot].is_nan() {
            let instance = self.instance(of, *slot)?;
            let found = contribution(setting, &instance, &at, &self.values, &self.is_unknown)?;
            let p = match found.slot {
                Some(slot) => self.unknowns[&slot].1.predicts(&found.observed, found.ln_factor),
                None => found.ln_factor.exp(),
            };
            match self.is_counted(&instance)? {
                true => Figure::Probability { p },
                false => Figure::Density { density: p },
            }
        } else {
            Figure::Probability { p: f64::from(u8::from(self.values[*slot] == at[0])) }
        };
        let name = model.variable_name(ask.searched[0].variable);
        let row = Row { values: vec![(name, exact(at[0]))], figure };
        Ok(Some(Answer {
            question: model.ask_text(ask),
            strategy: Strategy::Conjugate,
            when: ask.when,
            ln_evidence,
            estimate: None,
            answer: vec![row].into(),
            parts: Vec::new(),
        }))
    }

    /// Whether the values of an instance's left-hand side have probabilities.
    fn is_counted(&self, instance: &Instance) -> Result<bool, Error> {
        Ok(match self.setting.distribution(instance, &self.plain())? {
            Distribution::Law(law, _) => law.support() == Support::Counts,
            Distribution::Point(_) => true,
            _ => false,
        })
    }

    /// The instance that distributes a slot.
    fn instance(&self, of: &Conjugate, slot: usize) -> Result<Instance, Error> {
        let variable = self.setting.variable_of(slot);
        let own = of.observed.iter().find(|id| self.setting.model.factors[**id].left[0].variable == variable);
        let all = self.setting.instances(*own.expect("internal: what is predicted is among the factors"))?;
        let found = all.into_iter().find(|instance| instance.left == [slot]);
        Ok(found.expect("internal: each slot has an instance"))
    }
}
