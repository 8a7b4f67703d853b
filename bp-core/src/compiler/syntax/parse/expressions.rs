//! Expressions: from the flat lists of the grammar to trees with precedence.
//!
//! In: pairs `expression`, `primary`, `suffix`. Out: [`Expr`]. Invariant: operators of equal precedence associate to the
//! left; `not` binds less tightly than a comparison, and unary minus more tightly than a product.

use super::children::{Children, at, name};
use super::grammar::Rule;
use super::sections::{occurrence, occurrences, value};
use crate::syntax::ast::*;
use pest::iterators::Pair;
use std::iter::Peekable;
use std::vec::IntoIter;

enum Token {
    Prefix(At, UnaryOp),
    Operand(Expr),
    Infix(BinaryOp),
}

/// An expression from its pair.
pub(super) fn expression(pair: Pair<'_, Rule>) -> Expr {
    let mut tokens: Vec<Token> = Vec::new();
    for child in pair.into_inner() {
        match child.as_rule() {
            Rule::prefix => {
                let op = if child.as_str().starts_with('-') { UnaryOp::Minus } else { UnaryOp::Not };
                tokens.push(Token::Prefix(at(&child), op));
            }
            Rule::infix => {
                let text = child.as_str();
                let op = BinaryOp::ALL.into_iter().find(|op| op.text() == text);
                tokens.push(Token::Infix(
                    op.expect("internal: the grammar knows an operator that the tree does not"),
                ));
            }
            Rule::equal => tokens.push(Token::Infix(BinaryOp::Is)),
            Rule::index | Rule::before | Rule::answer | Rule::field => {
                let Some(Token::Operand(inner)) = tokens.pop() else {
                    panic!("internal: a suffix follows an operand");
                };
                tokens.push(Token::Operand(suffix(inner, child)));
            }
            _ => tokens.push(Token::Operand(primary(child))),
        }
    }
    climb(&mut tokens.into_iter().peekable(), 0)
}

/// Precedence climbing: reads operands and operators that bind at least as tightly as `lowest`.
fn climb(tokens: &mut Peekable<IntoIter<Token>>, lowest: u8) -> Expr {
    let mut left = match tokens.next() {
        Some(Token::Prefix(place, op)) => {
            let operand = climb(tokens, op.precedence());
            let span = place.0.to(operand.span());
            Expr { at: At(span), kind: ExprKind::Unary(op, Box::new(operand)) }
        }
        Some(Token::Operand(operand)) => operand,
        _ => panic!("internal: an expression starts with an operand"),
    };
    while let Some(Token::Infix(op)) = tokens.peek() {
        let op = *op;
        if op.precedence() < lowest {
            break;
        }
        tokens.next();
        let right = climb(tokens, op.precedence() + 1);
        let span = left.span().to(right.span());
        left = Expr { at: At(span), kind: ExprKind::Binary(op, Box::new(left), Box::new(right)) };
    }
    left
}

fn suffix(inner: Expr, pair: Pair<'_, Rule>) -> Expr {
    let span = inner.span().to(at(&pair).0);
    let inner = Box::new(inner);
    let kind = match pair.as_rule() {
        Rule::index => ExprKind::Index(inner, expressions(pair)),
        Rule::before => ExprKind::Before(inner),
        Rule::field => ExprKind::Field(inner, Children::of(pair).name()),
        _ => {
            let mut children = Children::of(pair);
            let searched = occurrences(children.need(Rule::occurrences));
            let known = children.take(Rule::occurrences).map(occurrences).unwrap_or_default();
            ExprKind::Answer { of: inner, searched, known }
        }
    };
    Expr { at: At(span), kind }
}

fn primary(pair: Pair<'_, Rule>) -> Expr {
    let place = at(&pair);
    let kind = match pair.as_rule() {
        Rule::number => ExprKind::Number(pair.as_str().to_owned()),
        Rule::boolean => ExprKind::Boolean(pair.as_str() == "true"),
        Rule::group | Rule::term_group => ExprKind::Group(Box::new(expression(Children::of(pair).one()))),
        Rule::vector => ExprKind::Vector(expressions(pair)),
        Rule::if_expression => ExprKind::If(if_expression(pair)),
        Rule::match_expression => {
            let mut children = Children::of(pair);
            let on = Box::new(expression(children.one()));
            let arms = children.all(Rule::arm).into_iter().map(|arm| {
                let mut children = Children::of(arm);
                (pattern(children.one()), expression(children.one()))
            });
            ExprKind::Match(Match { on, arms: arms.collect() })
        }
        Rule::first => {
            let mut children = Children::of(pair);
            let (family, with) = (occurrence(children.one()), occurrence(children.one()));
            ExprKind::First { family, with, index: Box::new(expression(children.one())) }
        }
        _ => {
            let mut children = Children::of(pair);
            let callee = name(&children.need(Rule::name));
            match children.take(Rule::arguments) {
                Some(arguments) => ExprKind::Call(callee, expressions(arguments)),
                None => ExprKind::Name(callee),
            }
        }
    };
    Expr { at: place, kind }
}

fn if_expression(pair: Pair<'_, Rule>) -> If<Expr> {
    let mut children = Children::of(pair);
    let branches = children.all(Rule::branch).into_iter().map(|branch| {
        let mut children = Children::of(branch);
        (expression(children.one()), expression(children.one()))
    });
    If { branches: branches.collect(), otherwise: Box::new(expression(children.one())) }
}

/// The expressions directly under a pair.
pub(super) fn expressions(pair: Pair<'_, Rule>) -> Vec<Expr> {
    Children::of(pair).all(Rule::expression).into_iter().map(expression).collect()
}

/// A pattern from its pair.
pub(super) fn pattern(pair: Pair<'_, Rule>) -> Pattern {
    let place = at(&pair);
    let mut children = Children::of(pair);
    let kind = match children.take(Rule::value) {
        None => PatternKind::Any,
        Some(low) => match children.take(Rule::value) {
            Some(high) => PatternKind::Range(value(low), value(high)),
            None => PatternKind::Value(value(low)),
        },
    };
    Pattern { at: place, kind }
}
