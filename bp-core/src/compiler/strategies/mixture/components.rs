//! The components of a mixture: one for each combination of values of the finite variables.
//!
//! In: a [`Mixture`], the setting and the observations. Out: [`Component`]s. Invariant: their order is that of the
//! values of the finite variables, parents first; weights are relative, as logarithms; impossible components are left out.

use super::Mixture;
use crate::analysis::{Scope, is_linear_in};
use crate::distribution::{Instance, LinearMean, LnTerms, Setting};
use crate::error::Error;
use crate::exec::scalar::Scalar;
use crate::sample::Observations;
use crate::strategies::gaussian::SlotLaw;
use rayon::prelude::*;
use std::collections::BTreeSet;

/// One combination of values of the finite variables.
#[derive(Clone, Debug)]
pub(super) struct Component {
    /// ln P(values, observations)
    pub(super) ln_weight: LnTerms,
    /// The values of the finite slots.
    pub(super) values: Vec<f64>,
    /// How many observations a Dirac determined: they have a probability, not a density.
    points: usize,
    /// The normal distribution of the reals.
    pub(super) law: SlotLaw,
}

/// The components of positive weight.
///
/// # Errors
/// A number that a form cannot have.
pub(super) fn components(
    setting: &Setting<'_>,
    route: &Mixture,
    observations: &Observations,
) -> Result<Vec<Component>, Error> {
    let mut linear = vec![false; setting.slots()];
    route.linear.iter().for_each(|variable| linear[setting.slots_of(*variable)].fill(true));
    let is_real = linear.clone();
    let numbers = route.numbers.iter().flat_map(|variable| setting.slots_of(*variable));
    numbers.filter(|slot| !observations.values[*slot].is_nan()).for_each(|slot| linear[slot] = false);
    let values = (observations.values.iter().zip(&linear))
        .map(|(value, linear)| if *linear { f64::NAN } else { *value })
        .collect();
    let mut all =
        vec![Component { ln_weight: LnTerms::default(), values, points: 0, law: SlotLaw::new(true) }];
    // Of a known real that forms may read in any way, elements and components may be missing.
    let numbers = route.numbers.iter().flat_map(|variable| setting.slots_of(*variable));
    let missing: Vec<usize> = numbers.filter(|slot| observations.values[*slot].is_nan()).collect();
    for instance in setting.in_order(&route.factors)? {
        without_missing(setting, &instance, &missing)?;
        let is_weighed = route.weighed.contains(&instance.factor);
        let step = |component: Component| match is_real[instance.left[0]] {
            true if is_weighed => weighed(setting, &instance, observations, component),
            true => extended(setting, &instance, &linear, observations, component),
            false => branched(setting, &instance, observations, component),
        };
        let branches: Vec<Vec<Component>> = all.into_par_iter().map(step).collect::<Result<_, Error>>()?;
        all = branches.into_iter().flatten().collect();
    }
    // A value that has a probability in some components has the density 0 beside it in the others.
    let points = all.iter().map(|component| component.points).max();
    all.retain(|component| Some(component.points) == points);
    Ok(all)
}

/// Refuses a form that reads a missing value in a way that is not linear.
fn without_missing(setting: &Setting<'_>, instance: &Instance, missing: &[usize]) -> Result<(), Error> {
    let reads = if missing.is_empty() { BTreeSet::new() } else { setting.reads(instance) };
    let Some(slot) = missing.iter().find(|slot| reads.contains(slot) && !instance.left.contains(slot)) else {
        return Ok(());
    };
    let factor = &setting.model.factors[instance.factor];
    let scope: Scope = missing.iter().map(|slot| setting.variable_of(*slot)).collect();
    let is_finite = setting.model.variables[factor.left[0].variable].domain.is_finite();
    if !is_finite && factor.left.len() == 1 && is_linear_in(setting.model, &factor.form, &scope) {
        return Ok(());
    }
    let (name, head) = (setting.slot_name(*slot), setting.model.head(factor));
    let reason = format!("`{name}` is not observed, and `{head}` depends on it");
    Err(Error::Unplanned { question: setting.model.name.clone(), reason })
}

/// A component with one real more.
fn extended(
    setting: &Setting<'_>,
    instance: &Instance,
    linear: &[bool],
    observations: &Observations,
    mut component: Component,
) -> Result<Vec<Component>, Error> {
    let slot = instance.left[0];
    let LinearMean { terms, constant, deviation } =
        setting.linear_mean(instance, &component.values, linear)?;
    component.law.extend(slot, &terms, constant, deviation);
    let observed = observations.values[slot];
    if !observed.is_nan() {
        let noises = component.law.noises();
        let Some(ln) = component.law.observed(slot, observed) else { return Ok(Vec::new()) };
        component.ln_weight.add(ln);
        component.points += usize::from(component.law.noises() == noises);
    }
    Ok(vec![component])
}

/// A component with the density of a known real.
fn weighed(
    setting: &Setting<'_>,
    instance: &Instance,
    observations: &Observations,
    mut component: Component,
) -> Result<Vec<Component>, Error> {
    let slot = instance.left[0];
    // An element of which the data have no value, and which nothing reads.
    if observations.values[slot].is_nan() {
        return Ok(vec![component]);
    }
    component.ln_weight.add(setting.ln_density(instance, &component.values)?);
    Ok(if component.ln_weight.is_nothing() { Vec::new() } else { vec![component] })
}

/// A component for each value that a finite left-hand side may have.
fn branched(
    setting: &Setting<'_>,
    instance: &Instance,
    observations: &Observations,
    component: Component,
) -> Result<Vec<Component>, Error> {
    let probabilities = setting.distribution(instance, &component.values)?.extended().unwrap_or_default();
    let ln = probabilities.iter().map(|p| p.natural_logarithm().to_f64());
    let mut branches = Vec::new();
    for (ordinal, ln) in ln.enumerate().filter(|(_, ln)| *ln > f64::NEG_INFINITY) {
        let mut values = component.values.clone();
        setting.put(instance, ordinal as f64, &mut values);
        let observed = |slot: &usize| {
            let observed = observations.values[*slot];
            observed.is_nan() || observed == values[*slot]
        };
        if !instance.left.iter().all(observed) {
            continue;
        }
        let weighted = observations.likelihoods.iter().filter(|(slot, _)| instance.left.contains(slot));
        let virtual_: f64 = weighted.map(|(slot, weights)| weights[values[*slot] as usize].ln()).sum();
        let mut ln_weight = component.ln_weight;
        [ln, virtual_].into_iter().for_each(|term| ln_weight.add(term));
        if virtual_ > f64::NEG_INFINITY {
            branches.push(Component { ln_weight, values, law: component.law.clone(), ..component });
        }
    }
    Ok(branches)
}
