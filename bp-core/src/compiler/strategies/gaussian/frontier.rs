//! Conditioning of a long linear-Gaussian program: only the variables that are still needed are kept.
//!
//! In: a [`Gaussian`] plan of single numbers that carries nothing, numbers for its parameters, observations. Out: the
//! [`Belief`] that [`super::Filter`] gives, up to rounding. Invariant: variables enter parents first, are conditioned
//! as soon as they enter if they are observed, and leave after the last form that uses them: a chain of n variables
//! takes n steps and the memory of two.

use super::filter::{law_of, observe, observes_dirac};
use super::{Belief, Gaussian, NormalLaw};
use crate::error::Error;
use crate::ids::VariableId;
use crate::model::{Expression, LinearForm, Model};
use std::collections::{HashMap, HashSet};

/// The variables that are still needed, with their normal law.
struct Frontier {
    variables: Vec<VariableId>,
    places: HashMap<VariableId, usize>,
    law: NormalLaw,
}

impl Frontier {
    /// Adds a variable: Σ coefficient · variable + constant, and noise of its own.
    fn enter(&mut self, variable: VariableId, form: &LinearForm, deviation: f64) {
        let terms = form.coefficients.iter().map(|((id, _), coefficient)| (self.places[id], *coefficient));
        let terms: Vec<(usize, f64)> = terms.collect();
        self.places.insert(variable, self.law.len());
        self.variables.push(variable);
        self.law.extend(&terms, form.constant, deviation);
    }

    /// Removes a variable that is no longer needed.
    fn leave(&mut self, variable: VariableId) {
        let Some(place) = self.places.remove(&variable) else { return };
        self.variables.swap_remove(place);
        self.law.swap_remove(place);
        if let Some(moved) = self.variables.get(place) {
            self.places.insert(*moved, place);
        }
    }
}

/// The law of the searched variables, given the observations.
///
/// # Errors
/// A standard deviation that is not positive; a mean that is not finite; an observation that others exclude.
pub(crate) fn condition(
    model: &Model,
    plan: &Gaussian,
    parameter: &dyn Fn(&str) -> f64,
    observed: &HashMap<VariableId, f64>,
) -> Result<Belief, Error> {
    let searched: Vec<VariableId> =
        plan.asks.iter().flat_map(|ask| &ask.searched).map(|item| item.variable).collect();
    let kept: HashSet<VariableId> = searched.iter().copied().collect();
    // The source after which each variable leaves.
    let mut last: HashMap<VariableId, usize> = HashMap::new();
    for (position, source) in plan.sources.iter().enumerate() {
        last.insert(source.variable, position);
        for id in model.nodes_below(source.mean) {
            if let Expression::Variable(use_) = &model.expressions[id] {
                last.insert(use_.variable, position);
            }
        }
    }
    let mut leaving: Vec<Vec<VariableId>> = vec![Vec::new(); plan.sources.len()];
    for (variable, position) in last.into_iter().filter(|(variable, _)| !kept.contains(variable)) {
        leaving[position].push(variable);
    }
    let question = model.ask_text(&plan.asks[0]);
    let law = NormalLaw::new(observes_dirac(plan));
    let mut frontier = Frontier { variables: Vec::new(), places: HashMap::new(), law };
    let mut ln_evidence = 0.0;
    for (source, leaving) in plan.sources.iter().zip(&mut leaving) {
        let (form, deviation) = law_of(model, source, 0, parameter)?;
        frontier.enter(source.variable, &form, deviation);
        if let Some(value) = observed.get(&source.variable) {
            let (row, name) = (frontier.law.len() - 1, model.variable_name(source.variable));
            ln_evidence += observe(&mut frontier.law, row, *value, &name, &question)?;
        }
        // Sorted in the order of the model, so that repeated questions give the same bits.
        leaving.sort_unstable();
        leaving.iter().for_each(|variable| frontier.leave(*variable));
        // Reducing costs as much as many eliminations, so it is done only when the noises outnumber the variables by
        // far.
        if frontier.law.noises() > 2 * frontier.law.len() + 8 {
            frontier.law.reduce();
        }
    }
    let law = frontier.law.select(searched.iter().map(|variable| frontier.places[variable]));
    let variables = searched.iter().map(|variable| model.variable_name(*variable)).collect();
    Ok(Belief::of(variables, law, ln_evidence))
}
