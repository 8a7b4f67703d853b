//! A derivation for a paper.
//!
//! In: a plan. Out: an `align*` environment, which needs amsmath alone. Invariant: what comes from a program is escaped.

use bp_core::model::Model;
use bp_core::plan::{Notation, Plan};
use std::io::{Result, Write};

/// Writes the derivation of a plan; `asked` is the question as a user would type it.
pub(crate) fn write(model: &Model, plan: &Plan, asked: &str, out: &mut impl Write) -> Result<()> {
    writeln!(out, "% program {}: {} (amsmath)", model.name, asked)?;
    writeln!(out, "\\begin{{align*}}")?;
    let lines = plan.derivation(model, Notation::Latex);
    for (position, (rule, reason, equation)) in lines.iter().enumerate() {
        writeln!(out, "\\intertext{{{}. {}: {}.}}", position + 1, prose(rule), prose(reason))?;
        let end = if position + 1 < lines.len() { " \\\\" } else { "" };
        writeln!(out, "{}{end}", aligned(equation))?;
    }
    writeln!(out, "\\end{{align*}}")
}

/// An equation with `&` before its own relation, which is not one inside brackets.
fn aligned(equation: &str) -> String {
    let mut depth = 0;
    for (at, character) in equation.char_indices() {
        match character {
            '(' | '{' | '[' => depth += 1,
            ')' | '}' | ']' => depth -= 1,
            '=' | '\\' if depth == 0 && (character == '=' || equation[at..].starts_with("\\propto")) => {
                return format!("{}&{}", &equation[..at], &equation[at..]);
            }
            _ => {}
        }
    }
    format!("& {equation}")
}

/// A sentence, in which names stand between backticks, for LaTeX.
fn prose(text: &str) -> String {
    let mut inside = false;
    let mut prose = String::new();
    for character in text.chars() {
        match character {
            '`' => {
                prose.push_str(if inside { "}" } else { "\\texttt{" });
                inside = !inside;
            }
            '_' | '{' | '}' | '&' | '%' | '#' | '$' => prose.extend(['\\', character]),
            '^' => prose.push_str("\\^{}"),
            '|' | '<' | '>' | '=' => prose.extend(['$', character, '$']),
            '−' => prose.push_str("$-$"),
            'Σ' => prose.push_str("$\\Sigma$"),
            'λ' => prose.push_str("$\\lambda$"),
            'ᵀ' => prose.push_str("$^{\\top}$"),
            '⁻' => prose.push_str("$^{-}$"),
            '¹' => prose.push_str("$^{1}$"),
            _ => prose.push(character),
        }
    }
    prose
}
