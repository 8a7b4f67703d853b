//! Forms that are normal, or a Dirac, with a mean that is linear.
//!
//! In: a form, and the degree of each expression in some variables. Out: whether it is such a form. Invariant: the degree itself is
//! decided by `model/linear.rs`.

use super::scope::Scope;
use crate::ids::ExpressionId;
use crate::law::Law;
use crate::model::{Form, Model};

/// The forms that are admitted beside `normal` and `dirac`.
#[derive(Clone, Copy)]
pub(crate) struct Admitted {
    /// `flat`.
    pub(crate) flat: bool,
    /// A choice among admitted forms, whose condition does not contain the variables.
    pub(crate) choices: bool,
}

/// Whether a form has a linear mean, and a deviation that does not contain the variables.
pub(crate) fn is_linear_form(
    form: &Form,
    degree: &dyn Fn(ExpressionId) -> Option<u8>,
    admitted: Admitted,
) -> bool {
    let is_linear = |form: &Form| is_linear_form(form, degree, admitted);
    let is_free = |id: &ExpressionId| degree(*id) == Some(0);
    match form {
        Form::Law { law: Law::Normal, arguments } => degree(arguments[0]).is_some() && is_free(&arguments[1]),
        Form::NormalVector { mean, covariance } => {
            degree(*mean).is_some() && covariance.iter().flatten().all(is_free)
        }
        Form::Dirac(value) => degree(*value).is_some(),
        Form::Flat => admitted.flat,
        Form::If { condition, then, otherwise } => {
            admitted.choices && is_free(condition) && is_linear(then) && is_linear(otherwise)
        }
        Form::Initial { first, later } => is_linear(first) && is_linear(later),
        Form::Previous { at: None, otherwise, .. } => is_linear(otherwise),
        _ => false,
    }
}

/// Whether a form has a mean that is linear in these variables, and does not use them otherwise.
pub(crate) fn is_linear_in(model: &Model, form: &Form, linear: &Scope) -> bool {
    let degree = |id: ExpressionId| model.degree(id, &|variable| linear.contains(&variable));
    is_linear_form(form, &degree, Admitted { flat: false, choices: true })
}
