//! Validation of the numbers of a form.
//!
//! In: a form with numbers where its right-hand variables have values. Out: the numbers, or an [`Error::Number`] that
//! names the form, the context and the number. Invariant: accepted numbers make a distribution: probabilities lie in
//! [0, 1] and sum to one, weights are finite and not negative, parameters lie in the range of their law.

use super::form::Evaluation;
use super::number::Known;
use crate::error::Error;
use crate::exec::scalar::{Extended, Number, Scalar};
use crate::forms::{bernoulli, dirac, row, truncated, weights};
use crate::ids::ExpressionId;
use crate::law::{Arithmetic as _, Dirichlet, Law, Numbers, Parameters, Wide};
use crate::model::{Expression, Form, VariableUse};
use crate::operators::Binary;
use crate::spelling::number as written;

/// Upper limit on the elements of a family that a context names.
const MOST_NAMED: usize = 8;

impl Evaluation<'_> {
    /// An error about a number of this form, in this context.
    pub(super) fn refused(&self, form: &Form, message: String) -> Error {
        let model = self.scope.setting.model;
        let factor = &model.factors[self.instance.factor];
        let message = if message.contains("NaN") { self.outside(form).unwrap_or(message) } else { message };
        Error::Number { form: model.form_text(factor, form), context: self.context(), message }
    }

    /// The parameter that a form reads outside its range, if there is one.
    fn outside(&self, form: &Form) -> Option<String> {
        let setting = self.scope.setting;
        let products = &setting.model.factors[self.instance.factor].products;
        let outside = |id: ExpressionId| {
            let Expression::Parameter { parameter, indices } = &setting.model.expressions[id] else {
                return None;
            };
            let at: Vec<f64> = indices.iter().map(|index| self.scope.number(*index)).collect();
            let is_none = !at.is_empty() && setting.field(*parameter, &at).is_nan();
            let at: Vec<String> = at.into_iter().map(written).collect();
            let text = setting.model.expression_text(id, products);
            is_none.then(|| format!("`{text}` has no number at {}", at.join(", ")))
        };
        let mut found = None;
        form.each_expression(&mut |root| {
            found = found.take().or_else(|| setting.model.nodes_below(root).into_iter().find_map(outside));
        });
        found
    }

    /// The values of the right-hand variables and of the indices: `X = 3, i = 2`.
    fn context(&self) -> String {
        let setting = self.scope.setting;
        let factor = &setting.model.factors[self.instance.factor];
        let mut words: Vec<String> = (factor.products.iter().zip(&self.instance.indices))
            .map(|((name, _), index)| format!("{name} = {index}"))
            .collect();
        if let Some(index) = setting.model.plate_index() {
            let slot = setting.slots_of(index).start;
            let element = self.scope.at(slot);
            if !element.is_nan() && setting.reads(self.instance).contains(&slot) {
                words.push(format!("{} = {element}", setting.slot_name(slot)));
            }
        }
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

    /// The slot of a variable, or of the used element of a family.
    fn slot(&self, use_: &VariableUse) -> Option<usize> {
        let setting = self.scope.setting;
        let element = match use_.element {
            None => 0,
            Some(element) => setting.element(use_.variable, self.scope.number(element))?,
        };
        let slots = setting.slots_of(use_.variable);
        Some(slots.start + element * setting.components(use_.variable)).filter(|slot| slots.contains(slot))
    }

    /// A probability; rounding errors beyond [0, 1] are clamped.
    pub(super) fn probability(&self, form: &Form, id: ExpressionId) -> Result<Extended, Error> {
        let number = self.rounded(id);
        match bernoulli::holds(&mut Numbers, number, 0.0) != 0.0 {
            true => Ok(self.exactly(id, number)),
            false => Err(self.refused(form, must("the probability", number, "lie between 0 and 1"))),
        }
    }

    /// A number that is a probability, rounding errors beyond [0, 1] clamped.
    fn rounded(&self, id: ExpressionId) -> f64 {
        self.scope.setting.model.rounded(id, self.scope.number(id))
    }

    /// The probability that an expression is, with a separate exponent where f64 rounds it to 0 or to fewer digits.
    fn exactly(&self, id: ExpressionId, number: f64) -> Extended {
        match number.is_normal() {
            true => Extended::from_f64(number),
            false => Wide.binary(Binary::Maximum, self.scope.number_by(id, Wide), Extended::ZERO),
        }
    }

    /// The probabilities of one row, with separate exponents.
    pub(super) fn probabilities(
        &self,
        form: &Form,
        entries: &[ExpressionId],
    ) -> Result<Vec<Extended>, Error> {
        let numbers = self.row(form, entries)?;
        Ok(entries.iter().zip(numbers).map(|(id, number)| self.exactly(*id, number)).collect())
    }

    /// The probabilities of one row.
    pub(super) fn row(&self, form: &Form, entries: &[ExpressionId]) -> Result<Vec<f64>, Error> {
        let numbers: Vec<f64> = entries.iter().map(|id| self.rounded(*id)).collect();
        if row::holds(&mut Numbers, &numbers, |_| Some(0.0)) != 0.0 {
            return Ok(numbers);
        }
        let what = if matches!(form, Form::Mixture(_)) { "weight" } else { "probability" };
        let outside = |number: &f64| bernoulli::holds(&mut Numbers, *number, 0.0) == 0.0;
        let message = match numbers.iter().position(outside) {
            Some(position) => {
                let what = format!("{what} {}", position + 1);
                must(&what, numbers[position], "lie between 0 and 1")
            }
            None => {
                let all = if what == "weight" { "weights" } else { "probabilities" };
                must(&format!("the sum of the {all}"), numbers.iter().sum(), "be 1")
            }
        };
        Err(self.refused(form, message))
    }

    /// Weights of values.
    pub(super) fn weights<A: Known>(
        &self,
        form: &Form,
        numbers: Vec<A::Number>,
    ) -> Result<Vec<A::Number>, Error> {
        match numbers.iter().position(|weight| weights::holds(&mut A::default(), *weight).is_zero()) {
            None => Ok(numbers),
            Some(position) => {
                let slot = self.instance.left[0];
                let variable = self.left();
                let value = self.scope.setting.model.value_name(variable, position);
                let what = format!("the weight of {} = {value}", self.scope.setting.slot_name(slot));
                Err(self
                    .refused(form, must(&what, numbers[position].rounded(), "be finite and not negative")))
            }
        }
    }

    /// The parameters of a law.
    pub(super) fn parameters(
        &self,
        form: &Form,
        law: Law,
        arguments: &[ExpressionId],
    ) -> Result<Parameters, Error> {
        let mut parameters = Parameters::default();
        for ((number, id), (_, constraint)) in parameters.iter_mut().zip(arguments).zip(law.parameters()) {
            *number = if constraint.is_probability() { self.rounded(*id) } else { self.scope.number(*id) };
        }
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

    /// The bounds of a truncated form, checked to be in order.
    pub(super) fn bounds(&self, form: &Form, [low, high]: [f64; 2]) -> Result<[f64; 2], Error> {
        if truncated::holds(&mut Numbers, [low, high]) != 0.0 {
            return Ok([low, high]);
        }
        let expected = format!("be greater than the lower one, {}", written(low));
        Err(self.refused(form, must("the upper bound", high, &expected)))
    }

    /// The value of a Dirac, checked to be finite.
    pub(super) fn finite(&self, form: &Form, number: f64) -> Result<f64, Error> {
        match dirac::VALUE.refuses(number) {
            None => Ok(number),
            Some(expected) => Err(self.refused(form, must("the value", number, &format!("be {expected}")))),
        }
    }
}

pub(super) fn must(what: &str, found: f64, expected: &str) -> String {
    format!("{what} is {}, but it must {expected}", written(found))
}
