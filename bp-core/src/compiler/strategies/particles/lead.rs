//! The guide of particles in numbers: for each instant the proposal of a particle and what it expects, as functions of its state.
//!
//! In: a guide, and a particle that follows its path. Out: a [`Lead`] for each instant. Invariant: means move with the state of each
//! particle, covariances are those along the path; in a linear program they are those of every particle.

use super::guide::Guide;
use super::{Moves, Particle};
use crate::error::Error;
use crate::random::Random;
use crate::sample::{Observations, Streams};
use crate::strategies::gaussian::{NormalLaw, SlotLaw};
use crate::strategies::over_time::Instant;
use nalgebra::DMatrix;

/// A residual that is standard normal: Σ factor · slot + constant.
type Residual = (Vec<(usize, f64)>, f64);

/// A step of the guide for particles: their law given the observations moves with their state; its covariance is that of the path.
#[derive(Clone, Debug)]
pub(super) struct Lead {
    /// The slots of X^-1: with the value on the path, and the slopes of the means of the proposed slots.
    inputs: Vec<(usize, f64, Vec<f64>)>,
    pub(super) proposed: Vec<usize>,
    law: NormalLaw,
    /// The residuals of later observations.
    ahead: Vec<Residual>,
}

impl Lead {
    /// Values of the proposed slots, and ln of their density.
    pub(super) fn propose(&self, particle: &Particle, random: &mut Random) -> (Vec<f64>, f64) {
        let mut shift = vec![0.0; self.proposed.len()];
        for (slot, at, slopes) in &self.inputs {
            let off = particle.law.mean(*slot).unwrap_or(particle.values[*slot]) - at;
            shift.iter_mut().zip(slopes).for_each(|(cell, slope)| *cell += slope * off);
        }
        let drawn = self.law.draw(random);
        let ln_density = self.law.ln_density(&drawn);
        (drawn.iter().zip(shift).map(|(value, shift)| value + shift).collect(), ln_density)
    }

    /// ln of what a particle's state makes of the observations after the instant, up to a constant.
    pub(super) fn ln_ahead(&self, particle: &Particle) -> f64 {
        let of = |(terms, constant): &Residual| {
            let value = |slot: usize| particle.law.mean(slot).unwrap_or(particle.values[slot]);
            let residual = constant + terms.iter().map(|(slot, factor)| factor * value(*slot)).sum::<f64>();
            -0.5 * residual * residual
        };
        self.ahead.iter().map(of).sum()
    }
}

impl Guide {
    /// The proposal of an instant, for particles near a particle of the path before it, whose law has their covariances.
    pub(super) fn lead(
        &self,
        step: usize,
        proposed: Vec<usize>,
        entered: &[usize],
        particle: &Particle,
    ) -> Lead {
        let Particle { values, law } = particle;
        let own = self.law(step, values, law).select(&proposed);
        let means = own.means();
        let inputs = entered.iter().filter_map(|slot| {
            let at = law.mean(*slot).unwrap_or(values[*slot]);
            let moved = match law.has(*slot) {
                true => self.law(step, values, &law.with_mean(*slot, at + 1.0)),
                false => {
                    let mut values = values.clone();
                    values[*slot] += 1.0;
                    self.law(step, &values, law)
                }
            };
            let slopes: Vec<f64> = (moved.select(&proposed).means() - &means).iter().copied().collect();
            at.is_finite().then_some((*slot, at, slopes))
        });
        Lead { inputs: inputs.collect(), proposed, law: own, ahead: Vec::new() }
    }

    /// What later observations make of the state of a particle after an instant, for particles whose law has the covariances of
    /// this one: independent residuals.
    pub(super) fn ahead(&self, step: usize, law: &SlotLaw) -> Option<Vec<Residual>> {
        let all = &self.steps[step].ahead;
        if all.is_empty() {
            return Some(Vec::new());
        }
        // The covariance of the residuals: their own noise, and that of the slots of the law.
        let mut joint = law.clone();
        for (number, residual) in all.iter().enumerate() {
            joint.extend(usize::MAX - number, &residual.terms, residual.constant, 1.0);
        }
        let rows: Vec<usize> = (0..all.len()).map(|number| usize::MAX - number).collect();
        let lower = joint.select(&rows).covariance().cholesky()?.l();
        let mut slots: Vec<usize> =
            all.iter().flat_map(|it| it.terms.iter().map(|(slot, _)| *slot)).collect();
        slots.sort_unstable();
        slots.dedup();
        let factor = |row: usize, slot: usize| {
            all[row].terms.iter().filter(|(own, _)| *own == slot).map(|(_, factor)| factor).sum::<f64>()
        };
        let stacked = DMatrix::from_fn(all.len(), slots.len() + 1, |row, column| match slots.get(column) {
            Some(slot) => factor(row, *slot),
            None => all[row].constant,
        });
        let solved = lower.solve_lower_triangular(&stacked)?;
        let row = |row: usize| {
            let terms =
                slots.iter().enumerate().map(|(column, slot)| (*slot, solved[(row, column)])).collect();
            (terms, solved[(row, slots.len())])
        };
        Some((0..all.len()).map(row).collect())
    }
}

impl Moves<'_> {
    /// The steps of the guide, along a particle that follows the path.
    pub(super) fn leads(&self, guide: &Guide, instants: &[Instant]) -> Result<Option<Vec<Lead>>, Error> {
        let mut random = Streams::new(self.sampling.seed, "path").stream(0);
        let mut particle = self.at_rest();
        let mut leads = Vec::with_capacity(instants.len() + 1);
        let before: Vec<usize> = self.carried.iter().map(|(_, before)| *before).collect();
        for step in 0..=instants.len() {
            if step > 1 {
                self.carry(&mut particle, &mut Vec::new());
            }
            let mut known = Observations::none(&self.setting);
            if let Some(number) = step.checked_sub(1) {
                for (slot, value) in &instants[number] {
                    (known.values[*slot], particle.values[*slot]) = (*value, *value);
                }
            }
            let proposed: Vec<usize> = guide.proposed(step).filter(|slot| !self.linear[*slot]).collect();
            let mut lead = guide.lead(step, proposed, if step == 0 { &[] } else { &before }, &particle);
            for slot in &lead.proposed {
                let value = guide.on_path(step, *slot);
                (known.values[*slot], particle.values[*slot]) = (value, value);
            }
            let setting = if step <= 1 { &self.first } else { &self.setting };
            self.run(setting, self.instances(step), &known, &mut random, &mut particle)?;
            let Some(ahead) = guide.ahead(step, &particle.law) else { return Ok(None) };
            lead.ahead = ahead;
            leads.push(lead);
        }
        Ok(Some(leads))
    }
}
