//! Iteration over the pairs of the grammar.
//!
//! In: a pair. Out: its children by rule, and spans without trailing blanks. Invariant: a missing child that the
//! grammar guarantees is an internal error, and panics with `internal`.

use super::grammar::Rule;
use crate::source::Span;
use crate::spelling::unquoted;
use crate::syntax::ast::{At, Name};
use pest::iterators::{Pair, Pairs};

/// The children of a pair, without punctuation.
pub(super) struct Children<'s> {
    pairs: Pairs<'s, Rule>,
}

impl<'s> Children<'s> {
    pub(super) fn of(pair: Pair<'s, Rule>) -> Self {
        Self { pairs: pair.into_inner() }
    }

    fn peek(&mut self) -> Option<Rule> {
        while let Some(pair) = self.pairs.peek() {
            if !is_mark(pair.as_rule()) {
                return Some(pair.as_rule());
            }
            self.pairs.next();
        }
        None
    }

    /// The next child, if it is of this rule.
    pub(super) fn take(&mut self, rule: Rule) -> Option<Pair<'s, Rule>> {
        if self.peek() == Some(rule) { self.pairs.next() } else { None }
    }

    /// The next child, of any rule.
    pub(super) fn any(&mut self) -> Option<Pair<'s, Rule>> {
        self.peek()?;
        self.pairs.next()
    }

    /// The next child, which the grammar guarantees.
    pub(super) fn one(&mut self) -> Pair<'s, Rule> {
        self.any().expect("internal: the grammar promises a child here")
    }

    /// The next child, which the grammar guarantees to be of this rule.
    pub(super) fn need(&mut self, rule: Rule) -> Pair<'s, Rule> {
        self.take(rule).unwrap_or_else(|| panic!("internal: the grammar promises {rule:?} here"))
    }

    /// The next child as a name.
    pub(super) fn name(&mut self) -> Name {
        name(&self.need(Rule::name))
    }

    /// The children of this rule that come next.
    pub(super) fn all(&mut self, rule: Rule) -> Vec<Pair<'s, Rule>> {
        std::iter::from_fn(|| self.take(rule)).collect()
    }

    /// The names that come next.
    pub(super) fn names(&mut self) -> Vec<Name> {
        self.all(Rule::name).iter().map(name).collect()
    }
}

/// The name in a pair.
pub(super) fn name(pair: &Pair<'_, Rule>) -> Name {
    Name { at: at(pair), text: unquoted(pair.as_str()).into_owned() }
}

/// The span of a pair, up to the end of its last token.
pub(super) fn at(pair: &Pair<'_, Rule>) -> At {
    At(Span::new(pair.as_span().start(), end(pair)))
}

fn end(pair: &Pair<'_, Rule>) -> usize {
    match pair.clone().into_inner().next_back() {
        Some(last) => end(&last),
        None => pair.as_span().end(),
    }
}

fn is_mark(rule: Rule) -> bool {
    use Rule::*;
    matches!(
        rule,
        open_brace
            | close_brace
            | open_paren
            | close_paren
            | open_bracket
            | close_bracket
            | semicolon
            | colon
            | comma
            | bar
            | equal
            | arrow
            | dots
            | dot
            | caret
            | minus
            | probability
            | one
            | EOI
            | kw_program
            | kw_over
            | kw_in
            | kw_parameters
            | kw_variables
            | kw_decomposition
            | kw_forms
            | kw_identification
            | kw_question
            | kw_except
            | kw_or
            | kw_initial
            | kw_prod
            | kw_let
            | kw_if
            | kw_else
            | kw_match
            | kw_table
            | kw_previous
            | kw_ask
            | kw_from
            | kw_by
            | kw_hidden
            | kw_nearest
            | kw_virtual
            | kw_soft
            | kw_not
            | kw_first
            | kw_with
            | kw_at
    )
}
