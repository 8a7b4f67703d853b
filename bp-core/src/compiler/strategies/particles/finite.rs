//! Finite variables of particles, drawn from their law given the observations of the instant.
//!
//! In: a particle, and the observations. Out: the particle with values of its hidden finite slots, and the ln of its weight: the
//! probability of the observations given the particle before. Invariant: all that is drawn at the instant is finite, so the law is a
//! sum over its combinations.

use super::moving::Instances;
use super::{Moves, Particle};
use crate::distribution::{Setting, choose, ln_sum};
use crate::error::Error;
use crate::radix;
use crate::random::Random;
use crate::sample::Observations;
use rand::RngExt;

/// Upper limit on the combinations of finite values that are tried for each particle.
const MOST_CHOICES: usize = 64;

impl Moves<'_> {
    /// The combinations of values of the hidden finite slots, where all drawn slots are finite; else 1.
    pub(super) fn choices(&self, observations: &Observations) -> usize {
        let hidden = self.finite.iter().filter(|(slot, _)| observations.values[*slot].is_nan());
        let product = hidden.fold(1, |product: usize, (_, count)| product.saturating_mul(*count));
        if product <= MOST_CHOICES { product } else { 1 }
    }

    /// Draws the hidden finite slots from their distribution given the observations of the instant.
    pub(super) fn choose(
        &self,
        setting: &Setting<'_>,
        instances: Instances<'_>,
        (observations, random): (&Observations, &mut Random),
        particle: &mut Particle,
    ) -> Result<f64, Error> {
        let hidden: Vec<(usize, usize)> =
            self.finite.iter().copied().filter(|(slot, _)| observations.values[*slot].is_nan()).collect();
        let mut tried = Vec::new();
        for choice in 0..self.choices(observations) {
            let (mut own, mut known) = (particle.clone(), observations.clone());
            let values = radix::in_order(choice, hidden.iter().map(|(_, count)| *count));
            for ((slot, _), value) in hidden.iter().zip(values) {
                (own.values[*slot], known.values[*slot]) = (value as f64, value as f64);
            }
            let ln = self.run(setting, instances, &known, random, &mut own)?;
            tried.push((ln, own));
        }
        let lns: Vec<f64> = tried.iter().map(|(ln, _)| *ln).collect();
        let total = ln_sum(&lns);
        let shares: Vec<f64> = lns.iter().map(|ln| (ln - total).exp()).collect();
        if let Some(chosen) = total.is_finite().then(|| choose(&shares, random.random::<f64>())).flatten() {
            *particle = tried.swap_remove(chosen).1;
        }
        Ok(total)
    }
}
