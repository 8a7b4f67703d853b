//! The reals that are linear and Gaussian given all other variables, and so need not be drawn.
//!
//! In: a model. Out: variables, in the order of the model. Invariant: every form of theirs, and every form that uses
//! them, is normal or a Dirac with a mean linear in them; its coefficients, deviations and conditions may depend on the
//! others in any way. X and X^-1 are both among them, or neither.
//!
//! Doucet, de Freitas, Murphy and Russell, *Rao-Blackwellised particle filtering*, UAI 2000.

use crate::analysis::{Scope, is_linear_in, of_form};
use crate::ids::{FactorId, VariableId};
use crate::model::Model;

/// The variables that are linear and Gaussian given the others.
pub(crate) fn linear(model: &Model) -> Vec<VariableId> {
    let real =
        |id: &VariableId| !model.variables[*id].domain.is_finite() && model.variables[*id].family.is_none();
    let mut linear: Scope = model.variables.ids().filter(real).collect();
    while let Some(removed) = violator(model, &linear) {
        linear.remove(&removed);
    }
    linear.into_iter().collect()
}

/// A variable that must be removed from the set.
fn violator(model: &Model, linear: &Scope) -> Option<VariableId> {
    for (id, variable) in model.variables.iter() {
        if let Some(now) = variable.previous_of
            && linear.contains(&id) != linear.contains(&now)
        {
            return Some(if linear.contains(&id) { id } else { now });
        }
    }
    model.factors.ids().find_map(|id| of_factor(model, id, linear))
}

fn of_factor(model: &Model, id: FactorId, linear: &Scope) -> Option<VariableId> {
    let factor = &model.factors[id];
    let left = factor.left[0].variable;
    let used: Vec<VariableId> =
        of_form(model, id).into_iter().filter(|parent| linear.contains(parent)).collect();
    if !linear.contains(&left) || factor.left.len() > 1 {
        return used.first().copied().or(Some(left).filter(|left| linear.contains(left)));
    }
    if is_linear_in(model, &factor.form, linear) {
        return None;
    }
    // Where one parent breaks linearity, drawing that parent is enough.
    let enough = |parent: &VariableId| {
        let mut without = linear.clone();
        without.remove(parent);
        is_linear_in(model, &factor.form, &without)
    };
    used.into_iter().find(enough).or(Some(left))
}
