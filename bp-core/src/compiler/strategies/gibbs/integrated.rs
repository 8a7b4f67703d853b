//! The reals that a Markov chain need not draw: given the others they are linear and Gaussian.
//!
//! In: a model, its relevant factors, the variables that are observed. Out: variables, in the order of the model. Invariant: every
//! form of theirs, and every form that reads them and matters for the observations, is normal or a Dirac with a mean that is linear
//! in them, or flat; coefficients, deviations and conditions may depend on the others in any way.

use crate::analysis::{Scope, ancestral_factors, is_linear_in, may_have_no_value, of_form};
use crate::ids::{FactorId, VariableId};
use crate::model::{Form, Model};
use crate::strategies::weighting::Treatment;

/// The variables that are linear and Gaussian given the others; `known` are those with observations.
pub(crate) fn integrated(
    model: &Model,
    steps: &[(FactorId, Treatment)],
    observed: &[VariableId],
    known: &[VariableId],
) -> Vec<VariableId> {
    let constrains = |(factor, _): &&(FactorId, Treatment)| !may_follow(model, *factor);
    let constrained = steps.iter().filter(constrains).flat_map(|(factor, _)| left(model, *factor));
    let factors = ancestral_factors(model, known.iter().copied().chain(constrained));
    let mut tied = Scope::new();
    for (factor, treatment) in steps {
        if let Treatment::Solved(dirac) = treatment {
            tied.extend(of_form(model, *dirac));
            tied.extend(of_form(model, *factor));
        }
    }
    let may_be = |id: &VariableId| {
        let variable = &model.variables[*id];
        !variable.domain.is_finite() && !observed.contains(id) && !tied.contains(id)
    };
    let mut scope: Scope = factors.iter().flat_map(|factor| left(model, *factor)).filter(may_be).collect();
    while let Some(removed) = factors.iter().find_map(|factor| violator(model, *factor, observed, &scope)) {
        scope.remove(&removed);
    }
    // A Dirac alone integrates nothing.
    let has_noise =
        |id: &VariableId| model.factor_of(*id).is_some_and(|own| !model.factors[own].form.has_point());
    if scope.iter().any(has_noise) { scope.into_iter().collect() } else { Vec::new() }
}

/// Whether a factor says nothing of its parents as long as its left-hand side is not observed.
pub(super) fn may_follow(model: &Model, factor: FactorId) -> bool {
    !may_have_no_value(model, factor)
}

fn left(model: &Model, factor: FactorId) -> impl Iterator<Item = VariableId> {
    model.factors[factor].left.iter().map(|use_| use_.variable)
}

/// A variable that must be removed from the set for the sake of a factor.
fn violator(model: &Model, id: FactorId, observed: &[VariableId], scope: &Scope) -> Option<VariableId> {
    let factor = &model.factors[id];
    let left = factor.left[0].variable;
    let is_own = scope.contains(&left);
    let used: Vec<VariableId> =
        of_form(model, id).into_iter().filter(|parent| scope.contains(parent)).collect();
    if used.is_empty() && (!is_own || matches!(factor.form, Form::Flat)) {
        return None;
    }
    let own = || is_own.then_some(left);
    let is_single = factor.left.len() == 1 && !model.variables[left].domain.is_finite();
    let is_plain = !factor.form.has_point() || matches!(factor.form, Form::Dirac(_)) && is_own;
    if !is_single || !is_plain || chooses_labels(model, id, observed) {
        return used.first().copied().or_else(own);
    }
    if is_linear_in(model, &factor.form, scope) {
        return None;
    }
    // Where one parent breaks linearity, drawing that parent is enough.
    let enough = |parent: &VariableId| {
        let mut without = scope.clone();
        without.remove(parent);
        is_linear_in(model, &factor.form, &without)
    };
    used.iter().copied().find(enough).or_else(own).or(used.first().copied())
}

/// Whether each element of a family depends on a hidden finite element of its own: as labels of mixtures do, which are independent
/// given the reals, but not where the reals are integrated out.
pub(crate) fn chooses_labels(model: &Model, id: FactorId, observed: &[VariableId]) -> bool {
    let is_label = |variable: &VariableId| {
        let of = &model.variables[*variable];
        of.domain.is_finite() && of.family.is_some() && !observed.contains(variable)
    };
    !model.factors[id].products.is_empty() && of_form(model, id).iter().any(is_label)
}
