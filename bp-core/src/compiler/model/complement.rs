//! The probability of `false`: 1 − p without the loss of digits of a difference.
//!
//! In: an expression of a probability. Out: an expression of its complement. Invariant: both have the same value wherever the
//! expression is a probability; a complement is written only where the parts of the expression give it without cancellation.
//!
//! 1 − (1 − x) = x,   1 − logistic(x) = logistic(−x),   1 − Φ(x) = Φ(−x),   1 − p q = (1 − p) + p (1 − q),
//! 1 − (p + (1 − p) q) = (1 − p) (1 − q), and of a choice the complements of its branches.

use super::{Expression, Form, Model, ParameterKind};
use crate::ids::ExpressionId;
use crate::model::Domain;
use crate::operators::{Binary, Unary};
use std::collections::{BTreeSet, HashMap};

/// The shape of an expression whose complement is written.
#[derive(Clone, Copy)]
enum Shape {
    /// 1 − x
    Difference(ExpressionId),
    /// A choice between two.
    Choice { condition: ExpressionId, branches: [ExpressionId; 2] },
    /// Φ(x)
    Probit(ExpressionId),
    /// 1 / (1 + exp(x))
    Logistic(ExpressionId),
    /// Both of two.
    Both([ExpressionId; 2]),
    /// Any of two: p + (1 − p) q.
    Any([ExpressionId; 2]),
    /// Anything else.
    Other,
}

impl Model {
    /// `bernoulli(p)`.
    pub(crate) fn bernoulli(&mut self, chance: ExpressionId) -> Form {
        Form::Bernoulli(chance, self.complement(chance))
    }

    /// An expression of 1 − p, where it has more digits than the difference.
    pub(super) fn complement(&mut self, root: ExpressionId) -> Option<ExpressionId> {
        let (mut open, mut parts) = (vec![root], BTreeSet::from([root]));
        while let Some(id) = open.pop() {
            let below = match self.shape(id) {
                Shape::Choice { branches, .. } => branches.to_vec(),
                Shape::Both(parts) | Shape::Any(parts) => parts.to_vec(),
                _ => continue,
            };
            open.extend(below.into_iter().filter(|part| parts.insert(*part)));
        }
        // Parts come before the expressions that read them.
        let mut complements: HashMap<ExpressionId, ExpressionId> = HashMap::new();
        for id in parts {
            if let Some(complement) = self.complement_of(id, &complements) {
                complements.insert(id, complement);
            }
        }
        complements.get(&root).copied()
    }

    fn complement_of(
        &mut self,
        id: ExpressionId,
        known: &HashMap<ExpressionId, ExpressionId>,
    ) -> Option<ExpressionId> {
        Some(match self.shape(id) {
            Shape::Difference(other) => other,
            Shape::Choice { condition, branches } => {
                if branches.iter().all(|branch| !known.contains_key(branch)) {
                    return None;
                }
                let [then, otherwise] = branches.map(|branch| self.other(branch, known));
                self.expressions.push(Expression::If { condition, then, otherwise })
            }
            Shape::Probit(score) => {
                let minus = self.expressions.push(Expression::Unary(Unary::Negate, score));
                self.expressions.push(Expression::Unary(Unary::NormalCumulative, minus))
            }
            Shape::Logistic(minus) => {
                let score = match self.expressions[minus] {
                    Expression::Unary(Unary::Negate, score) => score,
                    _ => self.expressions.push(Expression::Unary(Unary::Negate, minus)),
                };
                let odds = self.expressions.push(Expression::Unary(Unary::Exponential, score));
                let one = self.expressions.push(Expression::Number(1.0));
                let total = self.expressions.push(Expression::Binary(Binary::Add, one, odds));
                self.expressions.push(Expression::Binary(Binary::Divide, one, total))
            }
            Shape::Both([first, second]) => {
                let [fails, other] = [first, second].map(|part| self.other(part, known));
                let after = self.expressions.push(Expression::Binary(Binary::Multiply, first, other));
                self.expressions.push(Expression::Binary(Binary::Add, fails, after))
            }
            Shape::Any(parts) => {
                let [first, second] = parts.map(|part| self.other(part, known));
                self.expressions.push(Expression::Binary(Binary::Multiply, first, second))
            }
            Shape::Other => return None,
        })
    }

    /// The complement of a part, of which that of a number is the difference.
    fn other(&mut self, part: ExpressionId, known: &HashMap<ExpressionId, ExpressionId>) -> ExpressionId {
        if let Some(complement) = known.get(&part) {
            return *complement;
        }
        let one = self.expressions.push(Expression::Number(1.0));
        self.expressions.push(Expression::Binary(Binary::Subtract, one, part))
    }

    fn shape(&self, id: ExpressionId) -> Shape {
        if let Some([own, rest]) = self.alternative(id) {
            return Shape::Any([own, rest]);
        }
        match self.expressions[id] {
            Expression::Binary(Binary::Subtract, one, other) if self.constant(one) == Some(1.0) => {
                Shape::Difference(other)
            }
            Expression::If { condition, then, otherwise } => {
                Shape::Choice { condition, branches: [then, otherwise] }
            }
            Expression::Unary(Unary::NormalCumulative, score) => Shape::Probit(score),
            Expression::Binary(Binary::Divide, one, total) if self.is_one(one) => {
                match self.expressions[total] {
                    Expression::Binary(Binary::Add, one, odds) if self.is_one(one) => {
                        match self.expressions[odds] {
                            Expression::Unary(Unary::Exponential, minus) => Shape::Logistic(minus),
                            _ => Shape::Other,
                        }
                    }
                    _ => Shape::Other,
                }
            }
            Expression::Binary(Binary::Multiply, first, second)
                if self.is_probability(first) && self.is_probability(second) =>
            {
                Shape::Both([first, second])
            }
            _ => Shape::Other,
        }
    }

    fn is_one(&self, id: ExpressionId) -> bool {
        self.expressions[id] == Expression::Number(1.0)
    }

    /// p and q of p + (1 − p) q, that one of two happens at least.
    fn alternative(&self, id: ExpressionId) -> Option<[ExpressionId; 2]> {
        if let Expression::Binary(Binary::Add, own, others) = self.expressions[id]
            && let Expression::Binary(Binary::Multiply, fails, rest) = self.expressions[others]
            && let Expression::Binary(Binary::Subtract, one, same) = self.expressions[fails]
            && same == own
            && self.constant(one) == Some(1.0)
        {
            return Some([own, rest]);
        }
        None
    }

    /// The probabilities p₁, p₂, … of p₁ + (1 − p₁) (p₂ + (1 − p₂) (…)).
    pub(super) fn alternatives(&self, root: ExpressionId) -> Vec<ExpressionId> {
        let (mut all, mut next) = (Vec::new(), root);
        while let Some([own, rest]) = self.alternative(next) {
            all.push(own);
            next = rest;
        }
        all.push(next);
        all
    }

    /// Whether an expression lies in [0, 1] by construction.
    pub(super) fn is_probability(&self, root: ExpressionId) -> bool {
        let mut open = vec![root];
        while let Some(id) = open.pop() {
            match &self.expressions[id] {
                Expression::Number(number) if (0.0..=1.0).contains(number) => {}
                Expression::Parameter { parameter, .. }
                    if self.parameters[*parameter].kind == ParameterKind::Probability => {}
                Expression::Variable(use_) if self.variables[use_.variable].domain == Domain::Boolean => {}
                Expression::Binary(Binary::Subtract, one, other) if self.constant(*one) == Some(1.0) => {
                    open.push(*other);
                }
                Expression::Binary(Binary::Multiply, left, right) => open.extend([*left, *right]),
                Expression::If { then, otherwise, .. } => open.extend([*then, *otherwise]),
                _ => return false,
            }
        }
        true
    }
}
