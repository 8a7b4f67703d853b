//! Comparisons of a question between reals that other variables determine.
//!
//! In: the expression of a predicate, or of an equation. Out: its value. Invariant: reals are equal up to rounding, as
//! they are where one is observed (`forms/dirac.rs`).

use super::form::Evaluation;
use crate::forms::dirac;
use crate::ids::ExpressionId;
use crate::law::Numbers;
use crate::model::Expression;
use crate::operators::{Binary, Unary};

impl Evaluation<'_> {
    /// The value of a Dirac. A question compares reals that others determine as an observation does.
    pub(super) fn determined(&self, id: ExpressionId) -> f64 {
        match self.scope.setting.compares_determined(self.instance.factor) {
            true => self.compared(id),
            false => self.scope.number(id),
        }
    }

    fn compared(&self, id: ExpressionId) -> f64 {
        let model = self.scope.setting.model;
        match model.expressions[id] {
            Expression::Binary(Binary::Subtract, left, right) if model.is_equation(self.left()) => {
                dirac::difference(&mut Numbers, self.scope.number(left), self.scope.number(right))
            }
            Expression::Binary(operator, left, right) if operator.compares() => {
                let (left, right) = (self.scope.number(left), self.scope.number(right));
                dirac::compared(&mut Numbers, operator, left, right)
            }
            Expression::Binary(operator @ (Binary::And | Binary::Or | Binary::Add), left, right) => {
                operator.apply(self.compared(left), self.compared(right))
            }
            Expression::Unary(Unary::Not, operand) => Unary::Not.apply(self.compared(operand)),
            _ => self.scope.number(id),
        }
    }
}
