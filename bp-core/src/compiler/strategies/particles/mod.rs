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
mod moving;
mod offer;
mod paths;

pub(crate) use cloud::Cloud;
pub(crate) use guide::Guide;
pub(crate) use linear::linear;
pub(crate) use offer::Engine;
pub(crate) use paths::{Path, Paths};

use crate::analysis::relevant_variables;
use crate::distribution::{Contexts, Instance, Setting};
use crate::error::Error;
use crate::ids::{Id, VariableId};
use crate::model::{Ask, DerivedKind};
use crate::progress::{self, Work};
use crate::sample::{Observations, Sampling, Streams};
use crate::strategies::gaussian::SlotLaw;
use crate::strategies::over_time::Instant;
use crate::strategies::weighting::contexts;
use rayon::prelude::*;
use std::sync::Arc;

/// One particle.
#[derive(Debug)]
pub(crate) struct Particle {
    /// The values of the drawn or observed slots.
    pub(crate) values: Vec<f64>,
    /// The law of the slots that are not drawn.
    pub(crate) law: SlotLaw,
}

impl Clone for Particle {
    fn clone(&self) -> Self {
        Self { values: self.values.clone(), law: self.law.clone() }
    }

    /// In the memory of this particle.
    fn clone_from(&mut self, other: &Self) {
        self.values.clone_from(&other.values);
        self.law.clone_from(&other.law);
    }
}

/// The transition of the particles.
#[derive(Clone)]
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
    /// Their distributions where the parents are finite: those before the first instant, at it, and later.
    contexts: Arc<[Vec<Option<Contexts>>; 3]>,
    /// The values of an instant before anything is drawn.
    blank: Vec<f64>,
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

/// As [`GUIDED`], where finite variables alone are drawn, given the observations of their instant.
const CHOSEN: usize = 10_000;

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
        relevant_variables(model, std::slice::from_ref(ask))
            .into_iter()
            .for_each(|id| matters[id.position()] = true);
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
        let (first, later) = (setting.at(true), setting.at(false));
        let of =
            |setting: &Setting<'_>, instances: &[Instance]| contexts(setting, instances, sampling.particles);
        Ok(Self {
            contexts: Arc::new([of(&first, &before), of(&first, &now), of(&later, &now)]),
            blank: Observations::none(setting).values,
            setting: Arc::new(later),
            first: Arc::new(first),
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

    /// Follows the observations, guided where that is possible, and gives the guide; the first of the instants that no particle
    /// agrees with is an inner error.
    ///
    /// # Errors
    /// Numbers outside the range that a form accepts.
    pub(crate) fn follow(
        &self,
        instants: &[Instant],
        each: &mut dyn FnMut(&Cloud),
    ) -> Result<Result<(Cloud, Option<Guide>), usize>, Error> {
        let unguided = |cloud: Result<Cloud, usize>| cloud.map(|cloud| (cloud, None));
        let Some(guide) = self.guide(instants) else {
            return self.follow_by(instants, None, self.unguided(), each).map(unguided);
        };
        // Unguided particles see whether the guide misses a part: it would lower its estimate of P(observations).
        let scouts =
            self.follow_by(instants, None, (self.count() / 10).max(self.count().min(1000)), &mut |_| {})?;
        if progress::is_stopped() {
            return Ok(unguided(scouts));
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
        match trusted {
            true => Ok(guided.map(|cloud| (cloud, Some(guide)))),
            false => self.follow_by(instants, None, self.count(), each).map(unguided),
        }
    }

    /// The number of particles without a guide: fewer, where finite variables alone are drawn, given the observations of their
    /// instant, and each particle carries the distribution of the reals.
    fn unguided(&self) -> usize {
        let is_chosen = !self.finite.is_empty() && self.linear.contains(&true);
        if is_chosen { self.count().min(CHOSEN + self.count() / 20) } else { self.count() }
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
        let values = self.blank.clone();
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
        match cloud.effective.is_empty() && progress::is_stopped() || !work.is_wanted() {
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
}
