//! Reals that finite variables determine: their values have probabilities.
//!
//! In: a variable. Out: whether it has a value for each combination of values of finite variables. Invariant: it is decided by the
//! forms alone, for all numbers of the program.

use super::{Form, Model};
use crate::ids::VariableId;
use std::collections::HashSet;

impl Model {
    /// Whether finite variables, and those that are known, determine a real: it is computed from them, or is one of them.
    pub(crate) fn is_determined(&self, variable: VariableId, is_known: &dyn Fn(VariableId) -> bool) -> bool {
        let (mut open, mut seen) = (vec![variable], HashSet::from([variable]));
        while let Some(id) = open.pop() {
            if self.variables[id].domain.is_finite() || id != variable && is_known(id) {
                continue;
            }
            let Some(factor) = self.factor_of(id).map(|id| &self.factors[id]) else { return false };
            if factor.left.len() > 1 || !is_point(&factor.form) {
                return false;
            }
            open.extend(factor.right.iter().map(|use_| use_.variable).filter(|id| seen.insert(*id)));
        }
        true
    }
}

/// Whether a form is a point in each case.
fn is_point(form: &Form) -> bool {
    match form {
        Form::Dirac(_) => true,
        Form::If { then, otherwise, .. } => is_point(then) && is_point(otherwise),
        _ => false,
    }
}
