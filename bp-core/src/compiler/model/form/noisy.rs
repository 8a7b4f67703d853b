//! Noisy or and noisy and: many causes of one effect, each with its own probability.
//!
//! In: causes (booleans), the probability pᵢ that each is effective, and a leak. Out: a [`Form`]. Invariant: with k
//! causes the table of 2ᵏ rows has k + 1 free parameters.
//!
//! noisy or: P(X) = 1 − (1 − leak) Π (1 − pᵢ)^xᵢ: each present cause may produce the effect. noisy and: P(X) = (1 −
//! leak) Π (1 − pᵢ)^(1 − xᵢ): each absent condition may prevent it (Pearl, *Probabilistic Reasoning in Intelligent
//! Systems*, 1988, section 4.3.2; Díez and Druzdzel 2006). Noisy or is the sum p₁ + (1 − p₁) (p₂ + (1 − p₂) (…)), in which a
//! small probability keeps its digits.

use super::{Form, row_tolerance};
use crate::ids::ExpressionId;
use crate::model::{Expression, ModelBuilder, ParameterKind};
use crate::operators::Binary;

impl ModelBuilder {
    /// A noisy or of (cause, probability that it is effective).
    pub fn noisy_or(&mut self, causes: &[(ExpressionId, ExpressionId)], leak: ExpressionId) -> Form {
        let (zero, one) = (self.number(0.0), self.number(1.0));
        let mut any = leak;
        for (cause, chance) in causes {
            let own = Expression::If { condition: *cause, then: *chance, otherwise: zero };
            let own = self.expression(own);
            let fails = self.binary(Binary::Subtract, one, own);
            let others = self.binary(Binary::Multiply, fails, any);
            any = self.binary(Binary::Add, own, others);
        }
        Form::Bernoulli(self.with_chances(any, causes, leak))
    }

    /// A noisy and of (condition, probability that its absence prevents the effect).
    pub fn noisy_and(&mut self, conditions: &[(ExpressionId, ExpressionId)], leak: ExpressionId) -> Form {
        let one = self.number(1.0);
        let mut holds = self.binary(Binary::Subtract, one, leak);
        for (condition, chance) in conditions {
            let spared = self.binary(Binary::Subtract, one, *chance);
            let factor = Expression::If { condition: *condition, then: one, otherwise: spared };
            let factor = self.expression(factor);
            holds = self.binary(Binary::Multiply, holds, factor);
        }
        Form::Bernoulli(self.with_chances(holds, conditions, leak))
    }

    /// A probability; if one of its factors lies outside [0, 1] by more than rounding, that factor, which is then refused as
    /// a probability. (Two such factors can multiply to a number inside.)
    fn with_chances(
        &mut self,
        probability: ExpressionId,
        causes: &[(ExpressionId, ExpressionId)],
        leak: ExpressionId,
    ) -> ExpressionId {
        let mut result = probability;
        for chance in causes.iter().map(|(_, chance)| *chance).chain([leak]) {
            if self.is_probability(chance) {
                continue;
            }
            let tolerance = if self.so_far().is_computed(chance) { row_tolerance(1) } else { 0.0 };
            let (least, most) = (self.number(-tolerance), self.number(1.0 + tolerance));
            let above = self.binary(Binary::GreaterOrEqual, chance, least);
            let below = self.binary(Binary::LessOrEqual, chance, most);
            let condition = self.binary(Binary::And, above, below);
            result = self.expression(Expression::If { condition, then: result, otherwise: chance });
        }
        result
    }

    /// Whether an expression lies in [0, 1] by construction.
    fn is_probability(&self, id: ExpressionId) -> bool {
        match self.so_far().expressions[id] {
            Expression::Number(number) => (0.0..=1.0).contains(&number),
            Expression::Parameter { parameter, .. } => {
                self.so_far().parameters[parameter].kind == ParameterKind::Probability
            }
            _ => false,
        }
    }
}
