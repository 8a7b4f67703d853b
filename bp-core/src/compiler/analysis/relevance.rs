//! The variables and factors that matter for a question.
//!
//! In: asks with the same known variables. Out: the searched and the known variables, those that may have no value
//! ([`may_have_no_value`]), and the ancestors of all these, with the factors that distribute them. Invariant: all other variables
//! are barren: the sum of their factors is one.

use super::proper::may_have_no_value;
use super::scope::of_form;
use crate::ids::{FactorId, Id, VariableId};
use crate::model::{Ask, Model};
use std::collections::BTreeSet;

/// Which of the numbers below `count` are reached from some of them; `read` appends the numbers that one reads.
pub(crate) fn reached(
    count: usize,
    from: impl IntoIterator<Item = usize>,
    mut read: impl FnMut(usize, &mut Vec<usize>),
) -> Vec<bool> {
    let mut found = vec![false; count];
    let mut rest: Vec<usize> = from.into_iter().collect();
    while let Some(one) = rest.pop() {
        if !std::mem::replace(&mut found[one], true) {
            read(one, &mut rest);
        }
    }
    found
}

/// The variables that a program carries from instant to instant: (X, X^-1).
pub(crate) fn carried(model: &Model) -> Vec<(VariableId, VariableId)> {
    model.variables.iter().filter_map(|(id, variable)| Some((variable.previous_of?, id))).collect()
}

/// The searched and the known variables of some asks, those that may have no value, and their ancestors, now and before.
pub(crate) fn relevant_variables(model: &Model, asks: &[Ask]) -> BTreeSet<VariableId> {
    let before = |id: VariableId| model.variables[id].previous_of;
    let found = ancestors(model, named(model, asks), before);
    model.variables.ids().filter(|id| found[id.position()]).collect()
}

/// The factors that distribute these variables, but for those before, in the order of the model.
pub(crate) fn relevant_factors(model: &Model, asks: &[Ask]) -> Vec<FactorId> {
    ancestral_factors(model, named(model, asks)).into_iter().collect()
}

/// The factors that distribute some variables and their ancestors.
pub(crate) fn ancestral_factors(
    model: &Model,
    variables: impl IntoIterator<Item = VariableId>,
) -> BTreeSet<FactorId> {
    let found = ancestors(model, variables, |_| None);
    model
        .distributions()
        .into_iter()
        .zip(found)
        .filter_map(|(factor, found)| factor.filter(|_| found))
        .collect()
}

/// The searched and the known variables, and those that may have no value.
fn named(model: &Model, asks: &[Ask]) -> impl Iterator<Item = VariableId> {
    let searched = asks.iter().flat_map(|ask| &ask.searched).map(|item| item.variable);
    let improper = model.factors.ids().filter(|id| may_have_no_value(model, *id));
    let improper = improper.flat_map(|id| &model.factors[id].left).map(|use_| use_.variable);
    searched.chain(asks[0].known.iter().map(|known| known.variable)).chain(improper)
}

fn ancestors(
    model: &Model,
    variables: impl IntoIterator<Item = VariableId>,
    more: impl Fn(VariableId) -> Option<VariableId>,
) -> Vec<bool> {
    let distributions = model.distributions();
    let ids: Vec<VariableId> = model.variables.ids().collect();
    reached(ids.len(), variables.into_iter().map(Id::position), |one, rest| {
        // A form may use fewer variables than its factor names.
        let read = distributions[one].into_iter().flat_map(|factor| of_form(model, factor));
        rest.extend(read.chain(more(ids[one])).map(Id::position));
    })
}
