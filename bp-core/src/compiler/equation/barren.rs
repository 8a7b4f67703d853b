//! Removal of barren variables: Σ_X P(X | parents) = 1.
//!
//! In: a draft. Out: the draft without factors whose left-hand variables are free and appear nowhere else. Invariant:
//! only a factor that sums to one for every parent value is removed; an improper one (a Dirac that can fall outside its
//! domain, weights that may all be 0) stays, because it renormalises the rest.
//!
//! before: Σ_Roof P(Rain) P(Roof | Rain)      after: P(Rain)

use super::Term;
use super::draft::{Draft, are};
use super::scope;
use crate::analysis::{Scope, is_proper};
use crate::ids::VariableId;
use std::collections::{BTreeSet, HashMap};

pub(crate) fn remove(draft: &mut Draft<'_>) {
    if !draft.options.rewrites.barren {
        return;
    }
    let scope = |term: &_| scope::of_term(draft.model, &draft.terms, &draft.bindings, *term);
    let scopes: Vec<Scope> = draft.factors.iter().map(scope).collect();
    // The number of factors of each variable, and the factor that distributes it.
    let (mut uses, mut distributes) = (HashMap::new(), HashMap::new());
    for (position, scope) in scopes.iter().enumerate() {
        scope.iter().for_each(|variable| *uses.entry(*variable).or_insert(0) += 1);
        for variable in left(draft, position) {
            distributes.insert(variable, position);
        }
    }
    let (mut removed, mut gone) = (Vec::new(), BTreeSet::new());
    let mut candidates: BTreeSet<usize> = (0..draft.factors.len()).collect();
    while let Some(position) = candidates.pop_first() {
        let own = left(draft, position);
        let alone = |variable: &VariableId| {
            draft.free.contains(variable)
                && uses[variable] <= usize::from(scopes[position].contains(variable))
        };
        let proper = match draft.terms[draft.factors[position]] {
            Term::Factor(factor) => is_proper(draft.model, factor),
            _ => false,
        };
        if !proper || !own.iter().all(alone) {
            continue;
        }
        gone.insert(position);
        for variable in own {
            draft.free.remove(&variable);
            removed.push(draft.model.variable_name(variable));
        }
        // Its parents have one use less: they may be barren now.
        for variable in &scopes[position] {
            *uses.get_mut(variable).expect("internal: uses were counted") -= 1;
            candidates.extend(distributes.get(variable).filter(|position| !gone.contains(position)));
        }
    }
    let mut position = 0;
    draft.factors.retain(|_| {
        position += 1;
        !gone.contains(&(position - 1))
    });
    if !removed.is_empty() {
        let verb = if removed.len() == 1 { "sums" } else { "sum" };
        draft.record("barren variables", format!("{} in no other factor: each {verb} to 1", are(&removed)));
    }
}

/// The variables that a factor of the product distributes.
fn left(draft: &Draft<'_>, position: usize) -> Vec<VariableId> {
    match draft.terms[draft.factors[position]] {
        Term::Factor(factor) => draft.model.factors[factor].left.iter().map(|use_| use_.variable).collect(),
        _ => Vec::new(),
    }
}
