//! Softmax: probabilities from scores.
//!
//! In: a score for each value of the left-hand variable. Out: a [`Form`]. Invariant: adding a number to all scores
//! changes nothing, and no score is so large that it overflows: the largest is subtracted.
//!
//! P(X = i) = exp(sᵢ − max s) / Σⱼ exp(sⱼ − max s)

use super::Form;
use crate::ids::ExpressionId;
use crate::model::ModelBuilder;
use crate::operators::{Binary, Unary};

impl ModelBuilder {
    /// A softmax of scores, one for each value.
    pub fn softmax(&mut self, scores: &[ExpressionId]) -> Form {
        let Some((first, rest)) = scores.split_first() else { return Form::Categorical(Vec::new()) };
        let most = rest.iter().fold(*first, |most, score| self.binary(Binary::Maximum, most, *score));
        let weights: Vec<ExpressionId> = (scores.iter())
            .map(|score| {
                let below = self.binary(Binary::Subtract, *score, most);
                self.unary(Unary::Exponential, below)
            })
            .collect();
        self.proportional(&weights)
    }

    /// A categorical form with probabilities proportional to these weights.
    pub(super) fn proportional(&mut self, weights: &[ExpressionId]) -> Form {
        let zero = self.number(0.0);
        let total = weights.iter().fold(zero, |sum, weight| self.binary(Binary::Add, sum, *weight));
        let share = |weight: &ExpressionId| self.binary(Binary::Divide, *weight, total);
        Form::Categorical(weights.iter().map(share).collect())
    }
}
