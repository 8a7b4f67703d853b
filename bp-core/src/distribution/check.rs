//! The numbers of a form, checked: the one place where a form refuses a number.
//!
//! In: a form with numbers where its right-hand variables have values. Out: the numbers, or an [`Error::Number`] that
//! names the form, the context and the number. Invariant: what passes is a distribution: probabilities lie in [0, 1] and
//! sum to one, weights are finite and not negative, parameters lie in the domain of their law.

use super::form::Evaluation;
use crate::error::Error;
use crate::exec::scalar::Scalar;
use crate::ids::ExpressionId;
use crate::law::{Constraint, Dirichlet, Law};
use crate::model::{Form, VariableUse, row_tolerance};
use crate::spelling::number as written;

/// The most elements of a family that a context names.
const MOST_NAMED: usize = 8;

impl Evaluation<'_> {
    /// An error about a number of this form, in this context.
    pub(super) fn refused(&self, form: &Form, message: String) -> Error {
        let model = self.scope.setting.model;
        let factor = &model.factors[self.instance.factor];
        Error::Number { form: model.form_text(factor, form), context: self.context(), message }
    }

    /// The values of the right-hand variables and of the indices: `X = 3, i = 2`.
    fn context(&self) -> String {
        let setting = self.scope.setting;
        let factor = &setting.model.factors[self.instance.factor];
        let mut words: Vec<String> = (factor.products.iter().zip(&self.instance.indices))
            .map(|((name, _), index)| format!("{name} = {index}"))
            .collect();
        for use_ in &factor.right {
            let slots = setting.slots_of(use_.variable);
            let whole = use_.element.is_none() && slots.len() > 1;
            let named = if whole { slots } else { self.slot(use_).map_or(0..0, |slot| slot..slot + 1) };
            let values = named.take(MOST_NAMED).map(|slot| (slot, self.scope.at(slot)));
            words.extend(values.filter(|(_, value)| !value.is_nan()).map(|(slot, value)| {
                let value = match setting.model.variables[use_.variable].domain.is_finite() {
                    true => setting.model.value_name(use_.variable, value as usize),
                    false => written(value),
                };
                format!("{} = {value}", setting.slot_name(slot))
            }));
        }
        words.join(", ")
    }

    /// The slot that a use of a variable, or of one element of a family, reads.
    fn slot(&self, use_: &VariableUse) -> Option<usize> {
        let setting = self.scope.setting;
        let element = match use_.element {
            None => 0,
            Some(element) => setting.element(use_.variable, self.scope.number(element))?,
        };
        let slots = setting.slots_of(use_.variable);
        Some(slots.start + element * setting.components(use_.variable)).filter(|slot| slots.contains(slot))
    }

    /// A probability. What lies outside [0, 1] by rounding is the nearer end.
    pub(super) fn probability(&self, form: &Form, number: f64) -> Result<f64, Error> {
        let nearest = number.clamp(0.0, 1.0);
        if (number - nearest).abs() <= row_tolerance(1) {
            return Ok(nearest);
        }
        Err(self.refused(form, must("the probability", number, "lie between 0 and 1")))
    }

    /// The probabilities of one row.
    pub(super) fn row(&self, form: &Form, numbers: Vec<f64>) -> Result<Vec<f64>, Error> {
        let what = if matches!(form, Form::Mixture(_)) { "weight" } else { "probability" };
        let tolerance = row_tolerance(numbers.len());
        let outside = |number: &f64| {
            let beyond = (number - number.clamp(0.0, 1.0)).abs();
            beyond.is_nan() || beyond > tolerance
        };
        if let Some(position) = numbers.iter().position(outside) {
            let what = format!("{what} {}", position + 1);
            return Err(self.refused(form, must(&what, numbers[position], "lie between 0 and 1")));
        }
        let sum: f64 = numbers.iter().sum();
        if (sum - 1.0).abs() > tolerance {
            let what =
                if what == "weight" { "the sum of the weights" } else { "the sum of the probabilities" };
            return Err(self.refused(form, must(what, sum, "be 1")));
        }
        Ok(numbers.into_iter().map(|number| number.clamp(0.0, 1.0)).collect())
    }

    /// Weights of values.
    pub(super) fn weights<T: Scalar>(&self, form: &Form, numbers: Vec<T>) -> Result<Vec<T>, Error> {
        match numbers.iter().position(|weight| !(*weight >= T::ZERO && weight.is_finite_number())) {
            None => Ok(numbers),
            Some(position) => {
                let slot = self.instance.left[0];
                let variable = self.left();
                let value = self.scope.setting.model.value_name(variable, position);
                let what = format!("the weight of {} = {value}", self.scope.setting.slot_name(slot));
                Err(self.refused(form, must(&what, numbers[position].to_f64(), "be finite and not negative")))
            }
        }
    }

    /// The parameters of a law.
    pub(super) fn parameters(
        &self,
        form: &Form,
        law: Law,
        arguments: &[ExpressionId],
    ) -> Result<[f64; 2], Error> {
        let mut parameters = [0.0; 2];
        parameters.iter_mut().zip(arguments).for_each(|(number, id)| *number = self.scope.number(*id));
        match law.refuses(super::law::exactly(law, &parameters)) {
            None => Ok(parameters),
            Some((position, expected)) => {
                let what = format!("the {}", law.parameters()[position].0);
                Err(self.refused(form, must(&what, parameters[position], &format!("be {expected}"))))
            }
        }
    }

    /// The parameters of a Dirichlet law.
    pub(super) fn dirichlet(&self, form: &Form, parameters: Vec<f64>) -> Result<Dirichlet, Error> {
        Dirichlet::new(parameters.clone()).map_err(|position| {
            let expected = Dirichlet::PARAMETER.refuses(parameters[position]).unwrap_or("greater than 0");
            let what = format!("parameter {}", position + 1);
            self.refused(form, must(&what, parameters[position], &format!("be {expected}")))
        })
    }

    /// The bounds of a truncated form, the lower one first.
    pub(super) fn bounds(&self, form: &Form, [low, high]: [f64; 2]) -> Result<[f64; 2], Error> {
        if low < high {
            return Ok([low, high]);
        }
        let expected = format!("be greater than the lower one, {}", written(low));
        Err(self.refused(form, must("the upper bound", high, &expected)))
    }

    /// A finite number.
    pub(super) fn finite(&self, form: &Form, number: f64) -> Result<f64, Error> {
        match Constraint::Real.refuses(number) {
            None => Ok(number),
            Some(expected) => Err(self.refused(form, must("the value", number, &format!("be {expected}")))),
        }
    }
}

fn must(what: &str, found: f64, expected: &str) -> String {
    format!("{what} is {}, but it must {expected}", written(found))
}
