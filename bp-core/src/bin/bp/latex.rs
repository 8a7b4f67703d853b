//! A derivation in LaTeX.
//!
//! In: a plan. Out: an `align*` environment, which needs only amsmath, or a complete document. Invariant: text from a
//! program is escaped; a line wider than the page breaks between factors.

use crate::cost::{self, Table};
use bp_core::compiler::latex::escaped;
use bp_core::compiler::model::Model;
use bp_core::compiler::plan::{Notation, Plan};
use std::io::{Result, Write};

/// Characters of a line on a page, approximately.
const LINE: usize = 80;

/// The beginning of a document.
const PREAMBLE: &str = "\\documentclass{article}
\\usepackage[T1]{fontenc}
\\usepackage[utf8]{inputenc}
\\usepackage[margin=25mm]{geometry}
\\usepackage{amsmath}
\\allowdisplaybreaks
";

/// Opens a document on a program.
pub(crate) fn open(model: &Model, out: &mut impl Write) -> Result<()> {
    writeln!(out, "{PREAMBLE}\\begin{{document}}")?;
    writeln!(out, "\\section*{{Program {}}}", escaped(&model.name))?;
    match model.documentation.trim() {
        "" => Ok(()),
        documentation => writeln!(out, "{}\n", escaped(documentation)),
    }
}

/// Closes it.
pub(crate) fn close(out: &mut impl Write) -> Result<()> {
    writeln!(out, "\\end{{document}}")
}

/// Writes a heading on a question.
pub(crate) fn heading(asked: &str, out: &mut impl Write) -> Result<()> {
    writeln!(out, "\\subsection*{{\\texttt{{{}}}}}", escaped(asked))
}

/// Writes a paragraph with names in backticks.
pub(crate) fn paragraph(text: &str, out: &mut impl Write) -> Result<()> {
    writeln!(out, "\\noindent {}.\n", prose(text))
}

/// Text, followed by a line of mathematics.
pub(crate) fn paragraph_with(text: &str, equation: &str, out: &mut impl Write) -> Result<()> {
    writeln!(out, "\\noindent {}: ${equation}$.\n", prose(text))
}

/// Writes the derivation of a plan; `asked` is the question as a user would type it.
pub(crate) fn write(model: &Model, plan: &Plan, asked: &str, out: &mut impl Write) -> Result<()> {
    writeln!(out, "% program {}: {} (amsmath)", model.name, asked.replace('\n', " "))?;
    writeln!(out, "\\begin{{align*}}")?;
    let lines = plan.derivation(model, Notation::Latex);
    for (position, (rule, reason, equation)) in lines.iter().enumerate() {
        writeln!(out, "\\intertext{{{}. {}: {}.}}", position + 1, prose(rule), prose(reason))?;
        let end = if position + 1 < lines.len() { " \\\\" } else { "" };
        writeln!(out, "{}{end}", broken(&aligned(equation)))?;
    }
    writeln!(out, "\\end{{align*}}")
}

/// Writes the cost of an answer as a table.
pub(crate) fn cost(table: &Table, out: &mut impl Write) -> Result<()> {
    writeln!(out, "\\begin{{center}}\\begin{{tabular}}{{llrrrr}}\\hline")?;
    writeln!(out, "{} \\\\ \\hline", cost::HEADINGS.join(" & "))?;
    for row in cost::cells(table) {
        writeln!(out, "{} \\\\", row.map(|cell| escaped(&cell).replace('–', "--")).join(" & "))?;
    }
    writeln!(out, "\\hline\\end{{tabular}}\\end{{center}}")?;
    paragraph(&format!("In all: {}", cost::in_all(table)), out)
}

/// An equation with `&` before its relation, outside brackets.
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

/// An equation in lines, broken before a factor: at a blank outside braces and distributions.
fn broken(equation: &str) -> String {
    let (mut lines, mut line, mut piece) = (String::new(), 0, String::new());
    let mut braces = 0;
    let mut open: Vec<bool> = Vec::new();
    let mut pieces = Vec::new();
    for character in equation.chars() {
        match character {
            '{' => braces += 1,
            '}' => braces -= 1,
            // A `P(…)` is never broken; other brackets may be.
            '(' => open.push(piece.ends_with(|before: char| before.is_alphanumeric() || before == '}')),
            ')' => drop(open.pop()),
            _ => {}
        }
        // A sum sign stays with its first factor.
        let word = piece.rsplit([' ', '(']).next().unwrap_or("");
        let sign = ["\\sum", "\\prod", "\\int"].iter().any(|sign| word.starts_with(sign));
        match character == ' ' && braces == 0 && !open.contains(&true) && !sign {
            true => pieces.push(std::mem::take(&mut piece)),
            false => piece.push(character),
        }
    }
    pieces.push(piece);
    for (position, piece) in pieces.iter().enumerate() {
        let width = printed(piece);
        if line > 0 && line + width > LINE && !piece.is_empty() && position > 2 {
            lines.push_str(" \\\\\n&\\quad ");
            line = 2;
        } else if position > 0 {
            lines.push(' ');
        }
        lines.push_str(piece);
        line += width + 1;
    }
    lines
}

/// Approximate printed length of a piece.
fn printed(piece: &str) -> usize {
    let (mut width, mut command) = (0, false);
    for character in piece.chars() {
        command = character == '\\' || command && character.is_alphabetic();
        width += usize::from(!command && !matches!(character, '{' | '}' | '_' | '^' | ' ' | '&'));
    }
    width
}

/// A sentence with names in backticks, for LaTeX.
fn prose(text: &str) -> String {
    let parts = text.split('`').enumerate().map(|(position, part)| match position % 2 {
        0 => escaped(part),
        _ => format!("\\texttt{{{}}}", escaped(part)),
    });
    parts.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lines_break_between_factors() {
        let long = format!("P(A) &= {}P(Z)", "P(\\mathit{Weather} \\mid \\mathit{Wind}) ".repeat(9));
        let lines: Vec<String> = broken(&long).split(" \\\\\n&\\quad ").map(str::to_owned).collect();
        assert_eq!(lines.len(), 3);
        assert_eq!(lines.join(" "), long, "nothing is lost");
        assert!(lines.iter().all(|line| printed(line) <= LINE), "{lines:?}");
        assert!(lines[1..].iter().all(|line| line.starts_with("P(")), "{lines:?}");
        assert_eq!(broken("P(A) &= P(B)"), "P(A) &= P(B)");
        // Not between a sum and its first factor, nor inside a distribution.
        let sums = format!(
            "P(A) &= {}P(Z)",
            "\\sum_{X} P(\\mathit{Weather} = \\text{fair} \\mid \\mathit{Wind}) ".repeat(9)
        );
        let lines: Vec<String> = broken(&sums).split(" \\\\\n&\\quad ").map(str::to_owned).collect();
        assert!(
            lines.len() > 2 && lines[1..].iter().all(|line| line.starts_with("\\sum_{X} P(")),
            "{lines:?}"
        );
        assert!(lines.iter().all(|line| line.matches('(').count() == line.matches(')').count()), "{lines:?}");
    }

    #[test]
    fn names_between_backticks() {
        assert_eq!(prose("`a_b` is 50%"), "\\texttt{a\\_b} is 50\\%");
    }
}
