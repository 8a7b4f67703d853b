//! Whether Markov chains are preferred to weighted draws.
//!
//! In: a sampled route. Out: the preference. Invariant: it depends on the program and the question alone.

use super::offer::{MANY, Sampled, Treatment};
use crate::analysis::of_form;
use crate::ids::{FactorId, VariableId};
use crate::model::Model;
use std::collections::BTreeSet;

/// Whether a variable is a family of many elements, or of a number that is given at run time, as rows are.
pub(super) fn is_long(model: &Model, id: VariableId) -> bool {
    let over = model.variables[id].family.as_ref().map(|family| model.index_count(&family.over));
    over.is_some_and(|count| count.is_none_or(|count| count > MANY))
}

/// Whether a real on which others depend is drawn.
pub(super) fn moves_reals(model: &Model, steps: &[(FactorId, Treatment)]) -> bool {
    let parents: BTreeSet<VariableId> = steps.iter().flat_map(|(id, _)| of_form(model, *id)).collect();
    let drawn = steps.iter().filter(|(_, treatment)| *treatment == Treatment::Drawn);
    let mut left = drawn.flat_map(|(id, _)| &model.factors[*id].left).map(|use_| use_.variable);
    left.any(|id| parents.contains(&id) && !model.variables[id].domain.is_finite())
}

impl Sampled {
    /// Whether chains are preferred to weighted draws: where these are `refused`; where there are many observations, with which few
    /// draws of the prior agree, and chains integrate reals out or sum over the labels of a family; and wherever a long family or many
    /// variables are observed beside hidden reals. Draws of a conjugate posterior need no chains.
    pub(crate) fn is_preferred(&self, refused: bool) -> bool {
        let marginalises = self.labels || !self.integrated.is_empty();
        refused || self.conjugate.is_none() && (self.many && marginalises || self.long)
    }
}
