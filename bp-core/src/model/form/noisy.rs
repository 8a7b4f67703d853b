//! Noisy or, noisy and: many causes of one effect, each with a chance of its own.
//!
//! In: causes (truth values), the chance pᵢ that each works, and a leak. Out: a [`Form`]. Invariant: with k causes the
//! table of 2ᵏ rows has k + 1 free parameters.
//!
//! noisy or:  P(X) = 1 − (1 − leak) Π (1 − pᵢ)^xᵢ: each cause that is there may produce the effect.
//! noisy and: P(X) = (1 − leak) Π (1 − pᵢ)^(1 − xᵢ): each condition that is missing may prevent it
//! (Pearl, *Probabilistic Reasoning in Intelligent Systems*, 1988, section 4.3.2; Díez and Druzdzel 2006).

use super::Form;
use crate::ids::ExpressionId;
use crate::model::{Expression, ModelBuilder};
use crate::operators::Binary;

impl ModelBuilder {
    /// A noisy or of (cause, chance that it works).
    pub fn noisy_or(&mut self, causes: &[(ExpressionId, ExpressionId)], leak: ExpressionId) -> Form {
        let one = self.number(1.0);
        let mut silent = self.binary(Binary::Subtract, one, leak);
        for (cause, chance) in causes {
            let fails = self.binary(Binary::Subtract, one, *chance);
            let factor = self.expression(Expression::If { condition: *cause, then: fails, otherwise: one });
            silent = self.binary(Binary::Multiply, silent, factor);
        }
        Form::Bernoulli(self.binary(Binary::Subtract, one, silent))
    }

    /// A noisy and of (condition, chance that its absence prevents the effect).
    pub fn noisy_and(&mut self, conditions: &[(ExpressionId, ExpressionId)], leak: ExpressionId) -> Form {
        let one = self.number(1.0);
        let mut holds = self.binary(Binary::Subtract, one, leak);
        for (condition, chance) in conditions {
            let spared = self.binary(Binary::Subtract, one, *chance);
            let factor = Expression::If { condition: *condition, then: one, otherwise: spared };
            let factor = self.expression(factor);
            holds = self.binary(Binary::Multiply, holds, factor);
        }
        Form::Bernoulli(holds)
    }
}
