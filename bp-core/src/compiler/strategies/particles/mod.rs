//! Rao-Blackwellised particle filter: drawn values, and a normal law where the model is linear.
//!
//! In: a program, its variables that are linear and Gaussian given the others, observations. Out: weighted particles at
//! the last instant, each with its drawn values and the law of the rest. Invariant: each particle has a stream of
//! random numbers for each instant, and sums have a fixed order: the number of threads changes nothing.
//!
//! Where nothing is hidden but finite variables and what is linear given them, they are drawn from their law given the next
//! observations (fully adapted: Pitt and Shephard 1999). Where every hidden real has a normal form, a guide (`guide.rs`) proposes. Otherwise
//! the proposal is the program itself (bootstrap: Gordon, Salmond and Smith 1993); wₙ ← wₙ p(z | parentsₙ). Resampled
//! systematically when 1 / Σ W² < N/2 (Kitagawa 1996). A Kalman filter in each particle carries the linear variables,
//! and their observations weigh by N(z; m, S) (Rao-Blackwell: Doucet et al. 2000).

mod cloud;
mod constants;
mod finite;
mod guide;
mod lead;
mod linear;
mod offer;
mod paths;

pub(crate) use cloud::Cloud;
pub(crate) use guide::Guide;
pub(crate) use linear::{is_linear_in, linear};
pub(crate) use offer::Engine;
pub(crate) use paths::{Path, Paths};

use crate::distribution::{Instance, LinearMean, Setting};
use crate::error::Error;
use crate::ids::{Id, VariableId};
use crate::model::{Ask, DerivedKind};
use crate::progress::{self, Work};
use crate::random::Random;
use crate::sample::{Observations, Sampling, Streams};
use crate::strategies::gaussian::{SlotLaw, relevant};
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
    /// For a name that a question gives to an element, its slot and that of the element.
    elements: Vec<(usize, usize)>,
    /// The variables that matter to the question.
    relevant: Vec<bool>,
    /// The hidden slots of an instant, where all that are drawn are finite; empty where others are drawn too.
    finite: Vec<(usize, usize)>,
    /// Whether others than finite slots are drawn.
    reals: bool,
    /// A real that is drawn once, before the first instant.
    constant: Option<VariableId>,
}

/// A guided particle is worth many: of a large number, so many are followed at least.
const GUIDED: usize = 2000;

/// The difference of two estimates of ln P(observations) above which the larger one is believed: the other has missed something.
const MISSED: f64 = 0.1;

impl<'s> Moves<'s> {
    pub(crate) fn new(
        setting: &Setting<'s>,
        ask: &Ask,
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
        let (before, now): (Vec<Instance>, Vec<Instance>) =
            setting.ordered()?.into_iter().partition(|instance| {
                model.variables[setting.variable_of(instance.left[0])].previous_of.is_some()
            });
        let mut matters = vec![false; model.variables.len()];
        relevant(model, std::slice::from_ref(ask)).into_iter().for_each(|id| matters[id.position()] = true);
        let drawn = now
            .iter()
            .filter(|it| !is_linear[it.left[0]] && matters[setting.variable_of(it.left[0]).position()]);
        let count = |slot: usize| (slot, setting.count(setting.variable_of(slot)));
        let is_finite = |it: &Instance| it.left.len() == 1 && count(it.left[0]).1 > 0;
        let reals = !drawn.clone().all(is_finite);
        let finite = if reals { Vec::new() } else { drawn.map(|it| count(it.left[0])).collect() };
        let is_element = |it: &&Instance| {
            model.variables[setting.variable_of(it.left[0])].derived == Some(DerivedKind::Element)
        };
        let element = |it: &Instance| Some((it.left[0], setting.reads(it).into_iter().next()?));
        let elements = now.iter().filter(is_element).filter_map(element).collect();
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
            elements,
            relevant: matters,
            finite,
            reals,
            linear: is_linear,
            dirac: linear.iter().any(is_dirac),
            constant: constants::constant(model, carried, linear),
        })
    }

    /// Follows the observations, guided where that is possible; the first of the instants that no particle agrees with is an
    /// inner error.
    ///
    /// # Errors
    /// Numbers outside the range that a form accepts.
    pub(crate) fn follow(
        &self,
        instants: &[Instant],
        each: &mut dyn FnMut(&Cloud),
    ) -> Result<Result<Cloud, usize>, Error> {
        let Some(guide) = self.guide(instants) else {
            return self.follow_by(instants, None, self.count(), each);
        };
        // Unguided particles see whether the guide misses a part: it would lower its estimate of P(observations).
        let scouts =
            self.follow_by(instants, None, (self.count() / 10).max(self.count().min(1000)), &mut |_| {})?;
        if progress::is_stopped() {
            return Ok(scouts);
        }
        let guided =
            self.follow_by(instants, Some(&guide), self.count().min(GUIDED + self.count() / 50), each)?;
        let trusted = match (&guided, &scouts) {
            (Ok(guided), Ok(scouts)) => {
                let error: f64 = scouts.effective.iter().map(|own| 1.0 / own).sum::<f64>().sqrt();
                let error = 3.0 * error + MISSED;
                scouts.ln_evidence <= guided.ln_evidence + error
            }
            (guided, _) => guided.is_ok(),
        };
        if trusted { Ok(guided) } else { self.follow_by(instants, None, self.count(), each) }
    }

    /// The number of particles that the user asked for.
    fn count(&self) -> usize {
        self.sampling.particles
    }

    /// The guide of some observations, where the drawn variables are real and normal.
    fn guide(&self, instants: &[Instant]) -> Option<Guide> {
        if !self.reals {
            return None;
        }
        let instants: Vec<Instant> = instants.iter().map(|instant| self.of_elements(instant)).collect();
        let parts = guide::Parts {
            first: &self.first,
            later: &self.setting,
            before: &self.before,
            now: &self.now,
            carried: &self.carried,
            relevant: self.relevant.clone(),
        };
        let mut guide = Guide::of(&parts, &instants)?;
        guide.leads = self.leads(&guide, &instants).ok()??;
        Some(guide)
    }

    /// A particle before its first value: a carried variable without an initial form is at rest.
    fn at_rest(&self) -> Particle {
        let values = Observations::none(&self.setting).values;
        let mut particle = Particle { values, law: SlotLaw::new(self.dirac) };
        for (_, before) in self.carried.iter().filter(|(_, before)| self.linear[*before]) {
            if particle.values[*before] == 0.0 {
                particle.law.extend(*before, &[], 0.0, 0.0);
                particle.values[*before] = f64::NAN;
            }
        }
        particle
    }

    /// Observations of the elements themselves, in place of the names that a question gives to them.
    fn of_elements(&self, instant: &Instant) -> Instant {
        let own =
            |slot: usize| self.elements.iter().find(|(name, _)| *name == slot).map_or(slot, |(_, own)| *own);
        instant.iter().map(|(slot, value)| (own(*slot), *value)).collect()
    }

    fn follow_by(
        &self,
        instants: &[Instant],
        guide: Option<&Guide>,
        count: usize,
        each: &mut dyn FnMut(&Cloud),
    ) -> Result<Result<Cloud, usize>, Error> {
        let mut cloud = self.begin_by(guide, count)?;
        let work = Work::of(instants.len());
        for (instant, observed) in instants.iter().enumerate() {
            if !work.goes_on() {
                // Interrupted: the instants so far are answered.
                break;
            }
            if !self.advance_by(guide, &mut cloud, observed)? {
                return Ok(Err(instant));
            }
            each(&cloud);
        }
        cloud.complete();
        match cloud.effective.is_empty() && progress::is_stopped() {
            true => Err(Error::Interrupted),
            false => Ok(Ok(cloud)),
        }
    }

    /// The particles before the first instant.
    pub(crate) fn begin(&self) -> Result<Cloud, Error> {
        self.begin_by(None, self.count())
    }

    fn begin_by(&self, guide: Option<&Guide>, count: usize) -> Result<Cloud, Error> {
        let streams = Streams::new(self.sampling.seed, "particles");
        let begin = |number: usize| {
            let mut particle = self.at_rest();
            let none = Observations::none(&self.setting);
            let random = &mut streams.stream(number);
            let [ln_weight, ln_ahead] = self.moved(guide, 0, &none, random, &mut particle)?;
            Ok((particle, ln_weight - (count as f64).ln(), ln_ahead))
        };
        let begun: Vec<(Particle, f64, f64)> =
            (0..count).into_par_iter().map(begin).collect::<Result<_, Error>>()?;
        let (weights, ahead) = begun.iter().map(|(_, weight, ahead)| (*weight, *ahead)).unzip();
        let particles = begun.into_iter().map(|(particle, ..)| particle).collect();
        Ok(Cloud::new(particles, weights, ahead, self.constant.is_none()))
    }

    /// Follows one more instant; `false` where no particle agrees with its observations.
    pub(crate) fn advance(&self, cloud: &mut Cloud, observed: &Instant) -> Result<bool, Error> {
        self.advance_by(None, cloud, observed)
    }

    fn advance_by(
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
        let step = |((number, particle), ln_weight): ((usize, &mut Particle), &f64)| {
            // A particle of weight zero has no values from which the next instant could follow.
            if *ln_weight == f64::NEG_INFINITY {
                return Ok([0.0; 2]);
            }
            if instant > 0 {
                self.carry(particle);
            }
            let mut random = streams.stream((instant + 1) * count + number);
            observed.iter().for_each(|(slot, value)| particle.values[*slot] = *value);
            self.moved(guide, instant + 1, &observations, &mut random, particle)
        };
        let particles = cloud.particles.par_iter_mut().enumerate();
        let weights: Vec<[f64; 2]> =
            particles.zip(&cloud.ln_weights).map(step).collect::<Result<_, Error>>()?;
        cloud.ln_weights.iter_mut().zip(&weights).for_each(|(weight, [more, _])| *weight += more);
        cloud.ln_ahead = weights.iter().map(|[_, ahead]| *ahead).collect();
        Ok(cloud.settle())
    }

    /// Moves a particle to an instant (0 is X^-1 before the first): ln of its weight, and of what the guide expects.
    fn moved(
        &self,
        guide: Option<&Guide>,
        step: usize,
        observations: &Observations,
        random: &mut Random,
        particle: &mut Particle,
    ) -> Result<[f64; 2], Error> {
        let setting = if step <= 1 { &self.first } else { &self.setting };
        let instances = if step == 0 { &self.before } else { &self.now };
        let Some(guide) = guide else {
            let ln_weight = match step > 0 && self.choices(observations) > 1 {
                true => self.choose(setting, observations, random, particle)?,
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
