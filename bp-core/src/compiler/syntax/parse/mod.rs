//! Text to tree.
//!
//! In: a [`Source`]. Out: the [`ast`](super::ast) of its programs, or the first syntax error. Invariant: for any text
//! there is no panic and no stack overflow.

mod children;
mod comments;
mod depth;
mod expected;
mod expressions;
mod forms;
mod grammar;
mod notations;
mod sections;

use super::ast::{Ask, File};
use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::source::{Source, Span};
use grammar::{Grammar, Rule};
use pest::Parser;
use pest::iterators::Pair;

/// Parses all the programs of a text.
pub fn parse(source: &Source) -> Result<File, Diagnostics> {
    let pair = pair_of(Rule::file, source)?;
    let programs = pair.into_inner().filter(|pair| pair.as_rule() == Rule::program).map(sections::program);
    let mut file = File { programs: programs.collect(), closing: Vec::new() };
    comments::attach(&source.text, &mut file);
    Ok(file)
}

/// Parses the asks of a question that a user types: `P(Rain | Wet = true); entropy P(Rain)`.
pub(super) fn parse_asks(source: &Source) -> Result<Vec<Ask>, Diagnostics> {
    let mut children = children::Children::of(pair_of(Rule::lone_asks, source)?);
    Ok(children.all(Rule::ask).into_iter().map(sections::ask).collect())
}

fn pair_of(rule: Rule, source: &Source) -> Result<Pair<'_, Rule>, Diagnostics> {
    let text = source.text.as_str();
    depth::check(text)?;
    if text.starts_with('\u{feff}') {
        return Err(Diagnostic::new(Span::new(0, 3), "the text starts with a byte order mark")
            .with_help("save the file as UTF-8 without it")
            .into());
    }
    match Grammar::parse(rule, text) {
        Ok(mut pairs) => Ok(pairs.next().expect("internal: a parse holds its own rule")),
        Err(error) => Err(expected::diagnostic(&error, text).into()),
    }
}
