//! Linearity of expressions in some variables, and their coefficients.
//!
//! In: an expression, and the variables in question or the numbers of parameters. Out: its degree, or a [`LinearForm`].
//! Invariant: degrees 0 and 1 hold for all values of the other variables. Only this module decides linearity.

use super::{Domain, Expression, Folded, Model, VariableUse};
use crate::ids::{ExpressionId, ParameterId, VariableId};
use crate::operators::{Binary, Unary};
use std::collections::BTreeMap;

impl Model {
    /// The degree of an expression in some variables: 0, 1, or `None` where it is not linear in them.
    pub fn degree(&self, id: ExpressionId, wanted: &impl Fn(VariableId) -> bool) -> Option<u8> {
        self.degrees(id, wanted).root()
    }

    /// The degree of each node of an expression in some variables.
    pub fn degrees(&self, id: ExpressionId, wanted: &impl Fn(VariableId) -> bool) -> Folded<Option<u8>> {
        self.fold(id, |expression, below| degree_of(expression, below, wanted))
    }

    /// The number of components of a variable's value.
    pub fn components(&self, variable: VariableId) -> usize {
        match self.variables[variable].domain {
            Domain::Vector(length) => length,
            _ => 1,
        }
    }
}

/// The degree of a node, given those of its operands: 0 if it contains none of the variables.
fn degree_of(
    expression: &Expression,
    below: &Folded<Option<u8>>,
    wanted: &impl Fn(VariableId) -> bool,
) -> Option<u8> {
    let of = |id: ExpressionId| *below.of(id);
    match expression {
        Expression::Variable(use_) => Some(u8::from(wanted(use_.variable))),
        Expression::Unary(Unary::Negate, operand) => of(*operand),
        Expression::Binary(Binary::Add | Binary::Subtract, left, right) => Some(of(*left)?.max(of(*right)?)),
        Expression::Binary(Binary::Multiply, left, right) => {
            Some(of(*left)? + of(*right)?).filter(|degree| *degree <= 1)
        }
        Expression::Binary(Binary::Divide, left, right) => (of(*right)? == 0).then_some(of(*left)?),
        Expression::If { condition, then, otherwise } => {
            (of(*condition)? == 0).then_some(of(*then)?.max(of(*otherwise)?))
        }
        Expression::Vector(name, parts) if name == "vector" => {
            parts.iter().try_fold(0, |most, part| Some(of(*part)?.max(most)))
        }
        // Which component it is must not depend on the variables.
        Expression::Vector(name, parts) if name == "component" => {
            (of(parts[1])? == 0).then_some(of(parts[0])?)
        }
        // A rotation is linear in the vector that it rotates.
        Expression::Vector(name, parts) if name == "rotate" => (of(parts[1])? == 0).then_some(of(parts[0])?),
        Expression::First { family, .. } if wanted(*family) => None,
        _ => {
            let mut without = true;
            expression.each_operand(&mut |operand| without &= of(operand) == Some(0));
            without.then_some(0)
        }
    }
}

/// The readings of the leaves of a linear expression.
pub trait Leaves {
    /// A parameter; of a field, its element at these indices.
    fn parameter(&self, parameter: ParameterId, indices: &[f64]) -> f64;
    /// The number of a variable in a [`LinearForm`]: of one component, and of the element of a family at an index; `None` where
    /// the family has no such element.
    fn variable(&self, use_: &VariableUse, index: Option<f64>, component: usize) -> Option<usize>;
    /// The index of the enclosing `prod` at this depth.
    fn index(&self, depth: usize) -> f64;
}

/// A linear form: Σ coefficient · variable + constant.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct LinearForm {
    /// Coefficients, by the numbers of variables ([`Leaves::variable`]).
    pub coefficients: BTreeMap<usize, f64>,
    /// Constant.
    pub constant: f64,
}

impl LinearForm {
    /// The linear form that an expression, or one component of a vector, is where its leaves read so.
    pub fn of(model: &Model, id: ExpressionId, component: usize, leaves: &dyn Leaves) -> Self {
        // A component of a sum of vectors is the sum of the components; of a vector it is one number.
        let mut id = id;
        while let Expression::Vector(name, parts) = &model.expressions[id]
            && name == "vector"
            && component < parts.len()
        {
            id = parts[component];
        }
        let of = |expression: &Expression, below: &Folded<Self>| {
            Self::of_node(model, expression, below, component, leaves)
        };
        model.fold(id, of).root()
    }

    fn of_node(
        model: &Model,
        expression: &Expression,
        below: &Folded<Self>,
        component: usize,
        leaves: &dyn Leaves,
    ) -> Self {
        let constant = |constant| Self { coefficients: BTreeMap::new(), constant };
        match expression {
            Expression::Number(number) => constant(*number),
            Expression::Index(depth) => constant(leaves.index(*depth)),
            Expression::Parameter { parameter, indices } => {
                let indices: Vec<f64> = indices.iter().map(|index| below.of(*index).constant).collect();
                constant(leaves.parameter(*parameter, &indices))
            }
            Expression::Variable(use_) => {
                let count = model.components(use_.variable);
                let component = if count == 1 { 0 } else { component };
                let index = use_.element.map(|element| below.of(element).constant);
                match (component < count).then(|| leaves.variable(use_, index, component)).flatten() {
                    Some(number) => Self { coefficients: BTreeMap::from([(number, 1.0)]), constant: 0.0 },
                    None => constant(f64::NAN),
                }
            }
            Expression::If { condition, then, otherwise } => match below.of(*condition).constant {
                condition if condition.is_nan() => constant(f64::NAN),
                condition => below.of(if condition != 0.0 { *then } else { *otherwise }).clone(),
            },
            Expression::Unary(Unary::Negate, operand) => below.of(*operand).clone().times(-1.0),
            Expression::Unary(Unary::Not, operand) if !below.of(*operand).coefficients.is_empty() => {
                below.of(*operand).clone()
            }
            Expression::Unary(operator, operand) => constant(operator.apply(below.of(*operand).constant)),
            Expression::Binary(operator, left, right) => {
                let (left, right) = (below.of(*left), below.of(*right));
                match operator {
                    Binary::Add => left.clone().plus(right),
                    Binary::Subtract => left.clone().plus(&right.clone().times(-1.0)),
                    Binary::Multiply if left.coefficients.is_empty() => right.clone().times(left.constant),
                    Binary::Multiply => left.clone().times(right.constant),
                    Binary::Divide => left.clone().times(1.0 / right.constant),
                    _ if left.coefficients.is_empty() && right.coefficients.is_empty() => {
                        constant(operator.apply(left.constant, right.constant))
                    }
                    // A comparison is taken as the difference of its sides against 0; several comparisons share the
                    // linear form of the first.
                    Binary::And | Binary::Or if left.coefficients.is_empty() => right.clone(),
                    Binary::And | Binary::Or => left.clone(),
                    operator if operator.compares() => left.clone().plus(&right.clone().times(-1.0)),
                    _ => constant(operator.apply(left.constant, right.constant)),
                }
            }
            Expression::Vector(name, parts) if name == "component" => {
                let at = below.of(parts[1]).constant;
                match at >= 0.0 && at.fract() == 0.0 {
                    true => Self::of(model, parts[0], at as usize, leaves),
                    false => constant(f64::NAN),
                }
            }
            Expression::Vector(_, parts) => {
                parts.get(component).map_or_else(|| constant(f64::NAN), |part| below.of(*part).clone())
            }
            // Not linear, as a field of another program.
            _ => constant(f64::NAN),
        }
    }

    /// Each number multiplied by a factor.
    pub fn times(mut self, factor: f64) -> Self {
        self.coefficients.values_mut().for_each(|coefficient| *coefficient *= factor);
        self.constant *= factor;
        self
    }

    /// The sum of two linear forms.
    pub fn plus(mut self, other: &Self) -> Self {
        for (variable, coefficient) in &other.coefficients {
            *self.coefficients.entry(*variable).or_insert(0.0) += coefficient;
        }
        self.constant += other.constant;
        self
    }
}
