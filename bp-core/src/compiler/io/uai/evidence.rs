//! Evidence files of UAI.
//!
//! In: a text of indices. Out: the evidence, case by case. Invariant: every index exists in the model.
//!
//! `2 0 1 3 0`: two variables are known, 0 has value 1, 3 has value 0. Newer files begin with the number of cases.

use super::read::UAI;
use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::ids::{Id, VariableId};
use crate::io::lexer::{Lexer, Token, unexpected};
use crate::model::{Finding, Known, Model, Value};
use crate::source::{Source, Span};
use std::collections::HashSet;
use std::fmt::Write;

/// Reads the cases of an evidence file.
pub fn evidence(source: &Source, model: &Model) -> Result<Vec<Vec<Known>>, Diagnostics> {
    let mut lexer = Lexer::new(&source.text, &UAI);
    let mut numbers: Vec<(usize, Span)> = Vec::new();
    loop {
        match lexer.next()? {
            (Token::End, _) => break,
            (Token::Word(word), span) => {
                let number =
                    word.parse().map_err(|_| unexpected(span, Token::Word(word), "a whole number"))?;
                numbers.push((number, span));
            }
            (found, span) => return Err(unexpected(span, found, "a whole number").into()),
        }
    }
    let Some(((first, _), rest)) = numbers.split_first() else { return Ok(Vec::new()) };
    // A file without the number of cases has one case.
    let alone = first.checked_mul(2) == Some(rest.len());
    let (cases, mut rest) = if alone { (1, numbers.as_slice()) } else { (*first, rest) };
    let mut read = Vec::new();
    for _ in 0..cases {
        let end = Span::new(source.text.len(), source.text.len());
        let Some(((count, span), after)) = rest.split_first() else {
            return Err(Diagnostic::new(
                end,
                format!("{cases} cases are declared, but there are {}", read.len()),
            )
            .into());
        };
        let Some(pairs) = count.checked_mul(2).and_then(|length| after.get(..length)) else {
            let message = format!("{count} variables are declared, but there are fewer");
            return Err(Diagnostic::new(*span, message).into());
        };
        rest = &after[pairs.len()..];
        let case: Vec<Known> =
            pairs.as_chunks().0.iter().map(|pair| known(model, *pair)).collect::<Result<_, _>>()?;
        let mut seen = HashSet::new();
        if let Some(twice) = case.iter().position(|known| !seen.insert(known.variable)) {
            let (variable, span) = pairs[2 * twice];
            return Err(Diagnostic::new(span, format!("variable {variable} is known twice")).into());
        }
        read.push(case);
    }
    match rest.first() {
        None => Ok(read),
        Some((_, span)) => {
            Err(Diagnostic::new(*span, "expected the end of the file after the last case").into())
        }
    }
}

fn known(model: &Model, [(variable, at), (ordinal, there)]: [(usize, Span); 2]) -> Result<Known, Diagnostic> {
    if variable >= model.variables.len() {
        let message = format!("unknown variable {variable}: there are {}", model.variables.len());
        return Err(Diagnostic::new(at, message));
    }
    let id = VariableId::new(variable);
    match model.variables[id].domain.count() {
        Some(count) if ordinal < count => {
            Ok(Known { variable: id, evidence: Finding::Hard(Value::Ordinal(ordinal)) })
        }
        count => {
            let message = format!(
                "variable {variable} has {} values, and {ordinal} is not one of them",
                count.unwrap_or(0)
            );
            Err(Diagnostic::new(there, message))
        }
    }
}

/// The text of cases; entries that are not values of a variable are omitted.
pub fn evidence_text(cases: &[Vec<Known>]) -> String {
    let mut text = format!("{}\n", cases.len());
    for case in cases {
        let pairs: Vec<String> = (case.iter())
            .filter_map(|known| match known.evidence {
                Finding::Hard(Value::Ordinal(ordinal)) => {
                    Some(format!(" {} {ordinal}", known.variable.position()))
                }
                _ => None,
            })
            .collect();
        let _ = writeln!(text, "{}{}", pairs.len(), pairs.concat());
    }
    text
}
