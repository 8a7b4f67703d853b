//! Regressions: a normal distribution whose mean is linear in other variables, and the logistic function of scores.
//!
//! In: an intercept, (variable, slope) pairs and a standard deviation; or a score. Out: a [`Form`]; or a probability.
//!
//! P(Y | X) = N(Y; b + Σ aᵢ Xᵢ, s).   logistic(x) = 1 / (1 + e⁻ˣ).

use super::Form;
use crate::ids::ExpressionId;
use crate::model::ModelBuilder;
use crate::operators::{Binary, Unary};

impl ModelBuilder {
    /// 1 / (1 + e⁻ˣ): of a large −x it is eˣ, with all its digits.
    pub fn logistic(&mut self, score: ExpressionId) -> ExpressionId {
        let (one, minus) = (self.number(1.0), self.unary(Unary::Negate, score));
        let odds = self.unary(Unary::Exponential, minus);
        let total = self.binary(Binary::Add, one, odds);
        self.binary(Binary::Divide, one, total)
    }

    /// A normal distribution with mean intercept + Σ slope · value.
    pub fn linear_regression(
        &mut self,
        intercept: ExpressionId,
        terms: &[(ExpressionId, ExpressionId)],
        deviation: ExpressionId,
    ) -> Form {
        let mut mean = intercept;
        for (value, slope) in terms {
            let term = self.binary(Binary::Multiply, *slope, *value);
            mean = self.binary(Binary::Add, mean, term);
        }
        Form::normal(mean, deviation)
    }
}
