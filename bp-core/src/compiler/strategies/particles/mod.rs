//! Rao-Blackwellised particle filter: drawn values, and a normal law where the model is linear.
//!
//! In: a program, its variables that are linear and Gaussian given the others, observations. Out: weighted particles at
//! the last instant, each with its drawn values and the law of the rest. Invariant: each particle has a stream of
//! random numbers for each instant, and sums have a fixed order: the number of threads changes nothing.
//!
//! The proposal is the program itself (bootstrap: Gordon, Salmond and Smith 1993); wₙ ← wₙ p(z | parentsₙ). Resampled
//! systematically when 1 / Σ W² < N/2 (Kitagawa 1996). A Kalman filter in each particle carries the linear variables,
//! and their observations weigh by N(z; m, S) (Rao-Blackwell: Doucet et al. 2000).

mod linear;
mod offer;

pub(crate) use linear::{is_linear_in, linear};
pub(crate) use offer::Engine;

use crate::distribution::{Instance, LinearMean, Setting, ln_sum};
use crate::error::Error;
use crate::ids::VariableId;
use crate::progress::{self, Work};
use crate::random::Random;
use crate::sample::{Draws, Normals, Observations, Sampling, Streams};
use crate::strategies::gaussian::SlotLaw;
use crate::strategies::over_time::Instant;
use crate::strategies::weighting::draw_or_weigh;
use rand::RngExt;
use rayon::prelude::*;
use std::sync::Arc;

/// One particle.
#[derive(Clone, Debug)]
pub(crate) struct Particle {
    /// The values of the drawn or observed slots.
    pub(crate) values: Vec<f64>,
    /// The law of the slots that are not drawn.
    pub(crate) law: SlotLaw,
}

/// The particles of an instant.
#[derive(Clone, Debug)]
pub(crate) struct Cloud {
    pub(crate) particles: Vec<Particle>,
    /// ln of the weights, which sum to one.
    pub(crate) ln_weights: Vec<f64>,
    /// ln P(observations)
    pub(crate) ln_evidence: f64,
    /// The effective sample size, instant by instant.
    pub(crate) effective: Vec<f64>,
}

/// The transition of the particles.
pub(crate) struct Moves<'s> {
    setting: Arc<Setting<'s>>,
    /// At the first instant.
    first: Arc<Setting<'s>>,
    sampling: Sampling,
    /// The slots that are not drawn.
    linear: Vec<bool>,
    /// Whether a linear slot may have no noise of its own.
    dirac: bool,
    /// The instances of X^-1 before the first instant, and those of an instant.
    before: Vec<Instance>,
    now: Vec<Instance>,
    /// (slot of X, slot of X^-1)
    carried: Vec<(usize, usize)>,
}

impl<'s> Moves<'s> {
    pub(crate) fn new(
        setting: &Setting<'s>,
        carried: &[(VariableId, VariableId)],
        linear: &[VariableId],
        sampling: Sampling,
    ) -> Result<Self, Error> {
        let mut is_linear = vec![false; setting.slots()];
        linear.iter().for_each(|variable| is_linear[setting.slots_of(*variable)].fill(true));
        let model = setting.model;
        let is_dirac = |variable: &VariableId| {
            let form = model.factor_of(*variable).map(|factor| &model.factors[factor].form);
            model.variables[*variable].previous_of.is_none()
                && form.is_none_or(|form| form.as_normal().is_none())
        };
        let (before, now) = setting.ordered()?.into_iter().partition(|instance| {
            model.variables[setting.variable_of(instance.left[0])].previous_of.is_some()
        });
        let slots = |(now, before): &(VariableId, VariableId)| {
            setting.slots_of(*now).zip(setting.slots_of(*before)).collect::<Vec<_>>()
        };
        Ok(Self {
            setting: Arc::new(setting.at(false)),
            first: Arc::new(setting.at(true)),
            sampling,
            before,
            now,
            carried: carried.iter().flat_map(slots).collect(),
            linear: is_linear,
            dirac: linear.iter().any(is_dirac),
        })
    }

    /// Follows the observations.
    ///
    /// # Errors
    /// `Ok(Err(instant))` where no particle agrees with the observations of an instant; numbers outside the range that
    /// a form accepts.
    pub(crate) fn follow(&self, instants: &[Instant]) -> Result<Result<Cloud, usize>, Error> {
        let mut cloud = self.begin()?;
        let work = Work::of(instants.len());
        for (instant, observed) in instants.iter().enumerate() {
            if !work.goes_on() {
                // Interrupted: the instants so far are answered.
                break;
            }
            if !self.advance(&mut cloud, observed)? {
                return Ok(Err(instant));
            }
        }
        cloud.complete();
        match cloud.effective.is_empty() && progress::is_stopped() {
            true => Err(Error::Interrupted),
            false => Ok(Ok(cloud)),
        }
    }

    /// The particles before the first instant.
    pub(crate) fn begin(&self) -> Result<Cloud, Error> {
        let count = self.sampling.particles;
        let streams = Streams::new(self.sampling.seed, "particles");
        let begin = |number: usize| {
            let values = Observations::none(&self.setting).values;
            let mut particle = Particle { values, law: SlotLaw::new(self.dirac) };
            // A carried variable without an initial form is at rest.
            for (_, before) in self.carried.iter().filter(|(_, before)| self.linear[*before]) {
                if particle.values[*before] == 0.0 {
                    particle.law.extend(*before, &[], 0.0, 0.0);
                    particle.values[*before] = f64::NAN;
                }
            }
            let none = Observations::none(&self.setting);
            let ln_weight =
                self.run(&self.first, &self.before, &none, &mut streams.stream(number), &mut particle)?;
            Ok((particle, ln_weight - (count as f64).ln()))
        };
        let begun: Vec<(Particle, f64)> =
            (0..count).into_par_iter().map(begin).collect::<Result<_, Error>>()?;
        let (particles, ln_weights) = begun.into_iter().unzip();
        Ok(Cloud { particles, ln_weights, ln_evidence: 0.0, effective: Vec::new() })
    }

    /// Follows one more instant; `false` where no particle agrees with its observations.
    pub(crate) fn advance(&self, cloud: &mut Cloud, observed: &Instant) -> Result<bool, Error> {
        let (count, instant) = (self.sampling.particles, cloud.effective.len());
        let streams = Streams::new(self.sampling.seed, "particles");
        let resampling = Streams::new(self.sampling.seed, "resampling");
        if let Some(before) = instant.checked_sub(1)
            && cloud.effective[before] < 0.5 * count as f64
        {
            cloud.resample(resampling.stream(before).random());
        }
        let mut observations = Observations::none(&self.setting);
        observed.iter().for_each(|(slot, value)| observations.values[*slot] = *value);
        let step = |((number, particle), ln_weight): ((usize, &mut Particle), &f64)| {
            // A particle of weight zero has no values from which the next instant could follow.
            if *ln_weight == f64::NEG_INFINITY {
                return Ok(0.0);
            }
            if instant > 0 {
                self.carry(particle);
            }
            let mut random = streams.stream((instant + 1) * count + number);
            observed.iter().for_each(|(slot, value)| particle.values[*slot] = *value);
            let setting = if instant == 0 { &self.first } else { &self.setting };
            self.run(setting, &self.now, &observations, &mut random, particle)
        };
        let particles = cloud.particles.par_iter_mut().enumerate();
        let weights: Vec<f64> = particles.zip(&cloud.ln_weights).map(step).collect::<Result<_, Error>>()?;
        cloud.ln_weights.iter_mut().zip(weights).for_each(|(weight, more)| *weight += more);
        let total = ln_sum(&cloud.ln_weights);
        if !total.is_finite() {
            return Ok(false);
        }
        cloud.ln_evidence += total;
        cloud.ln_weights.iter_mut().for_each(|weight| *weight -= total);
        cloud.effective.push(1.0 / cloud.ln_weights.iter().map(|ln| (2.0 * ln).exp()).sum::<f64>());
        Ok(true)
    }

    /// X becomes X^-1.
    fn carry(&self, particle: &mut Particle) {
        let blank = Observations::none(&self.setting).values;
        let before = std::mem::replace(&mut particle.values, blank);
        for (now, previous) in self.carried.iter().filter(|(_, previous)| !self.linear[*previous]) {
            particle.values[*previous] = before[*now];
        }
        let linear = self.carried.iter().filter(|(_, previous)| self.linear[*previous]);
        for (_, previous) in linear.clone() {
            particle.values[*previous] = f64::NAN;
        }
        particle.law = particle.law.renamed(linear.copied());
    }

    /// Runs the forms, parents first; returns the ln weight of the observations.
    fn run(
        &self,
        setting: &Setting<'_>,
        instances: &[Instance],
        observations: &Observations,
        random: &mut Random,
        particle: &mut Particle,
    ) -> Result<f64, Error> {
        let mut ln_weight = 0.0;
        for instance in instances {
            ln_weight += match self.linear[instance.left[0]] {
                true => self.extend(setting, instance, observations.values[instance.left[0]], particle)?,
                false => draw_or_weigh(setting, instance, observations, random, &mut particle.values)?,
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

impl Cloud {
    /// Systematic resampling: copies of each in proportion to its weight, from one uniform number.
    fn resample(&mut self, uniform: f64) {
        let count = self.particles.len();
        // Only particles of positive weight: rounding of the sum must not choose any other.
        let possible: Vec<usize> = (0..count).filter(|own| self.ln_weights[*own].exp() > 0.0).collect();
        let weight = |source: usize| self.ln_weights[possible[source]].exp();
        let (mut sum, mut source, mut chosen) = (weight(0), 0, Vec::with_capacity(count));
        for number in 0..count {
            let position = (number as f64 + uniform) / count as f64;
            while sum < position && source + 1 < possible.len() {
                source += 1;
                sum += weight(source);
            }
            chosen.push(self.particles[possible[source]].clone());
        }
        self.particles = chosen;
        self.ln_weights.fill(-(count as f64).ln());
    }
}

impl Cloud {
    /// Copies values to particles of weight zero, which have none: they contribute nothing but must be readable.
    pub(crate) fn complete(&mut self) {
        let Some(other) = self.ln_weights.iter().position(|weight| *weight > f64::NEG_INFINITY) else {
            return;
        };
        for number in 0..self.particles.len() {
            if self.ln_weights[number] == f64::NEG_INFINITY {
                self.particles[number] = self.particles[other].clone();
            }
        }
    }

    /// The draws of some drawn slots.
    pub(crate) fn draws(&self, slots: &[usize]) -> Draws {
        let of = |particle: &Particle| slots.iter().map(|slot| particle.values[*slot]).collect::<Vec<_>>();
        Draws::weighted(self.particles.iter().flat_map(of).collect(), slots.len(), &self.ln_weights)
    }

    /// The distribution of a slot that was not drawn: a mixture of normal laws.
    pub(crate) fn mixture(&self, slot: usize) -> Normals {
        let law = |(ln, particle): (&f64, &Particle)| {
            let [mean, deviation] = particle.law.of(slot).expect("internal: a linear variable has a law");
            [ln.exp(), mean, deviation]
        };
        Normals::new(self.ln_weights.iter().zip(&self.particles).map(law).collect())
    }
}
