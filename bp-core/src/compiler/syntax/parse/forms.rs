//! Forms, from pairs to the tree.
//!
//! In: pair `form` or one of its kinds. Out: [`Form`]. Invariant: bindings nest to the right, in the order written.

use super::children::{Children, at, name};
use super::expressions::{expression, expressions, pattern};
use super::grammar::Rule;
use super::sections::{factor, occurrence, occurrences, value};
use crate::syntax::ast::*;
use pest::iterators::Pair;

/// `P(…) = form;`
pub(super) fn definition(pair: Pair<'_, Rule>) -> Definition {
    let place = at(&pair);
    let mut children = Children::of(pair);
    let head = factor(children.one());
    Definition { at: place, comments: Comments::default(), head, form: form(children.one()) }
}

/// A form with its bindings.
fn form(pair: Pair<'_, Rule>) -> Form {
    let mut children = Children::of(pair);
    let bindings = children.all(Rule::binding);
    let mut result = plain(children.one());
    for binding in bindings.into_iter().rev() {
        let span = at(&binding).0.to(result.span());
        let mut children = Children::of(binding);
        let name = children.name();
        let value = Box::new(expression(children.one()));
        result = Form { at: At(span), kind: FormKind::Let { name, value, body: Box::new(result) } };
    }
    result
}

/// A form without bindings.
fn plain(pair: Pair<'_, Rule>) -> Form {
    let place = at(&pair);
    let rule = pair.as_rule();
    let mut children = Children::of(pair);
    let kind = match rule {
        Rule::previous => FormKind::Previous {
            variable: Box::new(occurrence(children.one())),
            of: children.take(Rule::expression).map(|of| Box::new(expression(of))),
            otherwise: children
                .take(Rule::otherwise)
                .map(|otherwise| Box::new(plain(Children::of(otherwise).one()))),
        },
        Rule::if_form => {
            let branches = children.all(Rule::form_branch).into_iter().map(|branch| {
                let mut children = Children::of(branch);
                (expression(children.one()), form(children.one()))
            });
            let branches = branches.collect();
            FormKind::If(If { branches, otherwise: Box::new(form(children.one())) })
        }
        Rule::match_form => {
            let on = Box::new(expression(children.one()));
            let arms = children.all(Rule::form_arm).into_iter().map(|arm| {
                let mut children = Children::of(arm);
                (pattern(children.one()), form(children.one()))
            });
            FormKind::Match(Match { on, arms: arms.collect() })
        }
        Rule::table => FormKind::Table(children.all(Rule::row).into_iter().map(row).collect()),
        Rule::ask_form => FormKind::Ask {
            path: Children::of(children.one()).all(Rule::segment).into_iter().map(segment).collect(),
            given: children.take(Rule::occurrences).map(occurrences),
        },
        _ => FormKind::Named {
            name: name(&children.need(Rule::name)),
            arguments: children.take(Rule::arguments).map(expressions),
            by: children.take(Rule::apart).map(|pair| Children::of(pair).names()).unwrap_or_default(),
        },
    };
    Form { at: place, kind }
}

fn row(pair: Pair<'_, Rule>) -> Row {
    let place = at(&pair);
    let mut children = Children::of(pair);
    let keys = match children.take(Rule::keys) {
        Some(keys) => Children::of(keys).all(Rule::value).into_iter().map(value).collect(),
        None => Vec::new(),
    };
    let values = children.all(Rule::expression).into_iter().map(expression).collect();
    Row { at: place, comments: Comments::default(), keys, values }
}

fn segment(pair: Pair<'_, Rule>) -> Segment {
    let mut children = Children::of(pair);
    Segment { name: children.name(), index: children.take(Rule::index).map(expressions).unwrap_or_default() }
}
