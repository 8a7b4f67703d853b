//! Linear regression: a normal distribution whose mean is linear in other variables.
//!
//! In: an intercept, (variable, slope) pairs and a standard deviation. Out: a [`Form`].
//!
//! P(Y | X) = N(Y; b + Σ aᵢ Xᵢ, s)

use super::Form;
use crate::ids::ExpressionId;
use crate::model::ModelBuilder;
use crate::operators::Binary;

impl ModelBuilder {
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
