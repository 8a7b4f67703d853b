//! Forms that scale with a precision τ.
//!
//! In: a form, and τ. Out: whether its deviations are numbers over √τ. Invariant: τ occurs in the form nowhere else.

use crate::ids::{ExpressionId, VariableId};
use crate::law::Law;
use crate::model::{Expression, Folded, Form, Model};
use crate::operators::{Binary, Unary};

/// Whether a deviation of a form is a number over √τ.
pub(super) fn scales(model: &Model, form: &Form, unknown: VariableId) -> bool {
    match form {
        Form::Law { law: Law::Normal, arguments } => power(model, arguments[1], unknown) == Some(-0.5),
        Form::NormalVector { covariance, .. } => {
            covariance.iter().flatten().any(|entry| power(model, *entry, unknown) == Some(-1.0))
        }
        Form::If { then, otherwise, .. } => scales(model, then, unknown) || scales(model, otherwise, unknown),
        _ => false,
    }
}

/// Whether a form reads τ in its deviations only, each a number over √τ.
pub(super) fn is_scaled(model: &Model, form: &Form, unknown: VariableId) -> bool {
    let is_free = |id: ExpressionId| model.degree(id, &|variable| variable == unknown) == Some(0);
    match form {
        Form::Law { law: Law::Normal, arguments } => {
            is_free(arguments[0]) && power(model, arguments[1], unknown) == Some(-0.5)
        }
        Form::NormalVector { mean, covariance } => {
            let is_zero = |id: ExpressionId| model.constant(id) == Some(0.0);
            let fits = |id: &ExpressionId| is_zero(*id) || power(model, *id, unknown) == Some(-1.0);
            is_free(*mean) && covariance.iter().flatten().all(fits)
        }
        Form::Dirac(value) => is_free(*value),
        Form::Flat => true,
        Form::If { condition, then, otherwise } => {
            is_free(*condition) && is_scaled(model, then, unknown) && is_scaled(model, otherwise, unknown)
        }
        _ => false,
    }
}

/// The power p of an expression that is a number times τᵖ.
fn power(model: &Model, id: ExpressionId, unknown: VariableId) -> Option<f64> {
    let folded = model.fold(id, |expression, below: &Folded<Option<f64>>| {
        let of = |id: &ExpressionId| *below.of(*id);
        match expression {
            Expression::Variable(use_) => Some(f64::from(u8::from(use_.variable == unknown))),
            Expression::Number(_) | Expression::Parameter { .. } | Expression::Index(_) => Some(0.0),
            Expression::Unary(Unary::SquareRoot, operand) => Some(0.5 * of(operand)?),
            Expression::Unary(_, operand) => of(operand).filter(|power| *power == 0.0),
            Expression::Binary(Binary::Multiply, left, right) => Some(of(left)? + of(right)?),
            Expression::Binary(Binary::Divide, left, right) => Some(of(left)? - of(right)?),
            Expression::Binary(Binary::Power, base, exponent) => match (of(base)?, model.constant(*exponent))
            {
                (power, Some(exponent)) => Some(power * exponent),
                (power, None) => Some(power).filter(|power| *power == 0.0 && of(exponent) == Some(0.0)),
            },
            Expression::Binary(Binary::Add | Binary::Subtract, left, right) => {
                Some(of(left)?).filter(|power| Some(*power) == of(right))
            }
            Expression::Binary(_, left, right) => {
                Some(of(left)?).filter(|power| *power == 0.0 && of(right) == Some(0.0))
            }
            _ => None,
        }
    });
    *folded.of(id)
}
