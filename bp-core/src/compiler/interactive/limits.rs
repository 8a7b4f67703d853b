//! Limits of parameters: the numbers that a control accepts.
//!
//! In: a program and factors of it. Out: what a parameter must be, by its kind and by the forms that take it as it stands.
//! Invariant: a number outside the limits is refused by every strategy; one within may still be refused by a form that
//! computes with it.

use crate::ids::{ExpressionId, FactorId, ParameterId};
use crate::law::{Constraint, Dirichlet};
use crate::model::{Expression, Form, Model, ParameterKind};
use serde::Serialize;

/// What a number must be.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Limit {
    /// The least number.
    pub least: Option<f64>,
    /// Whether that number is excluded.
    pub is_open: bool,
    /// The largest number.
    pub most: Option<f64>,
    /// The same in words.
    pub expected: &'static str,
}

/// What a parameter must be.
pub(super) fn limits(model: &Model, factors: &[FactorId], parameter: ParameterId) -> Vec<Limit> {
    let kind = model.parameters[parameter].kind;
    let most = match kind {
        ParameterKind::Probability => Some(Some(1.0)),
        ParameterKind::Element(_) => Some(None),
        ParameterKind::Real | ParameterKind::Integer | ParameterKind::Size => None,
    };
    let of_kind = most.and_then(|most| {
        let expected = kind.refuses(f64::NAN)?;
        Some(Limit { least: Some(0.0), is_open: false, most, expected })
    });
    let mut found: Vec<Limit> = of_kind.into_iter().collect();
    for id in factors {
        demands(&model.factors[*id].form, &mut |expression, constraint| {
            let limit = of_constraint(constraint).filter(|_| takes(model, expression, parameter));
            // Of equal limits one is told.
            let is_new = |limit: &Limit| {
                let bounds = |one: &Limit| (one.least, one.is_open, one.most);
                found.iter().all(|known| bounds(known) != bounds(limit))
            };
            found.extend(limit.filter(is_new));
        });
    }
    found
}

fn of_constraint(constraint: Constraint) -> Option<Limit> {
    let (is_open, most) = match constraint {
        Constraint::Real => return None,
        Constraint::Positive => (true, None),
        Constraint::Probability => (false, Some(1.0)),
        Constraint::PositiveProbability => (true, Some(1.0)),
        Constraint::Count => (false, None),
    };
    Some(Limit { least: Some(0.0), is_open, most, expected: constraint.refuses(f64::NAN)? })
}

/// Calls `visit` with the numbers that a form takes at any value of its variables, and what is demanded of them.
fn demands(form: &Form, visit: &mut dyn FnMut(ExpressionId, Constraint)) {
    match form {
        Form::Bernoulli(probability, _) => visit(*probability, Constraint::Probability),
        Form::Categorical(entries) => entries.iter().for_each(|entry| visit(*entry, Constraint::Probability)),
        Form::Law { law, arguments } => {
            arguments
                .iter()
                .zip(law.parameters())
                .for_each(|(argument, (_, constraint))| visit(*argument, *constraint));
        }
        Form::NormalBins { deviation, .. } => visit(*deviation, Constraint::Positive),
        Form::Dirichlet(parameters) => parameters.iter().for_each(|one| visit(*one, Dirichlet::PARAMETER)),
        Form::Truncated { form, .. } | Form::Ordered(form) => demands(form, visit),
        Form::Initial { first, later } => [first, later].into_iter().for_each(|form| demands(form, visit)),
        Form::Mixture(parts) => parts.iter().for_each(|(weight, part)| {
            visit(*weight, Constraint::Probability);
            demands(part, visit);
        }),
        _ => {}
    }
}

/// Whether an expression is a parameter, or a choice by variables of which it is a branch.
fn takes(model: &Model, expression: ExpressionId, parameter: ParameterId) -> bool {
    let is_parameter = |id: &ExpressionId| matches!(model.expressions[*id], Expression::Parameter { .. });
    let mut rest = vec![expression];
    while let Some(id) = rest.pop() {
        match &model.expressions[id] {
            Expression::Parameter { parameter: own, indices } if indices.is_empty() && *own == parameter => {
                return true;
            }
            Expression::If { condition, then, otherwise }
                if !model.nodes_below(*condition).iter().any(is_parameter) =>
            {
                rest.extend([*then, *otherwise]);
            }
            _ => {}
        }
    }
    false
}
