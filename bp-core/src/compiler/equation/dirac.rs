//! Substitution of Diracs.
//!
//! In: a draft. Out: the draft in which a summed variable is replaced by the expression of its Dirac. Invariant: a
//! value outside the variable's domain has probability 0: if that is possible, an indicator stays.
//!
//! before: Σ_A P(V | A) P(C | V A)      with P(C | V A) = dirac(A + V), C known
//! after:  P(V | C − V)                 the sum over antecedents is a gather

use super::draft::Draft;
use super::{Binding, Term, elision};
use crate::analysis::{is_truth, of_form};
use crate::ids::{ExpressionId, FactorId, TermId, VariableId};
use crate::model::{DerivedKind, Domain, Expression, Form, Model, SetKind};
use crate::operators::Binary;
use std::collections::HashSet;

/// Number of substitutions with a line of the derivation each; the others share one, since each line contains all
/// factors.
const MOST_LINES: usize = 16;

pub(super) fn substitute(draft: &mut Draft<'_>) {
    if !draft.options.rewrites.dirac {
        return;
    }
    // A solved variable makes no other variable solvable, so one pass over the factors finds all.
    let (mut next, mut substituted) = (0, 0);
    let mut reasons = Vec::new();
    let mut left_out = HashSet::new();
    while let Some(term) = draft.factors.get(next).copied() {
        let position = next;
        next += 1;
        let Some((variable, binding)) = solve(draft, term) else { continue };
        let name = draft.model.variable_name(variable);
        let domain = &draft.model.variables[variable].domain;
        let always_inside = match &binding {
            Binding::Expression(value) => {
                matches!(domain, Domain::Real)
                    || (*domain == Domain::Boolean && is_truth(draft.model, *value))
            }
            _ => true,
        };
        let reason = match &binding {
            Binding::Antecedent { cell, displacement } => format!(
                "one antecedent for each displacement: {name} = {} − {}",
                draft.model.variable_name(*cell),
                draft.model.variable_name(*displacement)
            ),
            Binding::Expression(value) => format!("{name} = {}", draft.model.expression_text(*value, &[])),
            Binding::Value(_) | Binding::Solved(_) => name,
        };
        draft.bindings.insert(variable, binding);
        draft.free.remove(&variable);
        match always_inside {
            true => drop(left_out.insert(position)),
            false => draft.factors[position] = draft.terms.push(Term::Inside(variable)),
        }
        substituted += 1;
        if substituted <= MOST_LINES {
            remove(draft, &mut left_out, &mut next);
            draft.record("Dirac substitution", reason);
        } else {
            reasons.push(reason);
        }
    }
    if !reasons.is_empty() {
        remove(draft, &mut left_out, &mut next);
        let others = |count| format!("… ({} more)", elision::grouped(count));
        let reasons = elision::list(reasons.len(), |at| reasons[at].clone(), others);
        draft.record("Dirac substitution", reasons.join("; "));
    }
}

/// Removes factors from the product.
fn remove(draft: &mut Draft<'_>, left_out: &mut HashSet<usize>, next: &mut usize) {
    let mut position = 0;
    draft.factors.retain(|_| {
        position += 1;
        !left_out.contains(&(position - 1))
    });
    *next -= left_out.len();
    left_out.clear();
}

fn solve(draft: &Draft<'_>, term: TermId) -> Option<(VariableId, Binding)> {
    let Term::Factor(factor) = draft.terms[term] else { return None };
    let Form::Dirac(value) = draft.model.factors[factor].form else { return None };
    let [left] = draft.model.factors[factor].left.as_slice() else { return None };
    let variable = &draft.model.variables[left.variable];
    // A part stays a variable: it has fewer values than its operands have combinations.
    if variable.family.is_some() || variable.derived == Some(DerivedKind::Part) {
        return None;
    }
    let cells = matches!(draft.model.variables[left.variable].domain, Domain::Set(_));
    if draft.free.contains(&left.variable) && !cells {
        return Some((left.variable, Binding::Expression(value)));
    }
    let (antecedent, displacement) = displaced(draft.model, factor, value)?;
    let known = draft.is_known(left.variable) || draft.searched.contains(&left.variable);
    let free = draft.free.contains(&antecedent);
    (known && free).then_some((antecedent, Binding::Antecedent { cell: left.variable, displacement }))
}

/// `A + V`, a cell plus a displacement.
fn displaced(model: &Model, factor: FactorId, value: ExpressionId) -> Option<(VariableId, VariableId)> {
    let Expression::Binary(Binary::Add, left, right) = model.expressions[value] else { return None };
    let variable = |id| match &model.expressions[id] {
        Expression::Variable(use_) if use_.element.is_none() => Some(use_.variable),
        _ => None,
    };
    let (left, right) = (variable(left)?, variable(right)?);
    let moves = |id: VariableId| match model.variables[id].domain {
        Domain::Set(set) => matches!(model.sets[set].kind, SetKind::Displacements(_)),
        _ => false,
    };
    let used = of_form(model, factor);
    debug_assert!(used.contains(&left) && used.contains(&right), "internal: a form uses its variables");
    match (moves(left), moves(right)) {
        (false, true) => Some((left, right)),
        (true, false) => Some((right, left)),
        _ => None,
    }
}
