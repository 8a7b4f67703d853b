//! The states from which chains begin.
//!
//! In: a program prepared for chains. Out: a state of positive density. Invariant: of several states that are tried it is the one
//! under which the observations are most probable: draws of the prior, the same nearer to the medians of the priors, and numbers of the
//! size of 1, since of a vague prior hardly any draw agrees with the observations.

use super::blanket::{Blankets, Memory, Node};
use crate::distribution::{Distribution, Instance};
use crate::error::Error;
use crate::law::{Law, Support};
use crate::model::Domain;
use crate::posterior::NamedLaw;
use crate::random::Random;
use crate::strategies::weighting::draw_or_weigh;

/// Upper limit on the states that are tried, until one has a positive density.
const MOST_BEGINNINGS: usize = 10_000;

/// So many are compared, fewer where they have very many factors.
const COMPARED: usize = 40;
const MOST_FACTORS: usize = 200_000;

/// Draws of the prior are brought nearer to the medians by so many halves in turn.
const MOST_HALVES: usize = 20;

/// What a state is tried from.
#[derive(Clone, Copy)]
enum Attempt {
    /// Draws of the prior, with their distances from the medians times this factor.
    Prior(f64),
    /// Numbers of the size of 1 inside the supports.
    Unit,
}

impl Blankets<'_> {
    /// A state under which the evidence has a positive density.
    ///
    /// # Errors
    /// No such state was found; a parameter outside the range that its law accepts in all of them.
    pub(super) fn beginning(&self, memory: &mut Memory, random: &mut Random) -> Result<Vec<f64>, Error> {
        let compared = (MOST_FACTORS / self.nodes.len().max(1)).clamp(1, COMPARED);
        let (mut best, mut refused): (Option<(Vec<f64>, f64)>, _) = (None, None);
        for tried in 0..MOST_BEGINNINGS {
            if tried >= compared && best.is_some() {
                break;
            }
            let attempt = match tried % 2 {
                0 => Attempt::Prior(0.5f64.powi((tried / 2 % MOST_HALVES) as i32)),
                _ => Attempt::Unit,
            };
            match self.begin(attempt, memory, random) {
                Ok((values, ln)) if ln > f64::NEG_INFINITY => {
                    if best.as_ref().is_none_or(|(_, most)| ln > *most) {
                        best = Some((values, ln));
                    }
                }
                Ok(_) => {}
                // Far from the median a number may overflow, such as the rate of a Poisson regression.
                Err(error @ Error::Number { .. }) if tried < COMPARED || best.is_some() => {
                    refused = Some(error)
                }
                Err(error) => return Err(error),
            }
        }
        let none =
            || refused.unwrap_or_else(|| Error::unmet(self.setting.model.name.clone(), MOST_BEGINNINGS));
        best.map(|(values, _)| values).ok_or_else(none)
    }

    /// A state from which a chain may begin, and ln of the density of the observations.
    ///
    /// # Errors
    /// A parameter outside the range that its law accepts.
    fn begin(
        &self,
        attempt: Attempt,
        memory: &mut Memory,
        random: &mut Random,
    ) -> Result<(Vec<f64>, f64), Error> {
        let mut values = self.observations.values.clone();
        if let Some(rest) = &self.rest {
            rest.withdraw(&mut values);
        }
        let mut ln = 0.0;
        for node in &self.nodes {
            ln += match node {
                Node::Weighed(instance) if self.is_flat(instance) && !values[instance.left[0]].is_nan() => {
                    self.ln_density(node, &mut values)?
                }
                Node::Weighed(instance) if self.is_flat(instance) => {
                    let drawn = Law::Normal.draw(random, &[0.0, 1.0]);
                    values[instance.left[0]] = if self.is_half_flat(instance) { drawn.abs() } else { drawn };
                    0.0
                }
                Node::Weighed(instance) => {
                    let is_drawn = values[instance.left[0]].is_nan();
                    let ln = draw_or_weigh(
                        self.setting,
                        (instance, None),
                        self.observations,
                        random,
                        &mut values,
                    )?;
                    if is_drawn {
                        self.bring_nearer(instance, attempt, (random, &mut values))?;
                    }
                    ln
                }
                // Its density comes with the integral; what is to be drawn begins at a value near those of its parents.
                Node::Integrated(instance) if values[instance.left[0]].is_nan() => {
                    draw_or_weigh(self.setting, (instance, None), self.observations, random, &mut values)?;
                    0.0
                }
                Node::Summed(instance, _) if values[instance.left[0]].is_nan() => {
                    draw_or_weigh(self.setting, (instance, None), self.observations, random, &mut values)?
                        .min(0.0)
                }
                other => self.ln_density(other, &mut values)?,
            };
            if ln == f64::NEG_INFINITY || ln.is_nan() {
                return Ok((values, f64::NEG_INFINITY));
            }
        }
        self.finite.withdraw(&mut values);
        let all: Vec<usize> = (0..self.finite.clumps()).collect();
        ln += self.finite.ln_sum(&all, &mut values, &mut memory.sums)?;
        if let Some(rest) = &self.rest {
            ln += rest.ln_density(&values, &mut memory.equations)?;
        }
        Ok((values, ln))
    }

    /// Replaces a real that was drawn from its prior.
    fn bring_nearer(
        &self,
        instance: &Instance,
        attempt: Attempt,
        (random, values): (&mut Random, &mut [f64]),
    ) -> Result<(), Error> {
        let slot = instance.left[0];
        let is_real = self.setting.model.variables[self.setting.variable_of(slot)].domain == Domain::Real;
        if !is_real || matches!(attempt, Attempt::Prior(1.0)) {
            return Ok(());
        }
        let distribution = self.setting.distribution(instance, values)?;
        let Distribution::Law(law, parameters) = distribution else { return Ok(()) };
        let near = match attempt {
            _ if law.support() == Support::Counts => return Ok(()),
            Attempt::Prior(factor) => {
                let median = NamedLaw { law, parameters }.quantile(0.5);
                median + factor * (values[slot] - median)
            }
            Attempt::Unit => {
                let drawn = Law::Normal.draw(random, &[0.0, 1.0]);
                match law.support() {
                    Support::Positive => drawn.exp(),
                    Support::UnitInterval => 1.0 / (1.0 + (-drawn).exp()),
                    _ => drawn,
                }
            }
        };
        if distribution.ln_density(near) > f64::NEG_INFINITY {
            values[slot] = near;
        }
        Ok(())
    }
}
