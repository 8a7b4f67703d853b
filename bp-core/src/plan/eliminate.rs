//! Sums are pushed inwards, in the cheapest order found.
//!
//! In: a draft. Out: the draft with nothing left to be summed: nested sums of products. Invariant: each variable
//! is summed over exactly the factors that depend on it.
//!
//! before: Σ_V Σ_O⁻¹ P(V | …) P(O⁻¹ | …) P(O | O⁻¹)      after: Σ_V P(V | …) (Σ_O⁻¹ P(O⁻¹ | …) P(O | O⁻¹))
//!
//! The order is greedy: next goes the variable whose sum makes the smallest table (min-weight).

use super::draft::Draft;
use super::scope::{self, Scope};
use super::{Term, draft::are};
use crate::error::Error;
use crate::ids::VariableId;
use crate::model::{Domain, IndexSpace, Model};

/// What a size that is not known counts for.
const UNKNOWN_SIZE: f64 = 16.0;

pub(super) fn order(draft: &mut Draft<'_>) -> Result<(), Error> {
    for variable in &draft.free {
        summable(draft, *variable)?;
    }
    let mut names = Vec::new();
    if !draft.options.rewrites.order && !draft.free.is_empty() {
        let all = std::mem::take(&mut draft.free);
        let body = draft.terms.push(Term::Product(draft.factors.clone()));
        draft.factors = vec![draft.terms.push(Term::Sum(all, body))];
        return Ok(());
    }
    while let Some((variable, weight)) = cheapest(draft) {
        names.push(draft.model.variable_name(variable));
        draft.free.retain(|free| *free != variable);
        draft.cost += weight;
        let depends = |term: &_| of(draft, *term).contains(&variable);
        let (inside, outside): (Vec<_>, Vec<_>) = draft.factors.iter().copied().partition(depends);
        let body = match inside.as_slice() {
            [one] => *one,
            _ => draft.terms.push(Term::Product(inside)),
        };
        draft.factors = outside;
        let sum = draft.terms.push(Term::Sum(vec![variable], body));
        draft.factors.push(sum);
    }
    if !names.is_empty() {
        let reason =
            format!("{} summed as early as can be, about {:.0} products in all", are(&names), draft.cost);
        draft.record("order of sums", reason);
    }
    Ok(())
}

fn of(draft: &Draft<'_>, term: crate::ids::TermId) -> Scope {
    scope::of_term(draft.model, &draft.terms, &draft.bindings, term)
}

fn cheapest(draft: &Draft<'_>) -> Option<(VariableId, f64)> {
    let scopes: Vec<Scope> = draft.factors.iter().map(|term| of(draft, *term)).collect();
    let weigh = |variable: &VariableId| {
        let mut joined = Scope::from([*variable]);
        scopes.iter().filter(|scope| scope.contains(variable)).for_each(|scope| joined.extend(scope));
        let sizes = joined.iter().filter(|variable| Some(**variable) != draft.model.plate_index());
        (*variable, sizes.map(|variable| size(draft.model, *variable)).product::<f64>())
    };
    draft.free.iter().map(weigh).min_by(|left, right| left.1.total_cmp(&right.1))
}

fn size(model: &Model, variable: VariableId) -> f64 {
    let variable = &model.variables[variable];
    let one = variable.domain.count().map_or(UNKNOWN_SIZE, |count| count as f64);
    match &variable.family {
        None => one,
        Some(family) => one.powf(model.index_count(&family.over).map_or(UNKNOWN_SIZE, |count| count as f64)),
    }
}

/// Whether all values of a variable can be run through.
pub(super) fn summable(draft: &Draft<'_>, variable: VariableId) -> Result<(), Error> {
    let name = draft.model.variable_name(variable);
    let declared = &draft.model.variables[variable];
    if matches!(declared.domain, Domain::Real | Domain::Vector(_)) {
        let reason = format!(
            "`{name}` is real and would have to be integrated, and not everything is linear and Gaussian"
        );
        return Err(draft.unplanned(reason));
    }
    match &declared.family {
        Some(family) if draft.model.index_count(&family.over).is_none() => {
            let over = match family.over {
                IndexSpace::Set(set) => draft.model.sets[set].name.clone(),
                IndexSpace::Range(_) => draft.model.domain_text(&Domain::Finite {
                    labels: Vec::new(),
                    range: match family.over {
                        IndexSpace::Range(range) => Some(range),
                        IndexSpace::Set(_) => None,
                    },
                }),
            };
            Err(draft.unplanned(format!(
                "the family `{name}` would have to be enumerated, but its length ({over}) is not known; \
                 only a chain whose first true element matters is summed at any length"
            )))
        }
        _ => Ok(()),
    }
}
