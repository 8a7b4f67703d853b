//! The variables on which a factor or an expression depends.
//!
//! In: ids. Out: sets of variables. Invariant: a right-hand variable that a form does not use is not in its
//! scope: `P(G[j] | O C) = uniform` depends on G alone.

use crate::ids::{ExpressionId, FactorId, VariableId};
use crate::model::{Expression, Form, Model, VariableUse};
use std::collections::BTreeSet;

/// Some variables.
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
