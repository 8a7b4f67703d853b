//! Numbers that a form cannot have: their density is NaN.
//!
//! In: the numbers of a form, as values of a kernel. Out: what is computed from them, or NaN where the form refuses one
//! of them. Invariant: the conditions are those of `distribution/check.rs`; they depend on the numbers alone, so that
//! numbers known now cost nothing and those of a parameter are checked once.
//!
//! A NaN reaches the answer through every sum and product; who runs the kernel then asks `Setting::not_a_number` which
//! form it came from.

use super::Lowering;
use crate::error::Error;
use crate::ids::{ExpressionId, ValueId};
use crate::law::{Constraint, Law};
use crate::model::{Expression, ParameterKind, row_tolerance};
use crate::operators::{Binary, Unary};

impl Lowering<'_> {
    /// The value where the condition holds, else NaN.
    pub(super) fn only_if(&mut self, holds: ValueId, value: ValueId) -> ValueId {
        let nothing = self.builder.constant(f64::NAN);
        self.builder.select(holds, value, nothing)
    }

    /// x ≥ low and x ≤ high
    fn between(&mut self, x: ValueId, low: f64, high: f64) -> ValueId {
        let (low, high) = (self.builder.constant(low), self.builder.constant(high));
        let above = self.builder.binary(Binary::GreaterOrEqual, x, low);
        let below = self.builder.binary(Binary::LessOrEqual, x, high);
        self.builder.binary(Binary::And, above, below)
    }

    /// A probability; what lies outside [0, 1] by rounding is the nearer end.
    pub(super) fn probability(&mut self, id: ExpressionId) -> Result<ValueId, Error> {
        // Each branch apart, so that one that no loop changes is looked at once.
        if let Expression::If { condition, then, otherwise } = self.model.expressions[id] {
            let condition = self.expression(condition)?;
            let (then, otherwise) = (self.probability(then)?, self.probability(otherwise)?);
            return Ok(self.builder.select(condition, then, otherwise));
        }
        let value = self.expression(id)?;
        if self.is_probability(id) {
            return Ok(value);
        }
        let tolerance = if self.is_computed(id) { row_tolerance(1) } else { 0.0 };
        let holds = self.between(value, -tolerance, 1.0 + tolerance);
        let nearest = self.nearest_probability(id, value);
        Ok(self.only_if(holds, nearest))
    }

    /// The probabilities of a row, which sum to one.
    pub(super) fn row(&mut self, entries: &[ExpressionId]) -> Result<Vec<ValueId>, Error> {
        let values: Vec<ValueId> =
            entries.iter().map(|entry| self.expression(*entry)).collect::<Result<_, _>>()?;
        let tolerance = row_tolerance(entries.len());
        let least = self.builder.constant(-tolerance);
        let (mut sum, mut holds) = (self.builder.constant(0.0), self.builder.constant(1.0));
        for (value, entry) in values.iter().zip(entries) {
            sum = self.builder.binary(Binary::Add, sum, *value);
            if !self.is_probability(*entry) {
                let positive = self.builder.binary(Binary::GreaterOrEqual, *value, least);
                holds = self.builder.binary(Binary::And, holds, positive);
            }
        }
        let whole = self.between(sum, 1.0 - tolerance, 1.0 + tolerance);
        let holds = self.builder.binary(Binary::And, holds, whole);
        let entry = |lowering: &mut Self, (value, entry): (&ValueId, &ExpressionId)| {
            let nearest = lowering.nearest_probability(*entry, *value);
            lowering.only_if(holds, nearest)
        };
        Ok(values.iter().zip(entries).map(|pair| entry(self, pair)).collect())
    }

    /// A computed probability without what rounding put outside [0, 1].
    fn nearest_probability(&mut self, id: ExpressionId, value: ValueId) -> ValueId {
        if self.is_probability(id) || !self.is_computed(id) {
            return value;
        }
        let (zero, one) = (self.builder.constant(0.0), self.builder.constant(1.0));
        let value = self.builder.binary(Binary::Maximum, value, zero);
        self.builder.binary(Binary::Minimum, value, one)
    }

    /// A weight, which is finite and not negative.
    pub(super) fn weight(&mut self, id: ExpressionId) -> Result<ValueId, Error> {
        let value = self.expression(id)?;
        let (zero, infinity) = (self.builder.constant(0.0), self.builder.constant(f64::INFINITY));
        let positive = self.builder.binary(Binary::GreaterOrEqual, value, zero);
        let finite = self.builder.binary(Binary::Less, value, infinity);
        let holds = self.builder.binary(Binary::And, positive, finite);
        Ok(self.only_if(holds, value))
    }

    /// Whether an expression is a finite number.
    pub(super) fn is_finite(&mut self, id: ExpressionId) -> Result<ValueId, Error> {
        if self.is_surely_finite(id) {
            return Ok(self.builder.constant(1.0));
        }
        let value = self.expression(id)?;
        let (size, infinity) =
            (self.builder.unary(Unary::Absolute, value), self.builder.constant(f64::INFINITY));
        Ok(self.builder.binary(Binary::Less, size, infinity))
    }

    /// Whether a number is above 0, and finite.
    pub(super) fn is_positive(&mut self, value: ValueId) -> ValueId {
        let (zero, infinity) = (self.builder.constant(0.0), self.builder.constant(f64::INFINITY));
        let positive = self.builder.binary(Binary::Greater, value, zero);
        let finite = self.builder.binary(Binary::Less, value, infinity);
        self.builder.binary(Binary::And, positive, finite)
    }

    /// Whether one number is less than another.
    pub(super) fn is_less(&mut self, low: ExpressionId, high: ExpressionId) -> Result<ValueId, Error> {
        let (low, high) = (self.expression(low)?, self.expression(high)?);
        Ok(self.builder.binary(Binary::Less, low, high))
    }

    /// Whether the parameters of a law are such as it can have: [`Law::refuses`].
    pub(super) fn law_holds(&mut self, law: Law, arguments: &[ExpressionId]) -> Result<ValueId, Error> {
        let mut holds = self.builder.constant(1.0);
        for (argument, (_, constraint)) in arguments.iter().zip(law.parameters()) {
            let value = self.expression(*argument)?;
            let zero = self.builder.constant(0.0);
            let one = match constraint {
                Constraint::Real => self.is_finite(*argument)?,
                Constraint::Positive => self.is_positive(value),
                Constraint::Probability => self.between(value, 0.0, 1.0),
                Constraint::Count => {
                    let whole = self.builder.unary(Unary::Floor, value);
                    let whole = self.builder.binary(Binary::Equal, value, whole);
                    let positive = self.builder.binary(Binary::GreaterOrEqual, value, zero);
                    self.builder.binary(Binary::And, whole, positive)
                }
            };
            holds = self.builder.binary(Binary::And, holds, one);
        }
        if let (Law::Uniform, [low, high]) = (law, arguments) {
            let ordered = self.is_less(*low, *high)?;
            holds = self.builder.binary(Binary::And, holds, ordered);
        }
        Ok(holds)
    }

    /// Whether an expression is made by arithmetic, so that it is subject to rounding.
    fn is_computed(&self, id: ExpressionId) -> bool {
        match &self.model.expressions[id] {
            Expression::Unary(..) | Expression::Binary(..) => true,
            Expression::If { then, otherwise, .. } => self.is_computed(*then) || self.is_computed(*otherwise),
            _ => false,
        }
    }

    /// Whether an expression lies in [0, 1] by construction.
    fn is_probability(&self, id: ExpressionId) -> bool {
        match &self.model.expressions[id] {
            Expression::Number(number) => (0.0..=1.0).contains(number),
            Expression::If { then, otherwise, .. } => {
                self.is_probability(*then) && self.is_probability(*otherwise)
            }
            _ => false,
        }
    }

    /// Whether an expression is a finite number by construction.
    fn is_surely_finite(&self, id: ExpressionId) -> bool {
        let both = |left: &ExpressionId, right: &ExpressionId| {
            self.is_surely_finite(*left) && self.is_surely_finite(*right)
        };
        match &self.model.expressions[id] {
            Expression::Number(number) => number.is_finite(),
            Expression::Index(_)
            | Expression::First { .. }
            | Expression::Frontier { .. }
            | Expression::Innermost { .. } => true,
            Expression::Variable(use_) => self.model.variables[use_.variable].domain.is_finite(),
            Expression::Parameter { parameter, .. } => {
                self.model.parameters[*parameter].kind == ParameterKind::Size
            }
            Expression::Unary(operator, operand) => match operator {
                Unary::Exponential
                | Unary::NaturalLogarithm
                | Unary::BinaryLogarithm
                | Unary::SquareRoot
                | Unary::LnGamma
                | Unary::LnBessel => false,
                _ => self.is_surely_finite(*operand),
            },
            Expression::Binary(Binary::Divide | Binary::Power | Binary::Remainder, ..) => false,
            Expression::Binary(_, left, right) => both(left, right),
            Expression::If { then, otherwise, .. } => both(then, otherwise),
            _ => false,
        }
    }
}
