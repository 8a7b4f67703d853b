//! Types of operators.
//!
//! In: an operator and its operands as written. Out: a node of the model and its type. Invariant: a cell can only be
//! added to a displacement; an addition of two sets determines which is which.

use super::expressions::{Scope, Typed};
use super::types::Type;
use super::{Checker, number};
use crate::diagnostic::Diagnostic;
use crate::ids::{ExpressionId, SetId};
use crate::model::{Domain, Expression, SetKind};
use crate::operators::{Binary, Unary};
use crate::source::Span;
use crate::syntax::ast::{BinaryOp, Expr, ExprKind, UnaryOp};

impl Checker<'_> {
    pub(super) fn unary(&mut self, span: Span, op: UnaryOp, operand: &Expr, scope: &Scope) -> Option<Typed> {
        let (id, kind) = self.expression(operand, scope, None)?;
        match (op, &kind) {
            (UnaryOp::Minus, Type::Number | Type::Vector(_)) => {
                Some((self.node(span, Expression::Unary(Unary::Negate, id)), kind))
            }
            (UnaryOp::Not, Type::Boolean) => Some((self.node(span, Expression::Unary(Unary::Not, id)), kind)),
            _ => {
                let expected = if op == UnaryOp::Minus { Type::Number } else { Type::Boolean };
                self.expect(operand.span(), &kind, &expected);
                None
            }
        }
    }

    /// An expression with two operands. A chain of operators, which leans to the left, takes no stack.
    pub(super) fn binary(&mut self, expr: &Expr, scope: &Scope, hint: Option<&Domain>) -> Option<Typed> {
        let (mut chain, mut first, mut hint) = (Vec::new(), expr, hint.cloned());
        while let ExprKind::Binary(op, left, right) = &first.kind {
            // A label belongs to the domain of the other operand.
            let other = self.domain_of(right);
            chain.push((first.span(), *op, &**left, &**right, std::mem::replace(&mut hint, other)));
            first = left;
        }
        let mut typed = self.expression(first, scope, hint.as_ref());
        for (span, op, left, right, hint) in chain.into_iter().rev() {
            let domain = self.domain_of(left);
            let second = self.expression(right, scope, domain.as_ref());
            typed = typed.zip(second).and_then(|both| self.combined((span, op), (left, right), both, hint));
        }
        typed
    }

    fn combined(
        &mut self,
        (span, op): (Span, BinaryOp),
        (left, right): (&Expr, &Expr),
        both: (Typed, Typed),
        hint: Option<Domain>,
    ) -> Option<Typed> {
        let ((left_id, left_type), (right_id, right_type)) = both;
        use BinaryOp::*;
        let operator = operator(op);
        let kind = match (op, &left_type, &right_type) {
            (Or | And, Type::Boolean, Type::Boolean) => Type::Boolean,
            (Or | And, found, _) => {
                let bad =
                    if *found == Type::Boolean { (right.span(), &right_type) } else { (left.span(), found) };
                self.expect(bad.0, bad.1, &Type::Boolean);
                return None;
            }
            (Equal | Is | Different, one, other) if one == other && !matches!(one, Type::Vector(_)) => {
                Type::Boolean
            }
            // A whole number denotes the element with this number.
            (Equal | Is | Different, Type::Element(_), Type::Number) if is_whole(right) => Type::Boolean,
            (Equal | Is | Different, Type::Number, Type::Element(_)) if is_whole(left) => Type::Boolean,
            (Less | LessOrEqual | Greater | GreaterOrEqual, Type::Number, Type::Number) => Type::Boolean,
            (Plus | Minus | Times | Over, Type::Number, Type::Number) => Type::Number,
            (Plus | Minus, Type::Vector(one), Type::Vector(other)) if one == other => left_type.clone(),
            (Times | Over, Type::Vector(_), Type::Number) => left_type.clone(),
            (Times, Type::Number, Type::Vector(_)) => right_type.clone(),
            (Plus | Minus, Type::Element(one), Type::Element(other)) if one != other => {
                return self.displaced(span, op, (left_id, *one), (right_id, *other), hint.as_ref());
            }
            _ => {
                let model = self.model.so_far();
                let (one, other) = (left_type.words(model), right_type.words(model));
                let message = format!("`{}` cannot take {one} and {other}", op.text());
                let compared = |expr: &Expr| matches!(&expr.kind, ExprKind::Binary(op, ..) if op.compares());
                let mut wrong = Diagnostic::new(span, message);
                if let (ExprKind::Binary(first, low, middle), true) = (&left.kind, op.compares())
                    && compared(left)
                {
                    let first = first.text();
                    let help = format!("write `{low} {first} {middle} and {middle} {} {right}`", op.text());
                    wrong = wrong.with_help(help);
                }
                let truth = [(left, &left_type), (right, &right_type)]
                    .into_iter()
                    .find(|(_, kind)| **kind == Type::Boolean);
                if let (Some((expr, _)), true) = (truth, matches!(op, Plus | Minus | Times | Over)) {
                    wrong = wrong.with_help(format!("as a number it is `if {expr} {{ 1 }} else {{ 0 }}`"));
                }
                self.wrong.push(wrong);
                return None;
            }
        };
        Some((self.node(span, Expression::Binary(operator, left_id, right_id)), kind))
    }

    /// `A + V`: a cell plus a displacement. It determines that one set is a grid, and the other its displacements.
    fn displaced(
        &mut self,
        span: Span,
        op: BinaryOp,
        left: (ExpressionId, SetId),
        right: (ExpressionId, SetId),
        hint: Option<&Domain>,
    ) -> Option<Typed> {
        let sets = &self.model.so_far().sets;
        let is_displacement = |set| matches!(sets[set].kind, SetKind::Displacements(_));
        let swapped = hint == Some(&Domain::Set(right.1)) || is_displacement(left.1);
        let (cells, moves) = if swapped { (right.1, left.1) } else { (left.1, right.1) };
        let fits = sets[cells].kind != SetKind::Displacements(moves)
            && !is_displacement(cells)
            && matches!(sets[moves].kind, SetKind::Plain | SetKind::Displacements(_))
            && !matches!(sets[moves].kind, SetKind::Displacements(of) if of != cells);
        if !fits {
            let (cells, moves) = (sets[cells].name.clone(), sets[moves].name.clone());
            self.complain(span, format!("`{moves}` is not a set of displacements of `{cells}`"));
            return None;
        }
        self.model.set_kind(cells, SetKind::Grid);
        self.model.set_kind(moves, SetKind::Displacements(cells));
        Some((self.node(span, Expression::Binary(operator(op), left.0, right.0)), Type::Element(cells)))
    }
}

/// Whether an expression is a whole number as it is written.
fn is_whole(expr: &Expr) -> bool {
    matches!(&expr.kind, ExprKind::Number(text) if number(text).is_some_and(|number| number.fract() == 0.0))
}

fn operator(op: BinaryOp) -> Binary {
    match op {
        BinaryOp::Or => Binary::Or,
        BinaryOp::And => Binary::And,
        BinaryOp::Equal | BinaryOp::Is => Binary::Equal,
        BinaryOp::Different => Binary::NotEqual,
        BinaryOp::Less => Binary::Less,
        BinaryOp::LessOrEqual => Binary::LessOrEqual,
        BinaryOp::Greater => Binary::Greater,
        BinaryOp::GreaterOrEqual => Binary::GreaterOrEqual,
        BinaryOp::Plus => Binary::Add,
        BinaryOp::Minus => Binary::Subtract,
        BinaryOp::Times => Binary::Multiply,
        BinaryOp::Over => Binary::Divide,
    }
}
