//! The variables on which a factor, an expression or a term depends.
//!
//! In: ids. Out: sets of variables. Invariant: a right-hand variable that a form does not use is not in its
//! scope: `P(G[j] | O C) = uniform` depends on G alone.

use super::{Binding, Solution, Term};
use crate::ids::{Arena, ExpressionId, FactorId, TermId, VariableId};
use crate::model::{Expression, Form, Model, VariableUse};
use std::collections::{BTreeMap, BTreeSet};

pub(crate) type Scope = BTreeSet<VariableId>;

/// The variables of an expression. A shared node, as of a `let`, is visited once.
pub(crate) fn of_expression(model: &Model, id: ExpressionId, scope: &mut Scope) {
    for node in model.nodes_below(id) {
        match &model.expressions[node] {
            Expression::Variable(VariableUse { variable, .. })
            | Expression::First { family: variable, .. } => {
                scope.insert(*variable);
            }
            _ => {}
        }
    }
}

/// The right-hand variables that a factor's form uses.
pub(crate) fn of_form(model: &Model, factor: FactorId) -> Scope {
    let mut scope = Scope::new();
    let right = &model.factors[factor].right;
    gather(model, &model.factors[factor].form, &mut scope);
    if has_table(&model.factors[factor].form) {
        scope.extend(right.iter().map(|use_| use_.variable));
    }
    scope.retain(|variable| right.iter().any(|use_| use_.variable == *variable));
    scope
}

fn has_table(form: &Form) -> bool {
    let mut found = matches!(form, Form::Table(_) | Form::Constants(_) | Form::Unknown(_));
    form.each_part(&mut |part| found |= has_table(part));
    found
}

fn gather(model: &Model, form: &Form, scope: &mut Scope) {
    form.each_expression(&mut |expression| of_expression(model, expression, scope));
    match form {
        Form::Previous { at, .. } => scope.extend(at),
        Form::Ask { given, .. } => scope.extend(given),
        _ => {}
    }
    form.each_part(&mut |part| gather(model, part, scope));
}

/// The variables of a factor: its left-hand ones, and the right-hand ones that it uses.
pub(crate) fn of_factor(model: &Model, factor: FactorId) -> Scope {
    let mut scope = of_form(model, factor);
    scope.extend(model.factors[factor].left.iter().map(|use_| use_.variable));
    scope
}

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
