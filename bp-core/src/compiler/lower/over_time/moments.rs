//! The moments of forms, and the expressions in them, at the means so far.
//!
//! In: a normal or Dirac form. Out: the mean of each component with its slopes, and the covariances of its noise. Invariant: the
//! semantics of expressions are those of `model/evaluate.rs`; a vector is evaluated component by component.

use super::Phase;
use super::normal::{Build, Moments};
use super::rotation::{cross, norm, rotated};
use super::tangent::{Place, Slopes, Tangents};
use crate::error::Error;
use crate::ids::{ExpressionId, ParameterId, ValueId, VariableId};
use crate::law::{Arithmetic, Constraint, Law};
use crate::model::{Environment, Expression, Folded, Form, Read, VariableUse};
use crate::operators::Binary;
use std::collections::{BTreeMap, BTreeSet};

impl Build<'_> {
    /// The moments of a form at the means so far.
    pub(super) fn moments(&mut self, form: &Form, count: usize) -> Result<Moments, Error> {
        match form {
            Form::Dirac(value) => Ok(Moments { means: self.expression(*value)?, noise: BTreeMap::new() }),
            Form::Law { law: Law::Normal, arguments } => {
                let (means, deviations) = (self.expression(arguments[0])?, self.expression(arguments[1])?);
                let mut noise = BTreeMap::new();
                for component in 0..count {
                    let deviation = self.tangents.value(component_of(&deviations, component));
                    let variance = self.variance(deviation);
                    noise.insert((component, component), variance);
                }
                Ok(Moments { means, noise })
            }
            Form::NormalVector { mean, covariance } => {
                let (means, mut noise) = (self.expression(*mean)?, BTreeMap::new());
                for (row, entries) in covariance.iter().enumerate() {
                    for (column, entry) in entries.iter().enumerate().take(row + 1) {
                        let entry = self.expression(*entry)?;
                        noise.insert((column, row), self.tangents.value(component_of(&entry, 0)));
                    }
                }
                Ok(Moments { means, noise })
            }
            Form::Initial { first, .. } if self.step.phase == Phase::First => self.moments(first, count),
            Form::Initial { later, .. } => self.moments(later, count),
            Form::Previous { at: None, otherwise, .. } => self.moments(otherwise, count),
            Form::If { condition, then, otherwise } => {
                let condition = self.expression(*condition)?;
                let condition = component_of(&condition, 0);
                let (then, otherwise) = (self.moments(then, count)?, self.moments(otherwise, count)?);
                match self.tangents.known(condition) {
                    Some(known) => Ok(if known != 0.0 { then } else { otherwise }),
                    None => Ok(self.chosen(condition, &then, &otherwise)),
                }
            }
            form => {
                let name = form.name();
                Err(self.refused(format!("`{name}` is neither `normal` nor `dirac`")))
            }
        }
    }

    /// The moments of one form or another.
    fn chosen(&mut self, condition: Place, then: &Moments, otherwise: &Moments) -> Moments {
        let count = then.means.len().max(otherwise.means.len());
        let means = (0..count)
            .map(|at| {
                let [then, otherwise] = [then, otherwise].map(|one| component_of(&one.means, at));
                self.tangents.select(condition, then, otherwise)
            })
            .collect();
        let condition = self.tangents.value(condition);
        let zero = self.tangents.builder.constant(0.0);
        let pairs: BTreeSet<(usize, usize)> =
            then.noise.keys().chain(otherwise.noise.keys()).copied().collect();
        let of = |one: &Moments, pair| one.noise.get(&pair).copied().unwrap_or(zero);
        let mut noise = BTreeMap::new();
        for pair in pairs {
            let value = self.tangents.builder.select(condition, of(then, pair), of(otherwise, pair));
            noise.insert(pair, value);
        }
        Moments { means, noise }
    }

    /// The square of a deviation; NaN where that is not above 0.
    fn variance(&mut self, deviation: ValueId) -> ValueId {
        let by = &mut self.tangents.builder;
        let holds = Constraint::Positive.holds(by, deviation);
        let nothing = by.constant(f64::NAN);
        let deviation = by.select(holds, deviation, nothing);
        by.binary(Binary::Multiply, deviation, deviation)
    }

    /// The components of an expression at the means so far, with their slopes.
    pub(super) fn expression(&mut self, id: ExpressionId) -> Result<Vec<Place>, Error> {
        let (model, mut fault) = (self.model(), None);
        let nothing = self.tangents.constant(f64::NAN);
        let all = model.fold(id, |expression, below: &Folded<Vec<Place>>| {
            if fault.is_some() {
                return vec![nothing];
            }
            self.components(expression, below).unwrap_or_else(|error| {
                fault = Some(error);
                vec![nothing]
            })
        });
        fault.map_or_else(|| Ok(all.root()), Err)
    }

    fn components(
        &mut self,
        expression: &Expression,
        below: &Folded<Vec<Place>>,
    ) -> Result<Vec<Place>, Error> {
        let three = |id: &ExpressionId| [0, 1, 2].map(|at| component_of(below.of(*id), at));
        let count = match expression {
            Expression::Vector(name, parts) => {
                return match (name.as_str(), parts.as_slice()) {
                    ("vector", parts) => {
                        Ok(parts.iter().map(|part| component_of(below.of(*part), 0)).collect())
                    }
                    ("component", [vector, at]) => {
                        let at = self.tangents.known(component_of(below.of(*at), 0));
                        let at = at.and_then(|at| below.of(*vector).get(at as usize));
                        let at =
                            at.copied().ok_or_else(|| self.refused("a component is named by a variable"))?;
                        Ok(vec![at])
                    }
                    ("rotate", [vector, turn]) => {
                        Ok(rotated(&mut self.tangents, three(vector), three(turn)).to_vec())
                    }
                    ("cross", [one, other]) => {
                        Ok(cross(&mut self.tangents, three(one), three(other)).to_vec())
                    }
                    ("norm", [vector]) => Ok(vec![norm(&mut self.tangents, below.of(*vector))]),
                    (name, _) => Err(self.refused(format!("`{name}` has no kernel"))),
                };
            }
            Expression::Variable(use_) => self.model().components(use_.variable),
            Expression::Unary(_, operand) => below.of(*operand).len(),
            Expression::Binary(_, left, right) => below.of(*left).len().max(below.of(*right).len()),
            Expression::If { then, otherwise, .. } => below.of(*then).len().max(below.of(*otherwise).len()),
            _ => 1,
        };
        (0..count).map(|component| Reader { build: self, below, component }.value(expression)).collect()
    }
}

/// A component of a vector; a number is the same at every component.
pub(super) fn component_of(all: &[Place], at: usize) -> Place {
    all[if all.len() == 1 { 0 } else { at }]
}

/// An expression at one component.
struct Reader<'r, 'm> {
    build: &'r mut Build<'m>,
    below: &'r Folded<Vec<Place>>,
    component: usize,
}

impl Environment for Reader<'_, '_> {
    type By = Tangents;
    type Stop = Error;

    fn by(&mut self) -> &mut Tangents {
        &mut self.build.tangents
    }

    fn operand(&mut self, id: ExpressionId) -> Read<Self> {
        Ok(component_of(self.below.of(id), self.component))
    }

    fn scalar(&mut self, id: ExpressionId) -> Read<Self> {
        Ok(component_of(self.below.of(id), 0))
    }

    fn parameter(&mut self, parameter: ParameterId, indices: &[ExpressionId]) -> Read<Self> {
        self.build.lend();
        let value = self.build.lowering.parameter(parameter, indices);
        self.build.lend();
        Ok(self.build.tangents.fixed(value?))
    }

    fn variable(&mut self, use_: &VariableUse) -> Read<Self> {
        let component = if self.build.model().components(use_.variable) == 1 { 0 } else { self.component };
        let slot = self.build.slot(use_, component)?;
        let mean = self.build.law.means.get(&slot).copied();
        let mean = mean.ok_or_else(|| self.build.refused("a variable is used before it is distributed"))?;
        let one = self.build.tangents.builder.constant(1.0);
        Ok(self.build.tangents.put(mean, Slopes::from([(slot, one)])))
    }

    fn index(&mut self, depth: usize) -> Read<Self> {
        let index = self.build.lowering.products[depth];
        Ok(self.build.tangents.fixed(index))
    }

    fn first(&mut self, _: VariableId, _: Option<(ExpressionId, ExpressionId)>) -> Read<Self> {
        Err(self.build.refused("`first` is of booleans"))
    }

    fn other(&mut self, _: &Expression) -> Read<Self> {
        Err(self.build.refused("this expression has no kernel"))
    }
}
