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

/// A factor of weights whose total is beyond the range of numbers: a power of two.
const SMALLER: f64 = 1.0 / 4_294_967_296.0;

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
        let known: f64 = weights.iter().filter_map(|weight| self.so_far().constant(*weight)).sum();
        // A total beyond the range of numbers: the same shares of smaller weights, without rounding.
        let smaller: Vec<ExpressionId> = match known == f64::INFINITY {
            true => {
                let part = self.number(SMALLER);
                weights.iter().map(|weight| self.binary(Binary::Multiply, *weight, part)).collect()
            }
            false => weights.to_vec(),
        };
        let weights = &smaller;
        let sum = weights.iter().copied().reduce(|sum, weight| self.binary(Binary::Add, sum, weight));
        let total = sum.unwrap_or_else(|| self.number(0.0));
        let share = |weight: &ExpressionId| self.binary(Binary::Divide, *weight, total);
        Form::Categorical(weights.iter().map(share).collect())
    }
}
