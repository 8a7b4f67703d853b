//! The mean of a normal or Dirac form as a linear function of some slots.
//!
//! In: an instance of a factor, the values of the slots that are known, and which slots are linear. Out: a
//! [`LinearMean`]: the coefficient of each linear slot, the constant and the deviation. Invariant: coefficients are
//! computed from the expression, never as differences of values of the mean, so a large constant costs no digits.

use super::dual::Duals;
use super::form::Evaluation;
use super::number::{Scope, component};
use super::vector::rotated;
use super::{Distribution, Instance, Setting};
use crate::error::Error;
use crate::ids::ExpressionId;
use crate::law::{Law, Numbers};
use crate::model::{Expression, Folded, Form};
use crate::operators::{Binary, Unary};
use crate::spelling::number as written;

/// X = Σ coefficient · parent + constant + noise.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct LinearMean {
    /// (slot, coefficient)
    pub(crate) terms: Vec<(usize, f64)>,
    /// The mean where all linear parents are 0.
    pub(crate) constant: f64,
    /// The standard deviation of the noise; 0 for a Dirac.
    pub(crate) deviation: f64,
}

impl LinearMean {
    /// The mean at these values.
    pub(crate) fn at(&self, values: &[f64]) -> f64 {
        self.constant + self.terms.iter().map(|(slot, factor)| factor * values[*slot]).sum::<f64>()
    }
}

/// The coefficients of one component of a node, by slot.
type Coefficients = Vec<(usize, f64)>;

/// Whether variances of this size keep their digits: its square lies well within the range of f64.
pub(crate) fn has_square(deviation: f64) -> bool {
    (1e-150..=1e150).contains(&deviation)
}

/// The message about a deviation without a square.
pub(crate) fn no_square(deviation: f64) -> String {
    let found = written(deviation);
    format!(
        "the standard deviation is {found}, whose square is beyond the range of numbers; other units bring it between 1e-150 \
         and 1e150"
    )
}

impl Setting<'_> {
    /// The mean of an instance that is linear in some slots, and its deviation.
    ///
    /// # Errors
    /// As [`Setting::distribution`].
    pub(crate) fn linear_mean(
        &self,
        instance: &Instance,
        values: &[f64],
        linear: &[bool],
    ) -> Result<LinearMean, Error> {
        let at_zero: Vec<f64> =
            values.iter().zip(linear).map(|(value, linear)| if *linear { 0.0 } else { *value }).collect();
        self.linear_mean_at_zero(instance, &at_zero, linear)
    }

    /// As [`Setting::linear_mean`], where the linear slots have the value 0.
    ///
    /// # Errors
    /// As [`Setting::distribution`].
    pub(crate) fn linear_mean_at_zero(
        &self,
        instance: &Instance,
        at_zero: &[f64],
        linear: &[bool],
    ) -> Result<LinearMean, Error> {
        let (constant, deviation) = match self.distribution(instance, at_zero)? {
            Distribution::Law(Law::Normal, [mean, deviation, _]) if has_square(deviation) => {
                (mean, deviation)
            }
            Distribution::Law(Law::Normal, [_, deviation, _]) => {
                let known = at_zero.iter().zip(linear);
                let known: Vec<f64> =
                    known.map(|(value, linear)| if *linear { f64::NAN } else { *value }).collect();
                let evaluation = Evaluation { scope: self.scope(instance, &known), instance };
                let form = &self.model.factors[instance.factor].form;
                return Err(evaluation.refused(form, no_square(deviation)));
            }
            Distribution::Point(point) => (point, 0.0),
            _ => {
                let head = self.model.head(&self.model.factors[instance.factor]);
                return Err(Error::input(head, "it is neither normal nor a Dirac, so it has no linear mean"));
            }
        };
        let scope = self.scope(instance, at_zero);
        let mean = scope.mean(&self.model.factors[instance.factor].form);
        let (mean, covariance) = mean.expect("internal: a linear variable is normal or a Dirac");
        let mut terms = scope.coefficients(mean, linear);
        // Of a vector whose components are not independent: what the distances of the earlier ones from their means add.
        if let Some(covariance) = covariance {
            let known: Vec<usize> = (0..instance.component).collect();
            let covariance = self.covariance(covariance, |id| scope.with_component(0).number(id));
            let conditional = covariance.map(|found| found.conditional(&known, instance.component));
            let weights = conditional.map_or_else(|_| Vec::new(), |conditional| conditional.weights);
            for (component, weight) in weights.into_iter().enumerate() {
                let of = scope.with_component(component).coefficients(mean, linear);
                let slot = instance.left[0] - instance.component + component;
                terms = add(terms, scale(of, -weight));
                // The value of any other is in the constant.
                if linear[slot] {
                    terms = add(terms, vec![(slot, weight)]);
                }
            }
        }
        Ok(LinearMean { terms, constant, deviation })
    }

    /// An expression that is linear in some slots, whose values are 0: (slot, coefficient), and the constant.
    pub(crate) fn linear_form(
        &self,
        id: ExpressionId,
        instance: &Instance,
        at_zero: &[f64],
        linear: &[bool],
    ) -> (Vec<(usize, f64)>, f64) {
        let scope = self.scope(instance, at_zero);
        (scope.coefficients(id, linear), scope.number(id))
    }

    /// The tangent of the mean of a normal or Dirac form at these values, and the deviation there; `None` for any other form, and
    /// for vectors with a covariance matrix.
    ///
    /// # Errors
    /// As [`Setting::distribution`].
    pub(crate) fn tangent(&self, instance: &Instance, values: &[f64]) -> Result<Option<LinearMean>, Error> {
        let (mut constant, deviation) = match self.distribution(instance, values)? {
            Distribution::Law(Law::Normal, [mean, deviation, _]) => (mean, deviation),
            Distribution::Point(point) => (point, 0.0),
            _ => return Ok(None),
        };
        let scope = self.scope(instance, values);
        // A component of a vector with a covariance matrix depends on the others too.
        let Some((mean, None)) = scope.mean(&self.model.factors[instance.factor].form) else {
            return Ok(None);
        };
        let mut terms = Vec::new();
        for slot in self.reads(instance) {
            let slope = scope.number_by(mean, Duals { of: Some(slot) }).slope;
            if slope != 0.0 && !self.model.variables[self.variable_of(slot)].domain.is_finite() {
                constant -= slope * values[slot];
                terms.push((slot, slope));
            }
        }
        Ok(Some(LinearMean { terms, constant, deviation }))
    }
}

impl Scope<'_> {
    /// The expression of the mean that a normal or Dirac form has here, and its covariance matrix, if it has one.
    fn mean<'f>(&self, form: &'f Form) -> Option<(ExpressionId, Option<&'f [Vec<ExpressionId>]>)> {
        match form {
            Form::Law { law: Law::Normal, arguments } => Some((arguments[0], None)),
            Form::NormalVector { mean, covariance } => Some((*mean, Some(covariance))),
            Form::Dirac(value) => Some((*value, None)),
            Form::If { condition, then, otherwise } => {
                self.mean(if self.number(*condition) != 0.0 { then } else { otherwise })
            }
            Form::Previous { otherwise, .. } => self.mean(otherwise),
            Form::Initial { first, later } => {
                self.mean(if self.setting.first == Some(true) { first } else { later })
            }
            _ => None,
        }
    }

    /// The coefficients of an expression in the linear slots, whose values are 0 in this scope.
    fn coefficients(&self, id: ExpressionId, linear: &[bool]) -> Coefficients {
        let model = self.setting.model;
        let is_linear =
            |variable| self.setting.slots_of(variable).any(|slot| linear.get(slot).is_some_and(|it| *it));
        let degrees = model.degrees(id, &is_linear);
        let numbers = model.fold(id, |expression, below| self.components(expression, below, Numbers));
        let of = |id: ExpressionId, below: &Folded<Vec<Coefficients>>| match degrees.of(id) {
            Some(0) => Vec::new(),
            _ => below.of(id).clone(),
        };
        let number = |id: ExpressionId, at: usize| component(numbers.of(id), at);
        let node = |expression: &Expression, below: &Folded<Vec<Coefficients>>| match expression {
            Expression::Variable(use_) if is_linear(use_.variable) => {
                let count = self.setting.components(use_.variable);
                let slot = |at: usize| Some(vec![(self.with_component(at).slot(use_)?, 1.0)]);
                (0..count).map(|at| slot(at).unwrap_or_default()).collect()
            }
            Expression::Unary(Unary::Negate, operand) => times(of(*operand, below), &|_| -1.0),
            Expression::Binary(Binary::Add, left, right) => plus(of(*left, below), of(*right, below)),
            Expression::Binary(Binary::Subtract, left, right) => {
                plus(of(*left, below), times(of(*right, below), &|_| -1.0))
            }
            Expression::Binary(Binary::Multiply, left, right) if *degrees.of(*left) == Some(0) => {
                times(of(*right, below), &|at| number(*left, at))
            }
            Expression::Binary(Binary::Multiply, left, right) => {
                times(of(*left, below), &|at| number(*right, at))
            }
            Expression::Binary(Binary::Divide, left, right) => {
                times(of(*left, below), &|at| 1.0 / number(*right, at))
            }
            Expression::If { condition, then, otherwise } => {
                of(if number(*condition, 0) != 0.0 { *then } else { *otherwise }, below)
            }
            Expression::Vector(name, parts) if name == "vector" => {
                parts.iter().map(|part| of(*part, below).into_iter().next().unwrap_or_default()).collect()
            }
            Expression::Vector(name, parts) if name == "component" => {
                let at = number(parts[1], 0);
                let inside = at >= 0.0 && at.fract() == 0.0;
                vec![
                    inside
                        .then(|| of(parts[0], below).get(at as usize).cloned())
                        .flatten()
                        .unwrap_or_default(),
                ]
            }
            Expression::Vector(name, parts) if name == "rotate" => {
                let by = [0, 1, 2].map(|at| number(parts[1], at));
                let columns = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
                    .map(|axis| rotated(&mut Numbers, axis, by));
                let of = of(parts[0], below);
                let row = |row: usize| {
                    let scaled = of.iter().zip(columns);
                    scaled.fold(Vec::new(), |sum, (own, column)| add(sum, scale(own.clone(), column[row])))
                };
                (0..3).map(row).collect()
            }
            _ => Vec::new(),
        };
        let all = model.fold(id, node).root();
        let at = if all.len() == 1 { 0 } else { self.component };
        let own = all.into_iter().nth(at).unwrap_or_default();
        own.into_iter().filter(|(_, coefficient)| *coefficient != 0.0).collect()
    }
}

fn scale(mut of: Coefficients, factor: f64) -> Coefficients {
    of.iter_mut().for_each(|(_, coefficient)| *coefficient *= factor);
    of
}

fn add(mut one: Coefficients, other: Coefficients) -> Coefficients {
    for (slot, coefficient) in other {
        match one.iter_mut().find(|(own, _)| *own == slot) {
            Some((_, sum)) => *sum += coefficient,
            None => one.push((slot, coefficient)),
        }
    }
    one
}

fn times(of: Vec<Coefficients>, factor: &dyn Fn(usize) -> f64) -> Vec<Coefficients> {
    of.into_iter().enumerate().map(|(at, own)| scale(own, factor(at))).collect()
}

/// A number beside a vector is added to none of its components: only vectors of one length are added.
fn plus(one: Vec<Coefficients>, other: Vec<Coefficients>) -> Vec<Coefficients> {
    let count = one.len().max(other.len());
    let at = |all: &[Coefficients], at: usize| all.get(at).cloned().unwrap_or_default();
    (0..count).map(|place| add(at(&one, place), at(&other, place))).collect()
}
