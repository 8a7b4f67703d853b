//! Particles move to the next instant.
//!
//! In: the particles of an instant, and the observations of the next. Out: the particles there, with their weights. Invariant: each
//! particle has a stream of random numbers of its own for each instant; nothing is allocated for a particle whose variables are
//! all drawn.

use super::{Cloud, Guide, Moves, Particle};
use crate::distribution::{Contexts, Instance, LinearMean, Setting};
use crate::error::Error;
use crate::random::Random;
use crate::sample::{Observations, Streams};
use crate::strategies::over_time::Instant;
use crate::strategies::weighting::draw_or_weigh;
use rand::RngExt;
use rayon::prelude::*;

/// Number of particles that one thread moves at a time.
const CHUNK: usize = 64;

/// Instances, and the distributions of those whose parents are finite.
pub(super) type Instances<'i> = (&'i [Instance], &'i [Option<Contexts>]);

impl Moves<'_> {
    /// Follows one more instant; `false` where no particle agrees with its observations.
    pub(crate) fn advance(&self, cloud: &mut Cloud, observed: &Instant) -> Result<bool, Error> {
        self.advance_by(None, cloud, observed)
    }

    pub(super) fn advance_by(
        &self,
        guide: Option<&Guide>,
        cloud: &mut Cloud,
        observed: &Instant,
    ) -> Result<bool, Error> {
        let (count, instant) = (cloud.particles.len(), cloud.effective.len());
        let streams = Streams::new(self.sampling.seed, "particles");
        let resampling = Streams::new(self.sampling.seed, "resampling");
        match instant.checked_sub(1) {
            Some(before) if cloud.effective[before] < 0.5 * count as f64 => {
                cloud.resample(resampling.stream(before).random());
            }
            _ => cloud.keep_all(),
        }
        let observed = self.of_elements(observed);
        let mut observations = Observations::none(&self.setting);
        observed.iter().for_each(|(slot, value)| observations.values[*slot] = *value);
        // A chunk of particles, with their weights and what the guide expects.
        type Chunk<'c> = ((&'c mut [Particle], &'c mut [f64]), &'c mut [f64]);
        let step = |(chunk, ((particles, weights), ahead)): (usize, Chunk<'_>)| -> Result<(), Error> {
            let mut last = Vec::with_capacity(self.blank.len());
            let places = particles.iter_mut().zip(weights).zip(ahead).enumerate();
            for (place, ((particle, ln_weight), ln_ahead)) in places {
                // A particle of weight zero has no values from which the next instant could follow.
                *ln_ahead = 0.0;
                if *ln_weight == f64::NEG_INFINITY {
                    continue;
                }
                if instant > 0 {
                    self.carry(particle, &mut last);
                }
                let mut random = streams.stream((instant + 1) * count + chunk * CHUNK + place);
                observed.iter().for_each(|(slot, value)| particle.values[*slot] = *value);
                let [more, ahead] = self.moved(guide, instant + 1, &observations, &mut random, particle)?;
                *ln_weight += more;
                *ln_ahead = ahead;
            }
            Ok(())
        };
        let particles = cloud.particles.par_chunks_mut(CHUNK).zip(cloud.ln_weights.par_chunks_mut(CHUNK));
        particles
            .zip(cloud.ln_ahead.par_chunks_mut(CHUNK))
            .enumerate()
            .map(step)
            .collect::<Result<(), Error>>()?;
        Ok(cloud.settle())
    }

    /// Moves a particle to an instant (0 is X^-1 before the first): ln of its weight, and of what the guide expects.
    pub(super) fn moved(
        &self,
        guide: Option<&Guide>,
        step: usize,
        observations: &Observations,
        random: &mut Random,
        particle: &mut Particle,
    ) -> Result<[f64; 2], Error> {
        let setting = if step <= 1 { &self.first } else { &self.setting };
        let instances = self.instances(step);
        let Some(guide) = guide else {
            let ln_weight = match step > 0 && self.choices(observations) > 1 {
                true => self.choose(setting, instances, (observations, random), particle)?,
                false => self.run(setting, instances, observations, random, particle)?,
            };
            return Ok([ln_weight, 0.0]);
        };
        let (lead, mut known) = (&guide.leads[step], observations.clone());
        let (values, ln_proposal) = lead.propose(particle, random);
        for (slot, value) in lead.proposed.iter().zip(values) {
            (particle.values[*slot], known.values[*slot]) = (value, value);
        }
        let ln_weight = self.run(setting, instances, &known, random, particle)? - ln_proposal;
        Ok([ln_weight, lead.ln_ahead(particle)])
    }

    /// The instances of an instant (0 is X^-1 before the first).
    pub(super) fn instances(&self, step: usize) -> Instances<'_> {
        (if step == 0 { &self.before } else { &self.now }, &self.contexts[step.min(2)])
    }

    /// X becomes X^-1; `last` is memory.
    pub(super) fn carry(&self, particle: &mut Particle, last: &mut Vec<f64>) {
        last.clone_from(&particle.values);
        particle.values.copy_from_slice(&self.blank);
        for (now, previous) in &self.carried {
            particle.values[*previous] = if self.linear[*previous] { f64::NAN } else { last[*now] };
        }
        if self.linear.contains(&true) {
            let linear = self.carried.iter().filter(|(_, previous)| self.linear[*previous]);
            particle.law = particle.law.renamed(linear.copied());
        }
    }

    /// Runs the forms, parents first; returns the ln weight of the observations.
    pub(super) fn run(
        &self,
        setting: &Setting<'_>,
        (instances, contexts): Instances<'_>,
        observations: &Observations,
        random: &mut Random,
        particle: &mut Particle,
    ) -> Result<f64, Error> {
        let mut ln_weight = 0.0;
        for (instance, contexts) in instances.iter().zip(contexts) {
            ln_weight += match self.linear[instance.left[0]] {
                true => self.extend(setting, instance, observations.values[instance.left[0]], particle)?,
                false => {
                    let instance = (instance, contexts.as_ref());
                    draw_or_weigh(setting, instance, observations, random, &mut particle.values)?
                }
            };
            if ln_weight == f64::NEG_INFINITY {
                break;
            }
        }
        Ok(ln_weight)
    }

    /// Adds a linear variable to the law of a particle; if it is observed, weighs and conditions.
    fn extend(
        &self,
        setting: &Setting<'_>,
        instance: &Instance,
        observed: f64,
        particle: &mut Particle,
    ) -> Result<f64, Error> {
        let slot = instance.left[0];
        let LinearMean { terms, constant, deviation } =
            setting.linear_mean(instance, &particle.values, &self.linear)?;
        particle.law.extend(slot, &terms, constant, deviation);
        particle.values[slot] = f64::NAN;
        Ok(if observed.is_nan() { 0.0 } else { particle.law.observe(slot, observed) })
    }
}
