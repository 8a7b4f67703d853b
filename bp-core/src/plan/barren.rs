//! Barren variables disappear: Σ_X P(X | parents) = 1.
//!
//! In: a draft. Out: the draft without factors whose left-hand variables are free and appear nowhere else.
//! Invariant: only a factor that sums to one for every parent value may go; an improper one (a Dirac that can
//! fall outside its domain) stays, because it renormalises the rest.
//!
//! before: Σ_Roof P(Rain) P(Roof | Rain)      after: P(Rain)

use super::draft::{Draft, are};
use super::{Term, scope};
use crate::ids::FactorId;
use crate::law::Law;
use crate::model::{Domain, Expression, Form, Model};

pub(super) fn remove(draft: &mut Draft<'_>) {
    if !draft.options.rewrites.barren {
        return;
    }
    let mut removed = Vec::new();
    while let Some(position) = (0..draft.factors.len()).find(|position| is_barren(draft, *position)) {
        let Term::Factor(factor) = draft.terms[draft.factors[position]] else { break };
        draft.factors.remove(position);
        for use_ in &draft.model.factors[factor].left {
            draft.free.retain(|free| *free != use_.variable);
            removed.push(draft.model.variable_name(use_.variable));
        }
    }
    if !removed.is_empty() {
        let verb = if removed.len() == 1 { "sums" } else { "sum" };
        draft.record(
            "barren variables",
            format!("{} on no other factor's right: each {verb} to 1", are(&removed)),
        );
    }
}

fn is_barren(draft: &Draft<'_>, position: usize) -> bool {
    let Term::Factor(factor) = draft.terms[draft.factors[position]] else { return false };
    let left = &draft.model.factors[factor].left;
    let elsewhere = |variable| {
        draft.factors.iter().enumerate().any(|(other, term)| {
            let terms = &draft.terms;
            other != position
                && scope::of_term(draft.model, terms, &draft.bindings, *term).contains(&variable)
        })
    };
    left.iter().all(|use_| draft.free.contains(&use_.variable) && !elsewhere(use_.variable))
        && is_proper(draft.model, factor)
}

/// Whether a factor sums (or integrates) to one whatever its parents are.
pub(super) fn is_proper(model: &Model, factor: FactorId) -> bool {
    let factor = &model.factors[factor];
    let Some(left) = factor.left.first() else { return false };
    proper_form(model, &factor.form, &model.variables[left.variable].domain)
}

fn proper_form(model: &Model, form: &Form, domain: &Domain) -> bool {
    match form {
        Form::Dirac(value) => match domain {
            Domain::Boolean => is_truth(model, *value),
            Domain::Real | Domain::Vector(_) => true,
            _ => false,
        },
        // Over the plate's own grid weights are left as they are.
        Form::Weights(_) => !matches!(domain, Domain::Set(_)),
        // Outside its support a law has nothing to normalise.
        Form::Law { law, .. } => matches!(domain, Domain::Real) || *law == Law::Normal,
        Form::Truncated { .. } => matches!(domain, Domain::Real),
        Form::Unknown(_) => false,
        Form::Mixture(parts) => parts.iter().all(|(_, part)| proper_form(model, part, domain)),
        // What was kept is a distribution, but for the cells outside the grid, where `otherwise` holds.
        Form::Previous { otherwise, .. } => proper_form(model, otherwise, domain),
        Form::If { then, otherwise, .. } => {
            proper_form(model, then, domain) && proper_form(model, otherwise, domain)
        }
        _ => true,
    }
}

/// Whether an expression is true or false by construction.
pub(super) fn is_truth(model: &Model, id: crate::ids::ExpressionId) -> bool {
    use crate::operators::{Binary, Unary};
    match &model.expressions[id] {
        Expression::Number(number) => *number == 0.0 || *number == 1.0,
        Expression::Variable(use_) => model.variables[use_.variable].domain == Domain::Boolean,
        Expression::Unary(Unary::Not, _) => true,
        Expression::Binary(operator, ..) => !matches!(
            operator,
            Binary::Add
                | Binary::Subtract
                | Binary::Multiply
                | Binary::Divide
                | Binary::Minimum
                | Binary::Maximum
                | Binary::Power
                | Binary::Remainder
                | Binary::ArcTangent
        ),
        Expression::If { then, otherwise, .. } => is_truth(model, *then) && is_truth(model, *otherwise),
        _ => false,
    }
}
