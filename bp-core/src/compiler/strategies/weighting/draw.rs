//! Likelihood weighting.
//!
//! In: a setting, the steps of a route, evidence. Out: weighted draws. Invariant: the draws are from the prior, each
//! weighted by the likelihood of the observations; a draw that the observations exclude has weight 0.
//!
//! wₙ = Π_K P(k | parentsⁿ); for a factor with several left-hand variables of which some are observed, the others are
//! drawn from the conditional, and the weight is the marginal probability of the observed ones.

use super::Treatment;
use crate::distribution::{Contexts, Distribution, Instance, LnTerms, Setting, ln_terms};
use crate::error::Error;
use crate::exec::scalar::Scalar;
use crate::ids::FactorId;
use crate::progress::Work;
use crate::random::Random;
use crate::sample::{Draws, Observations, Sampling, Streams};
use crate::strategies::conjugate::Marginal;
use rayon::prelude::*;
use std::borrow::Cow;

/// Number of draws that one thread makes at a time.
const CHUNK: usize = 256;

/// Limit of the contexts of one instance whose distributions are kept.
const MOST_CONTEXTS: usize = 4096;

/// A step of a route, with its instances.
pub(crate) struct Step {
    pub(crate) instances: Vec<Instance>,
    /// The Dirac that is solved for the left-hand side.
    pub(crate) dirac: Option<Instance>,
}

/// Draws by likelihood weighting, of some unknowns from their `posterior`; keeps the slots `kept`.
///
/// # Errors
/// A parameter outside the range that its law accepts; a Dirac that cannot be solved.
pub(crate) fn weigh(
    setting: &Setting<'_>,
    steps: &[(FactorId, Treatment)],
    observations: &Observations,
    posterior: Option<&Marginal>,
    kept: &[usize],
    sampling: Sampling,
) -> Result<Draws, Error> {
    let mut steps = instances(setting, steps)?;
    if let Some(posterior) = posterior {
        let is_left = |instance: &Instance| !posterior.accounts_for(instance, &observations.values);
        steps.iter_mut().for_each(|step| step.instances.retain(is_left));
    }
    let contexts: Vec<Vec<Option<Contexts>>> =
        steps.iter().map(|step| contexts(setting, &step.instances, sampling.particles)).collect();
    let streams = Streams::new(sampling.seed, "weighting");
    let work = Work::of(sampling.particles);
    // The draws of a chunk: their ln weights, and the kept values of one after the other.
    let draw = |chunk: usize| -> Result<(Vec<LnTerms>, Vec<f64>), Error> {
        let numbers = chunk * CHUNK..sampling.particles.min((chunk + 1) * CHUNK);
        let mut values = observations.values.clone();
        let (mut ln_weights, mut all) =
            (Vec::with_capacity(numbers.len()), Vec::with_capacity(numbers.len() * kept.len()));
        for number in numbers {
            if !work.goes_on() {
                break;
            }
            values.copy_from_slice(&observations.values);
            let mut random = streams.stream(number);
            let mut ln_weight = LnTerms::default();
            if let Some(posterior) = posterior {
                posterior.draw(&mut random, &mut values);
                ln_weight.add(posterior.ln_evidence);
            }
            draw_one(setting, (&steps, &contexts), observations, &mut random, (&mut values, &mut ln_weight))?;
            ln_weights.push(ln_weight);
            all.extend(kept.iter().map(|slot| values[*slot]));
        }
        Ok((ln_weights, all))
    };
    let chunks = sampling.particles.div_ceil(CHUNK);
    let all: Vec<(Vec<LnTerms>, Vec<f64>)> =
        (0..chunks).into_par_iter().map(draw).collect::<Result<_, Error>>()?;
    // When the work is interrupted, the draws made so far answer.
    if !work.is_wanted() {
        return Err(Error::Interrupted);
    }
    let (ln_weights, values): (Vec<Vec<LnTerms>>, Vec<Vec<f64>>) = all.into_iter().unzip();
    let ln_weights = ln_weights.concat();
    if ln_weights.is_empty() {
        return Err(Error::Interrupted);
    }
    let (weights, ln_total) =
        ln_terms::weights(&ln_weights, ln_terms::ESTIMATED, || setting.model.name.clone())?;
    // Draws of one weight, such as those of a posterior, lose no digits of it.
    let ln_mean = match ln_weights.iter().all(|own| *own == ln_weights[0]) {
        true => ln_weights[0].total(),
        false => ln_total - (weights.len() as f64).ln(),
    };
    Ok(Draws::of_weights(values.concat(), kept.len(), weights, ln_mean))
}

/// The distributions of instances whose parents are finite, for this number of draws. (A binomial count has an equation of its
/// own, which sums no distribution.)
pub(crate) fn contexts(setting: &Setting<'_>, instances: &[Instance], draws: usize) -> Vec<Option<Contexts>> {
    let of = |instance: &Instance| match setting.is_count(instance) {
        true => None,
        false => Contexts::of(setting, instance, draws.min(MOST_CONTEXTS)),
    };
    instances.iter().map(of).collect()
}

pub(crate) fn instances(setting: &Setting<'_>, steps: &[(FactorId, Treatment)]) -> Result<Vec<Step>, Error> {
    let of = |(factor, treatment): &(FactorId, Treatment)| {
        let dirac = match treatment {
            Treatment::Solved(factor) => setting.instances(*factor)?.pop(),
            _ => None,
        };
        Ok(Step { instances: setting.instances(*factor)?, dirac })
    };
    let steps: Vec<Step> = steps.iter().map(of).collect::<Result<_, Error>>()?;
    if !setting.model.is_recursive() {
        return Ok(steps);
    }
    // Elements of several families may alternate: a step for each instance.
    let each = |Step { instances, dirac }: Step| {
        instances.into_iter().map(move |instance| (instance, dirac.clone())).collect::<Vec<_>>()
    };
    let apart = steps.into_iter().flat_map(each).collect();
    let sorted = setting.sorted(apart, |(instance, dirac)| (instance, dirac.as_ref()));
    let step = |(instance, dirac)| Step { instances: vec![instance], dirac };
    Ok(sorted.into_iter().map(step).collect())
}

/// Makes one draw in `values`, which already holds the observations; adds the terms of its ln weight.
fn draw_one(
    setting: &Setting<'_>,
    (steps, contexts): (&[Step], &[Vec<Option<Contexts>>]),
    observations: &Observations,
    random: &mut Random,
    (values, ln_weight): (&mut [f64], &mut LnTerms),
) -> Result<(), Error> {
    for (step, contexts) in steps.iter().zip(contexts) {
        for (instance, contexts) in step.instances.iter().zip(contexts) {
            let contexts = contexts.as_ref();
            ln_weight.add(match &step.dirac {
                Some(dirac) => solve(setting, instance, dirac, observations, values)?,
                None => draw_or_weigh(setting, (instance, contexts), observations, random, values)?,
            });
            if ln_weight.is_nothing() {
                return Ok(());
            }
        }
    }
    for (slot, likelihoods) in &observations.likelihoods {
        ln_weight.add(likelihoods[values[*slot] as usize].ln());
    }
    Ok(())
}

/// Draws the unobserved variables of a left-hand side, and returns the ln weight of the observed ones. `contexts` holds the
/// distributions of the instance, if its parents are finite.
pub(crate) fn draw_or_weigh(
    setting: &Setting<'_>,
    (instance, contexts): (&Instance, Option<&Contexts>),
    observations: &Observations,
    random: &mut Random,
    values: &mut [f64],
) -> Result<f64, Error> {
    let observed = |slot: &usize| !observations.values[*slot].is_nan();
    let is_weighed = instance.left.iter().all(observed);
    let distribution = match contexts {
        None if is_weighed => return setting.ln_density(instance, values),
        None => Cow::Owned(setting.distribution(instance, values)?),
        Some(contexts) => contexts.at(setting, instance, values)?,
    };
    if is_weighed {
        return Ok(distribution.ln_density(setting.left_value(instance, values)));
    }
    if let [_] = instance.left.as_slice() {
        return Ok(match distribution.draw(random) {
            Some(value) => {
                setting.put(instance, value, values);
                0.0
            }
            None => f64::NEG_INFINITY,
        });
    }
    let distribution = match distribution.into_owned() {
        Distribution::Wide(probabilities) => {
            Distribution::Finite(probabilities.iter().map(|p| p.to_f64()).collect())
        }
        other => other,
    };
    let (distribution, ln_weight) = match distribution {
        Distribution::Finite(mut probabilities) if instance.left.iter().any(observed) => {
            let mut other = values.to_vec();
            for (joint, probability) in probabilities.iter_mut().enumerate() {
                setting.put(instance, joint as f64, &mut other);
                let agrees = |slot: &usize| !observed(slot) || other[*slot] == observations.values[*slot];
                *probability *= f64::from(u8::from(instance.left.iter().all(agrees)));
            }
            let total: f64 = probabilities.iter().sum();
            (Distribution::Finite(probabilities), total.ln())
        }
        distribution => (distribution, 0.0),
    };
    match distribution.draw(random) {
        Some(value) => setting.put(instance, value, values),
        None => return Ok(f64::NEG_INFINITY),
    }
    Ok(ln_weight)
}

/// Y = (x − b) / a, where the Dirac is X = a Y + b; returns ln p(Y | parents) − ln |a|.
pub(crate) fn solve(
    setting: &Setting<'_>,
    instance: &Instance,
    dirac: &Instance,
    observations: &Observations,
    values: &mut [f64],
) -> Result<f64, Error> {
    let (slot, observed) = (instance.left[0], observations.values[dirac.left[0]]);
    let mut point = |value: f64| {
        values[slot] = value;
        setting.distribution(dirac, values).map(|dirac| dirac.only_value())
    };
    let (Some(constant), Some(sum)) = (point(0.0)?, point(1.0)?) else { return Ok(f64::NEG_INFINITY) };
    let slope = sum - constant;
    if slope == 0.0 {
        let (name, of) = (setting.slot_name(dirac.left[0]), setting.slot_name(slot));
        let message = format!("its `dirac` was to be solved for `{of}`, whose coefficient is 0 here");
        return Err(Error::input(name, message));
    }
    values[slot] = (observed - constant) / slope;
    Ok(setting.distribution(instance, values)?.ln_density(values[slot]) - slope.abs().ln())
}
