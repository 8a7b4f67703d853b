//! Whether the carried variables are finite, so that sums over states answer exactly.
//!
//! In: a model and an ask over time. Out: the route, or the reason why sums do not answer. Invariant: the decision uses
//! only the program and the sizes written in it, before any number is known; every factor of an accepted model has a
//! potential.

use crate::analysis::{carried, is_proper, of_form, relevant_variables};
use crate::error::Error;
use crate::ids::VariableId;
use crate::model::{Ask, Form, Model};
use crate::strategies::over_time::{self, By, OverTime};
use crate::strategies::weighting::refused_factor;
use crate::strategies::{self, Route, Turn, refused};
use std::collections::BTreeSet;

/// The most states that carried families may have together.
const MOST_STATES: f64 = 4096.0;

/// The reason why a question is not answered by sums over finite states.
pub(crate) fn refusal(model: &Model, ask: &Ask, carried: &[(VariableId, VariableId)]) -> Option<String> {
    let name = |id: VariableId| model.variable_name(id);
    let searched = ask.searched.iter().map(|item| item.variable);
    let axes: BTreeSet<VariableId> = carried.iter().map(|(now, _)| *now).chain(searched).collect();
    if let Some(id) = axes.iter().find(|id| !model.variables[**id].domain.is_finite()) {
        return Some(format!("`{}` is not finite", name(*id)));
    }
    let mut states = 1.0;
    for id in axes.iter().filter(|id| model.variables[**id].family.is_some()) {
        states *= states_of(model, *id);
        if states > MOST_STATES {
            let name = name(*id);
            return Some(format!("the elements of `{name}` have more than {MOST_STATES} states together"));
        }
    }
    let known: Vec<VariableId> = ask.known.iter().map(|known| known.variable).collect();
    let mut rest: Vec<VariableId> = axes.iter().chain(&known).copied().collect();
    rest.extend(carried.iter().map(|(_, before)| *before));
    // A Dirac whose value may fall outside its domain constrains its parents even if nothing depends on it.
    let improper = model.factors.iter().filter(|(id, factor)| {
        model.variables[factor.left[0].variable].domain.is_finite() && !is_proper(model, *id)
    });
    rest.extend(improper.flat_map(|(_, factor)| factor.left.iter().map(|use_| use_.variable)));
    let mut wanted = BTreeSet::new();
    while let Some(id) = rest.pop() {
        let Some(factor) = model.factor_of(id).filter(|_| wanted.insert(id)) else { continue };
        rest.extend(of_form(model, factor));
        let form = &model.factors[factor].form;
        if let Some(why) = refused_factor(model, &model.factors[factor]) {
            return Some(why);
        }
        if model.variables[id].domain.is_finite() {
            continue;
        }
        match known.contains(&id) {
            true if form.has_point() => {
                return Some(format!("`{}` is observed, and has a `dirac` form", name(id)));
            }
            false if !is_dirac(form) => {
                return Some(format!("`{}` is real and would have to be integrated", name(id)));
            }
            _ => {}
        }
    }
    None
}

/// The strategy.
pub(crate) struct Engine;

impl strategies::Engine for Engine {
    fn offer(&self, model: &Model, asks: &[Ask], _: &Turn<'_>) -> Result<Route, Error> {
        let ask = &asks[0];
        over_time::check(model, ask)?;
        // A real that nothing asked or known depends on is not carried.
        let relevant = relevant_variables(model, asks);
        let is_needed = |(now, before): &(VariableId, VariableId)| {
            model.variables[*now].domain.is_finite() || relevant.contains(now) || relevant.contains(before)
        };
        let carried: Vec<(VariableId, VariableId)> = carried(model).into_iter().filter(is_needed).collect();
        if let Some(reason) = refusal(model, ask, &carried) {
            let is_real = model.variables.values().any(|variable| !variable.domain.is_finite());
            let rest = if is_real { ", and not everything is linear and Gaussian" } else { "" };
            return Err(refused(model, asks, &format!("{reason}{rest}")));
        }
        over_time::check_sequence(model, ask)?;
        Ok(Route::OverTime(OverTime { asks: asks.to_vec(), carried, by: By::Chain }))
    }
}

/// The number of joint states of all elements of a family.
fn states_of(model: &Model, id: VariableId) -> f64 {
    let variable = &model.variables[id];
    let count = variable.domain.count().map_or(f64::INFINITY, |count| count as f64);
    let elements = variable.family.and_then(|family| model.index_count(&family.over));
    elements.map_or(f64::INFINITY, |elements| count.powf(elements as f64))
}

/// Whether a form is a Dirac in all of its branches.
pub(crate) fn is_dirac(form: &Form) -> bool {
    match form {
        Form::Dirac(_) => true,
        Form::Initial { first, later } => is_dirac(first) && is_dirac(later),
        Form::If { then, otherwise, .. } => is_dirac(then) && is_dirac(otherwise),
        _ => false,
    }
}
