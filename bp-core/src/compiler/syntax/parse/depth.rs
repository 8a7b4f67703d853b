//! A limit on nesting, checked before any recursion.
//!
//! In: the text. Out: nothing, or the span that is nested too deeply. Invariant: an accepted text can be parsed,
//! printed, checked and dropped within a thread's usual stack, because every recursion of the grammar goes through a
//! bracket, and every chain that makes a tree deep is counted with the brackets around it.

use super::comments;
use crate::diagnostic::Diagnostic;
use crate::source::Span;

/// Limit of open brackets.
const BRACKETS: usize = 48;
/// Limit of operators in a chain, including those around the open brackets.
const OPERATORS: usize = 512;

/// Rejects a text that nests too deeply.
pub(super) fn check(text: &str) -> Result<(), Diagnostic> {
    let mut hidden = comments::hidden(text).peekable();
    // For each open bracket, the number of operators before it in its expression.
    let mut open: Vec<usize> = Vec::new();
    let mut chain = 0;
    let mut sum = 0;
    let mut before = ' ';
    let mut word = 0;
    let mut end = 0;
    for (position, character) in text.char_indices() {
        if position < end {
            continue;
        }
        if hidden.peek().is_some_and(|span| span.start == position) {
            end = hidden.next().map_or(0, |span| span.end);
            before = ' ';
            continue;
        }
        if !(character.is_alphanumeric() || character == '_') {
            if matches!(&text[word..position], "and" | "or" | "not" | "let" | "else") {
                chain += 1;
            }
            word = position + character.len_utf8();
        }
        match character {
            '(' | '[' | '{' => {
                chain += usize::from(before == ']');
                open.push(chain);
                sum += chain;
                chain = 0;
            }
            ')' | ']' | '}' => {
                chain = open.pop().unwrap_or(0);
                sum -= chain.min(sum);
            }
            ';' | ',' => chain = 0,
            '+' | '-' | '*' | '/' | '<' | '>' | '!' | '^' | '.' => chain += 1,
            '=' => chain += usize::from(before == '='),
            _ => {}
        }
        let here = Span::new(position, position + character.len_utf8());
        if open.len() > BRACKETS {
            return Err(Diagnostic::new(here, format!("more than {BRACKETS} brackets are open here"))
                .with_help("give the inner part a name with `let`, or a variable of its own"));
        }
        if sum + chain > OPERATORS {
            return Err(Diagnostic::new(
                here,
                format!("an expression may hold at most {OPERATORS} operators"),
            )
            .with_help("give a part of it a name with `let`, or a variable of its own"));
        }
        if !character.is_whitespace() {
            before = character;
        }
    }
    Ok(())
}
