//! Noisy or and noisy and: many causes of one effect, each with its own probability.
//!
//! In: causes (booleans), the probability pᵢ that each is effective, and a leak. Out: a [`Form`]. Invariant: with k
//! causes the table of 2ᵏ rows has k + 1 free parameters.
//!
//! noisy or: P(X) = 1 − (1 − leak) Π (1 − pᵢ)^xᵢ: each present cause may produce the effect. noisy and: P(X) = (1 −
//! leak) Π (1 − pᵢ)^(1 − xᵢ): each absent condition may prevent it (Pearl, *Probabilistic Reasoning in Intelligent
//! Systems*, 1988, section 4.3.2; Díez and Druzdzel 2006). That any of several happens is the sum p₁ + (1 − p₁) (p₂ + (1 − p₂)
//! (…)), that none does the product: both keep the digits of a small probability.

use super::{Form, row_tolerance};
use crate::ids::ExpressionId;
use crate::model::{Expression, ModelBuilder};
use crate::operators::Binary;

impl ModelBuilder {
    /// A noisy or of (cause, probability that it is effective).
    pub fn noisy_or(&mut self, causes: &[(ExpressionId, ExpressionId)], leak: ExpressionId) -> Form {
        let zero = self.number(0.0);
        let own = |(condition, chance): &(ExpressionId, ExpressionId)| Expression::If {
            condition: *condition,
            then: *chance,
            otherwise: zero,
        };
        let [any, none] = self.any_or_none(causes, own, leak);
        Form::Bernoulli(any, Some(none))
    }

    /// A noisy and of (condition, probability that its absence prevents the effect).
    pub fn noisy_and(&mut self, conditions: &[(ExpressionId, ExpressionId)], leak: ExpressionId) -> Form {
        let zero = self.number(0.0);
        let own = |(condition, chance): &(ExpressionId, ExpressionId)| Expression::If {
            condition: *condition,
            then: zero,
            otherwise: *chance,
        };
        let [any, none] = self.any_or_none(conditions, own, leak);
        Form::Bernoulli(none, Some(any))
    }

    /// The probability that any of several happens, and that none does.
    fn any_or_none(
        &mut self,
        causes: &[(ExpressionId, ExpressionId)],
        own: impl Fn(&(ExpressionId, ExpressionId)) -> Expression,
        leak: ExpressionId,
    ) -> [ExpressionId; 2] {
        let one = self.number(1.0);
        let (mut any, mut none) = (leak, self.fails(one, leak));
        for cause in causes {
            let own = self.expression(own(cause));
            let fails = self.binary(Binary::Subtract, one, own);
            let others = self.binary(Binary::Multiply, fails, any);
            any = self.binary(Binary::Add, own, others);
            let fails = self.fails(one, own);
            none = self.binary(Binary::Multiply, none, fails);
        }
        [any, none].map(|probability| self.with_chances(probability, causes, leak))
    }

    fn fails(&mut self, one: ExpressionId, chance: ExpressionId) -> ExpressionId {
        self.complement(chance).unwrap_or_else(|| self.binary(Binary::Subtract, one, chance))
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
            if self.so_far().is_probability(chance) {
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
}
