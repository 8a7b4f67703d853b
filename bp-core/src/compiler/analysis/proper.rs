//! Factors that sum to one, and expressions that are true or false, by construction.
//!
//! In: a factor or an expression. Out: whether it is so. Invariant: a positive answer holds for all values of the parameters and of
//! the parents; a negative one may only mean that the structure does not show it.

use crate::ids::{ExpressionId, FactorId, VariableId};
use crate::law::{Law, Support};
use crate::model::{Domain, Expression, Folded, Form, Model};
use crate::operators::{Binary, Unary};

/// Whether a factor sums (or integrates) to one whatever its parents are.
pub(crate) fn is_proper(model: &Model, factor: FactorId) -> bool {
    let factor = &model.factors[factor];
    let Some(left) = factor.left.first() else { return false };
    proper_form(model, &factor.form, left.variable)
}

fn proper_form(model: &Model, form: &Form, left: VariableId) -> bool {
    let domain = &model.variables[left].domain;
    match form {
        Form::Dirac(value) => match domain {
            Domain::Boolean => is_truth(model, *value),
            Domain::Real | Domain::Vector(_) => true,
            _ => match (model.whole_bounds(*value), domain.whole_bounds()) {
                (Some([low, high]), Some([first, last])) => first <= low && high <= last,
                _ => false,
            },
        },
        // Over the plate's own set weights are not normalised. Where all weights are 0, no value is possible.
        Form::Weights(weight) => {
            !model.plate.is_some_and(|plate| *domain == Domain::Set(plate.set))
                && some_is_positive(model, *weight, left)
        }
        Form::Law { law, arguments } => {
            matches!(domain, Domain::Real) || has_value(model, *law, arguments, domain)
        }
        Form::Truncated { .. } => matches!(domain, Domain::Real),
        Form::Unknown(_) | Form::Flat | Form::HalfFlat => false,
        Form::Constants(numbers) => has_values(numbers, domain),
        // Before it is linked, the answer of another program is not known.
        Form::Ask { path, .. } => model
            .subroutine(path)
            .is_none_or(|subroutine| !subroutine.table.is_empty() && has_values(&subroutine.table, domain)),
        Form::Mixture(parts) => parts.iter().all(|(_, part)| proper_form(model, part, left)),
        // A carried marginal is a distribution, except in cells outside the grid, where `otherwise` holds.
        Form::Previous { otherwise, .. } => proper_form(model, otherwise, left),
        Form::Initial { first, later } => proper_form(model, first, left) && proper_form(model, later, left),
        Form::If { then, otherwise, .. } => {
            proper_form(model, then, left) && proper_form(model, otherwise, left)
        }
        _ => true,
    }
}

/// Whether each row of a table has a value: an impossible context has a row of zeros.
fn has_values(numbers: &[f64], domain: &Domain) -> bool {
    let rows = numbers.chunks_exact(domain.count().unwrap_or(1).max(1));
    rows.into_iter().all(|row| row.iter().any(|number| *number > 0.0))
}

/// Whether a domain of whole numbers has a value in the support of a law, whatever the parameters: outside of it a law cannot be
/// normalised.
fn has_value(model: &Model, law: Law, arguments: &[ExpressionId], domain: &Domain) -> bool {
    match (law.support(), domain.whole_bounds()) {
        (Support::Reals, _) => law != Law::Uniform,
        (Support::Positive, Some([_, last])) => last > 0.0,
        // Of a binomial distribution with probability 1 the number of trials is the only value.
        (Support::Counts, Some([first, last])) => {
            let fits = || model.whole_bounds(arguments[0]).is_some_and(|[_, trials]| trials <= last);
            first <= 0.0 && last >= 0.0 && (law != Law::Binomial || fits())
        }
        _ => false,
    }
}

/// Whether a factor may leave its finite variable without a value, which excludes values of its parents. Over a plate each
/// element has its own answer, and factors of other elements do not enter it.
pub(crate) fn may_have_no_value(model: &Model, id: FactorId) -> bool {
    let factor = &model.factors[id];
    let finite = factor.left.iter().all(|use_| model.variables[use_.variable].domain.is_finite());
    let is_unknown = matches!(factor.form, Form::Unknown(_));
    finite && !is_unknown && model.plate.is_none() && !is_proper(model, id)
}

/// Upper limit on the values for which a weight is computed.
const MOST_WEIGHTS: usize = 4096;

/// Whether a weight is positive for some value of the variable, whatever the other variables and the parameters are.
fn some_is_positive(model: &Model, weight: ExpressionId, left: VariableId) -> bool {
    let of = |expression: &Expression, below: &Folded<bool>| match expression {
        Expression::Number(number) => *number > 0.0,
        Expression::Unary(Unary::Exponential, _) => true,
        Expression::Binary(Binary::Multiply, one, other) => *below.of(*one) && *below.of(*other),
        Expression::If { then, otherwise, .. } => *below.of(*then) && *below.of(*otherwise),
        _ => false,
    };
    let domain = &model.variables[left].domain;
    let positive = |ordinal: usize| {
        let value = |id: VariableId| (id == left).then(|| domain.number(ordinal));
        model.evaluate(weight, &value).is_some_and(|weight| weight > 0.0)
    };
    model.fold(weight, of).root() || (0..domain.count().unwrap_or(0).min(MOST_WEIGHTS)).any(positive)
}

/// Whether an expression is true or false by construction.
pub(crate) fn is_truth(model: &Model, id: ExpressionId) -> bool {
    let of = |expression: &Expression, below: &Folded<bool>| match expression {
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
        Expression::If { then, otherwise, .. } => *below.of(*then) && *below.of(*otherwise),
        _ => false,
    };
    model.fold(id, of).root()
}
