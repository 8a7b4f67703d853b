//! Unknowns that are drawn from their conjugate posteriors, in place of their priors.
//!
//! In: a [`Summed`] of what is observed. Out: draws of the finite variables and of the unknowns given these, and which instances they
//! account for. Invariant: a draw has the distribution that the observations leave, so that all draws have one weight, P(evidence).

use super::answer::Posterior;
use super::summed::Summed;
use super::unknown::Unknown;
use crate::distribution::{Instance, Setting, ln_terms, ln_weights};
use crate::error::{Error, Impossible};
use crate::ids::{FactorId, VariableId};
use crate::model::{Ask, Model};
use crate::radix;
use crate::random::Random;
use rand::RngExt;
use rayon::prelude::*;

/// The posterior of the unknowns.
pub(crate) struct Marginal {
    combinations: Vec<Combination>,
    /// The slots of the finite variables.
    finite: Vec<usize>,
    priors: Vec<FactorId>,
    observed: Vec<FactorId>,
    /// ln P(evidence).
    pub(crate) ln_evidence: f64,
}

/// A combination of values of the finite variables.
struct Combination {
    /// The probability of this combination and of those before it.
    up_to: f64,
    values: Vec<usize>,
    /// The first slot of each unknown, and its posterior.
    unknowns: Vec<(usize, Unknown)>,
}

impl Summed {
    /// The variables that are drawn: finite ones, and unknowns.
    pub(crate) fn unknowns(&self, model: &Model) -> Vec<VariableId> {
        let priors = self.given.priors.iter().map(|id| model.factors[*id].left[0].variable);
        self.finite.iter().copied().chain(priors).collect()
    }

    /// The posterior of the unknowns, given these values of slots.
    ///
    /// # Errors
    /// As the strategy.
    pub(crate) fn marginal(
        &self,
        setting: &Setting<'_>,
        ask: &Ask,
        observed: &[f64],
    ) -> Result<Marginal, Error> {
        let account = |combinations, finite, ln_evidence| Marginal {
            combinations,
            finite,
            priors: self.given.priors.clone(),
            observed: self.given.observed.clone(),
            ln_evidence,
        };
        if self.finite.is_empty() {
            let (posterior, ln_evidence) = Posterior::of(setting, &self.given, ask, observed.to_vec())?;
            let only = Combination { up_to: 1.0, values: Vec::new(), unknowns: in_order(posterior) };
            return Ok(account(vec![only], Vec::new(), ln_evidence));
        }
        let slots: Vec<usize> = self.finite.iter().flat_map(|id| setting.slots_of(*id)).collect();
        let counts: Vec<usize> = slots.iter().map(|slot| setting.count(setting.variable_of(*slot))).collect();
        let combination = |number: usize| {
            let own = radix::in_order(number, counts.iter().copied());
            let mut values = observed.to_vec();
            slots.iter().zip(&own).for_each(|(slot, ordinal)| values[*slot] = *ordinal as f64);
            let (posterior, ln_weight) = Posterior::at(setting, &self.given, values)?;
            Ok((!ln_weight.is_nothing()).then(|| (ln_weight, own, in_order(posterior))))
        };
        let found: Vec<_> = (0..counts.iter().product())
            .into_par_iter()
            .map(combination)
            .collect::<Result<Vec<_>, Error>>()?
            .into_iter()
            .flatten()
            .collect();
        if found.is_empty() {
            let reason = setting.zero_factor(observed);
            return Err(Error::Impossible(Impossible { question: setting.model.ask_text(ask), reason }));
        }
        let lns: Vec<_> = found.iter().map(|(ln_weight, ..)| *ln_weight).collect();
        let (weights, ln_evidence) = ln_weights(&lns, ln_terms::EXACT, || setting.model.ask_text(ask))?;
        if !ln_evidence.is_finite() {
            return Err(setting.not_a_number(&setting.model.ask_text(ask), observed));
        }
        let mut up_to = 0.0;
        let combinations = found.into_iter().zip(weights).map(|((_, values, unknowns), weight)| {
            up_to += weight;
            Combination { up_to, values, unknowns }
        });
        Ok(account(combinations.collect(), slots, ln_evidence))
    }
}

/// The first slot of each unknown, ascending, and its distribution.
fn in_order(posterior: Posterior<'_>) -> Vec<(usize, Unknown)> {
    let mut unknowns = posterior.into_unknowns();
    unknowns.sort_unstable_by_key(|(slot, _)| *slot);
    unknowns
}

impl Marginal {
    /// Draws the finite variables and the unknowns.
    pub(crate) fn draw(&self, random: &mut Random, values: &mut [f64]) {
        let last = self.combinations.len() - 1;
        let place = match last {
            0 => 0,
            _ => {
                let part = random.random::<f64>() * self.combinations[last].up_to;
                self.combinations.partition_point(|own| own.up_to <= part).min(last)
            }
        };
        let Combination { values: own, unknowns, .. } = &self.combinations[place];
        self.finite.iter().zip(own).for_each(|(slot, ordinal)| values[*slot] = *ordinal as f64);
        for (slot, unknown) in unknowns {
            for (place, number) in unknown.draw(random).into_iter().enumerate() {
                values[slot + place] = number;
            }
        }
    }

    /// Whether the draws account for an instance, whose left-hand side has these values.
    pub(crate) fn accounts_for(&self, instance: &Instance, values: &[f64]) -> bool {
        let is_drawn = |slot: &usize| !values[*slot].is_nan() || self.finite.contains(slot);
        self.priors.contains(&instance.factor)
            || self.observed.contains(&instance.factor) && instance.left.iter().all(is_drawn)
    }
}
