//! The variables on which a term depends.
//!
//! In: a term. Out: a set of variables. Invariant: a bound variable is replaced by those that its binding reads.

use super::{Binding, Solution, Term};
use crate::analysis::{Scope, of_expression, of_factor, of_form};
use crate::ids::{Arena, TermId, VariableId};
use crate::model::Model;
use std::collections::BTreeMap;

/// The variables of a term, with bindings substituted.
pub(crate) fn of_term(
    model: &Model,
    terms: &Arena<TermId, Term>,
    bindings: &BTreeMap<VariableId, Binding>,
    id: TermId,
) -> Scope {
    let mut scope = Scope::new();
    let rest = |id| of_term(model, terms, bindings, id);
    match &terms[id] {
        Term::Joint => scope.extend(model.variables.ids()),
        Term::Factor(factor) | Term::Possible(factor) => scope = of_factor(model, *factor),
        Term::Likelihood(variable, _) | Term::Inside(variable) => {
            scope.insert(*variable);
        }
        Term::Product(factors) => factors.iter().for_each(|factor| scope.extend(rest(*factor))),
        Term::Sum(over, body) => {
            scope = rest(*body);
            scope.retain(|variable| !over.contains(variable));
        }
        Term::Normalise(_, body) => scope = rest(*body),
        Term::At(variable, body) => {
            scope = rest(*body);
            scope.insert(*variable);
        }
        Term::FirstScan(scan) => {
            scope = of_factor(model, scan.factor);
            scope.extend(of_form(model, scan.prior));
            scope.remove(&scan.family);
        }
    }
    resolve(model, bindings, scope)
}

/// Replaces bound variables by the variables that they depend on.
fn resolve(model: &Model, bindings: &BTreeMap<VariableId, Binding>, scope: Scope) -> Scope {
    let (mut resolved, mut seen) = (Scope::new(), Scope::new());
    let mut rest: Vec<VariableId> = scope.into_iter().collect();
    while let Some(variable) = rest.pop() {
        if !seen.insert(variable) {
            continue;
        }
        match bindings.get(&variable) {
            None => {
                resolved.insert(variable);
            }
            Some(Binding::Value(_)) => {}
            Some(Binding::Antecedent { cell, displacement }) => rest.extend([*cell, *displacement]),
            Some(Binding::Solved(Solution { of, rest: operands, .. })) => {
                let mut inner = Scope::from([*of]);
                operands.iter().for_each(|(_, operand)| of_expression(model, *operand, &mut inner));
                rest.extend(inner);
            }
            Some(Binding::Expression(expression)) => {
                let mut inner = Scope::new();
                of_expression(model, *expression, &mut inner);
                rest.extend(inner);
            }
        }
    }
    resolved
}
