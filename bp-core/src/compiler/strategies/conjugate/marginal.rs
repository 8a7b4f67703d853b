//! Unknowns that are drawn from their conjugate posteriors, in place of their priors.
//!
//! In: a [`Conjugate`] of what is observed. Out: draws of the unknowns, and which instances they account for. Invariant: a draw has
//! the distribution that the observations leave, so that all draws have one weight, P(evidence).

use super::Conjugate;
use super::answer::Posterior;
use super::unknown::Unknown;
use crate::distribution::{Instance, Setting};
use crate::error::Error;
use crate::ids::FactorId;
use crate::model::Ask;
use crate::random::Random;

/// The posterior of the unknowns.
pub(crate) struct Marginal {
    /// The first slot of each unknown.
    unknowns: Vec<(usize, Unknown)>,
    priors: Vec<FactorId>,
    observed: Vec<FactorId>,
    /// ln P(evidence).
    pub(crate) ln_evidence: f64,
}

impl Conjugate {
    /// The posterior of the unknowns, given these values of slots.
    ///
    /// # Errors
    /// As the strategy.
    pub(crate) fn marginal(
        &self,
        setting: &Setting<'_>,
        ask: &Ask,
        values: Vec<f64>,
    ) -> Result<Marginal, Error> {
        let (posterior, ln_evidence) = Posterior::of(setting, self, ask, values)?;
        let mut unknowns = posterior.into_unknowns();
        unknowns.sort_unstable_by_key(|(slot, _)| *slot);
        let (priors, observed) = (self.priors.clone(), self.observed.clone());
        Ok(Marginal { unknowns, priors, observed, ln_evidence })
    }
}

impl Marginal {
    /// Draws the unknowns.
    pub(crate) fn draw(&self, random: &mut Random, values: &mut [f64]) {
        for (slot, unknown) in &self.unknowns {
            for (place, number) in unknown.draw(random).into_iter().enumerate() {
                values[slot + place] = number;
            }
        }
    }

    /// Whether the draws of the unknowns account for an instance, whose left-hand side has these values.
    pub(crate) fn accounts_for(&self, instance: &Instance, values: &[f64]) -> bool {
        let is_observed = || instance.left.iter().all(|slot| !values[*slot].is_nan());
        self.priors.contains(&instance.factor) || self.observed.contains(&instance.factor) && is_observed()
    }
}
