//! Elimination: sums are pushed inwards, in the cheapest order found.
//!
//! In: a draft. Out: nested sums of products. Invariant: each variable is summed over exactly the factors that depend
//! on it.
//!
//! before: Σ_V Σ_O⁻¹ P(V | …) P(O⁻¹ | …) P(O | O⁻¹)      after: Σ_V P(V | …) (Σ_O⁻¹ P(O⁻¹ | …) P(O | O⁻¹))
//!
//! The order is found by `elimination`.

use super::draft::Draft;
use super::{Cost, Elimination, Term, draft::are, order, scope, solve};
use crate::analysis::Scope;
use crate::error::Error;
use crate::ids::{TermId, VariableId};
use crate::model::{Domain, IndexSpace, Model, VariableUse};

/// The count for an unknown size.
pub(super) const UNKNOWN_SIZE: f64 = 16.0;

pub(super) fn order(draft: &mut Draft<'_>) -> Result<(), Error> {
    for variable in &draft.free {
        summable(draft, *variable)?;
    }
    let free = std::mem::take(&mut draft.free);
    if free.is_empty() {
        return Ok(());
    }
    if !draft.options.rewrites.order {
        let body = draft.terms.push(Term::Product(draft.factors.clone()));
        draft.factors = vec![draft.terms.push(Term::Sum(free.into_iter().collect(), body))];
        return Ok(());
    }
    let scope = |term: &TermId| scope::of_term(draft.model, &draft.terms, &draft.bindings, *term);
    let scopes: Vec<_> = draft.factors.iter().map(scope).collect();
    let solved: Vec<Scope> = draft.factors.iter().map(|term| solve::by(draft, *term)).collect();
    let sums = order::sums(draft.model, &scopes, &free, &solved);
    let names: Vec<_> = sums.iter().map(|sum| draft.model.variable_name(sum.variable)).collect();
    // The factors not yet under a sum: those of the draft, then the sums.
    let mut factors: Vec<Option<TermId>> = draft.factors.iter().copied().map(Some).collect();
    for sum in sums {
        let taken = sum.inside.iter().map(|position| factors[*position].take());
        let inside: Vec<TermId> =
            taken.map(|term| term.expect("internal: a factor is summed once")).collect();
        let multiplications = sum.weight * inside.len().saturating_sub(1) as f64;
        let body = match inside.as_slice() {
            [one] => *one,
            _ => draft.terms.push(Term::Product(inside)),
        };
        factors.push(Some(draft.terms.push(Term::Sum(vec![sum.variable], body))));
        let entries = sum.weight / size(draft.model, sum.variable);
        let index = draft.model.plate_index();
        let cost = Cost {
            table: sum.table.into_iter().filter(|id| Some(*id) != index).collect(),
            entries,
            multiplications,
            additions: sum.weight - entries,
        };
        draft.eliminations.push(Elimination { variable: sum.variable, cost });
        draft.cost += sum.weight;
    }
    draft.factors = factors.into_iter().flatten().collect();
    let reason =
        format!("{} summed as early as possible, about {:.0} products in all", are(&names), draft.cost);
    draft.record("order of sums", reason);
    Ok(())
}

pub(super) fn size(model: &Model, variable: VariableId) -> f64 {
    let variable = &model.variables[variable];
    let one = variable.domain.count().map_or(UNKNOWN_SIZE, |count| count as f64);
    match &variable.family {
        None => one,
        Some(family) => one.powf(model.index_count(&family.over).map_or(UNKNOWN_SIZE, |count| count as f64)),
    }
}

/// Whether a variable is finite.
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
            let of = |use_: &VariableUse| use_.variable == variable;
            let element = draft.model.variables.iter().find(|(id, other)| {
                let factor = draft.model.factor_of(*id).map(|id| &draft.model.factors[id]);
                other.derived.is_some() && factor.is_some_and(|factor| factor.right.iter().any(of))
            });
            if let (Some((_, element)), Some(_)) = (element, draft.model.plate) {
                return Err(draft.unplanned(format!(
                    "over a plate the elements of `{name}` are known together, not `{}` alone: know `{name}`",
                    element.name
                )));
            }
            Err(draft.unplanned(format!(
                "the family `{name}` would have to be enumerated, but its length ({over}) is not known; \
                 only a chain whose first true element matters is summed at any length"
            )))
        }
        _ => Ok(()),
    }
}
