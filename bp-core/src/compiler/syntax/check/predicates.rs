//! Predicates of a question: equations between reals, and operands that have no value.
//!
//! In: the node of a truth value. Out: the node that is asked instead. Invariant: reals that are known to be equal are known by their
//! difference, since the event has no probability; a predicate whose operand is not a number is no number either, so that its
//! Dirac is refused where it is met.

use super::Checker;
use super::expressions::Scope;
use super::types::Type;
use crate::ids::ExpressionId;
use crate::model::{Domain, Expression};
use crate::operators::{Binary, Unary};
use crate::source::Span;
use crate::syntax::ast::Expr;

impl Checker<'_> {
    /// The difference of two numbers of which one is a real variable's, of a comparison for equality.
    pub(super) fn equation(&mut self, root: ExpressionId, span: Span) -> Option<ExpressionId> {
        let model = self.model.so_far();
        let Expression::Binary(Binary::Equal, left, right) = model.expressions[root] else { return None };
        let real = |id: &ExpressionId| match &model.expressions[*id] {
            Expression::Variable(use_) => {
                matches!(model.variables[use_.variable].domain, Domain::Real | Domain::Vector(_))
            }
            _ => false,
        };
        model.nodes_below(root).iter().any(real).then(|| {
            let difference = Expression::Binary(Binary::Subtract, left, right);
            self.node(span, difference)
        })
    }

    /// An expression where it is asked: a truth value plus 0 times each operand of its comparisons that may be no number; any
    /// value that it takes where the predicates that are given do not hold.
    pub(super) fn where_given<'e>(
        &mut self,
        root: ExpressionId,
        kind: &Type,
        span: Span,
        (given, scope): (impl Iterator<Item = &'e Expr>, &Scope),
    ) -> ExpressionId {
        let (mut value, other) = match kind {
            Type::Boolean => {
                let Some(guard) = self.guard(root, span) else { return root };
                (self.node(span, Expression::Binary(Binary::Add, root, guard)), Some(0.0))
            }
            Type::Number if self.may_be_undefined(root) => {
                let values = self.model.so_far().values_of(root);
                (root, values.and_then(|values| values.into_iter().find(|value| value.is_finite())))
            }
            _ => return root,
        };
        let Some(other) = other else { return value };
        for expr in given {
            let (mistakes, nodes) = (self.wrong.0.len(), self.model.so_far().expressions.len());
            match self.expression(expr, scope, None) {
                Some((condition, Type::Boolean)) if self.may_exclude(condition) => {
                    let otherwise = self.node(span, Expression::Number(other));
                    value = self.node(span, Expression::If { condition, then: value, otherwise });
                }
                _ => drop(self.model.take_nodes(nodes)),
            }
            // It is reported where it stands.
            self.wrong.0.truncate(mistakes);
        }
        value
    }

    /// Whether a given predicate has a value in every context, and reads no reals.
    fn may_exclude(&self, condition: ExpressionId) -> bool {
        !self.may_be_undefined(condition) && self.model.so_far().values_of(condition).is_some()
    }

    /// 0 where all that is compared is a number; `None` where it always is. Operands that `and` and `or` need not
    /// evaluate are left out.
    fn guard(&mut self, id: ExpressionId, span: Span) -> Option<ExpressionId> {
        let node = self.model.so_far().expressions[id].clone();
        match node {
            Expression::Binary(operator @ (Binary::And | Binary::Or), left, right) => {
                let (first, second) = (self.guard(left, span), self.guard(right, span));
                let second = second.map(|guard| {
                    let zero = self.node(span, Expression::Number(0.0));
                    let (then, otherwise) =
                        if operator == Binary::And { (guard, zero) } else { (zero, guard) };
                    self.node(span, Expression::If { condition: left, then, otherwise })
                });
                self.sum(first, second, span)
            }
            Expression::Unary(Unary::Not, operand) => self.guard(operand, span),
            Expression::Binary(operator, left, right) if operator.compares() => {
                let mut zeros =
                    [left, right].into_iter().filter(|id| self.may_be_undefined(*id)).collect::<Vec<_>>();
                zeros.iter_mut().for_each(|id| {
                    let zero = self.node(span, Expression::Number(0.0));
                    *id = self.node(span, Expression::Binary(Binary::Multiply, zero, *id));
                });
                self.sum(zeros.first().copied(), zeros.get(1).copied(), span)
            }
            _ => None,
        }
    }

    fn sum(
        &mut self,
        one: Option<ExpressionId>,
        other: Option<ExpressionId>,
        span: Span,
    ) -> Option<ExpressionId> {
        match (one, other) {
            (Some(one), Some(other)) => Some(self.node(span, Expression::Binary(Binary::Add, one, other))),
            (one, other) => one.or(other),
        }
    }

    /// Whether an expression may have no value: it divides, or takes a root or a logarithm, where finite variables may make it no
    /// number or an infinite one, and where reals may make it no number.
    fn may_be_undefined(&self, root: ExpressionId) -> bool {
        let model = self.model.so_far();
        let reads = |id: ExpressionId| {
            model.nodes_below(id).iter().any(|id| matches!(model.expressions[*id], Expression::Variable(_)))
        };
        let is_whole =
            |id: ExpressionId| model.constant(id).is_some_and(|power| power.fract() == 0.0 && power >= 0.0);
        let may_be = |id: ExpressionId| match model.expressions[id] {
            Expression::Binary(Binary::Divide | Binary::Remainder, _, by) => {
                reads(by) || model.constant(by) == Some(0.0)
            }
            Expression::Binary(Binary::Power, base, exponent) => {
                reads(exponent) || reads(base) && !is_whole(exponent)
            }
            Expression::Unary(
                Unary::NaturalLogarithm
                | Unary::SquareRoot
                | Unary::BinaryLogarithm
                | Unary::LnGamma
                | Unary::LnBessel,
                operand,
            ) => reads(operand),
            _ => false,
        };
        let grows = |id: ExpressionId| {
            matches!(
                model.expressions[id],
                Expression::Unary(Unary::Exponential, _)
                    | Expression::Binary(Binary::Multiply | Binary::Power, ..)
            )
        };
        model.nodes_below(root).into_iter().any(|id| match may_be(id) || grows(id) {
            true => match model.values_of(id) {
                Some(values) => values.iter().any(|value| !value.is_finite()),
                None => may_be(id),
            },
            false => false,
        })
    }
}
