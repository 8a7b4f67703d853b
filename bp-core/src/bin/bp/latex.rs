//! A derivation in LaTeX.
//!
//! In: a plan. Out: paragraphs, which need only amsmath, or a complete document. Invariant: text from a program is
//! escaped; TeX breaks the lines, between the parts of an equation.

use crate::cost::{self, Table};
use crate::explain::derived;
use crate::failure::Failure;
use bp_core::compiler::latex::{breakable, escaped, unset};
use bp_core::compiler::model::Model;
use bp_core::compiler::plan::{Notation, Plan};
use std::io::{Result, Write};

/// The beginning of a document.
const PREAMBLE: &str = "\\documentclass{article}
\\usepackage[utf8]{inputenc}
\\usepackage[margin=25mm]{geometry}
\\usepackage{amsmath,array}
";

/// Refuses a document that pdfLaTeX cannot set.
pub(crate) fn check(document: &str) -> std::result::Result<(), Failure> {
    match unset(document) {
        None => Ok(()),
        Some(word) => Err(Failure::Words(format!(
            "`{word}` has letters for which pdfLaTeX has no font: leave out --standalone, and put the result into a \
             document for XeLaTeX or LuaLaTeX with a font that has them"
        ))),
    }
}

/// Opens a document on a program.
pub(crate) fn open(model: &Model, out: &mut impl Write) -> Result<()> {
    writeln!(out, "{PREAMBLE}\\begin{{document}}\\raggedright")?;
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
    writeln!(out, "\\noindent {}: $\\displaystyle {}$.\n", prose(text), breakable(equation))
}

/// Writes the derivation of a plan; `asked` is the question as a user would type it.
pub(crate) fn write(
    model: &Model,
    plan: &Plan,
    asked: &str,
    forms: bool,
    out: &mut impl Write,
) -> Result<()> {
    writeln!(out, "% program {}: {} (amsmath)", model.name, asked.replace('\n', " "))?;
    writeln!(out, "\\begingroup\\raggedright\\parindent0pt\\lineskiplimit2pt\\lineskip5pt")?;
    for (position, (rule, reason, equation)) in
        derived(model, plan, forms, Notation::Latex).iter().enumerate()
    {
        writeln!(out, "\\textbf{{{}. {}}}: {}.\\par\\nopagebreak", position + 1, prose(rule), prose(reason))?;
        writeln!(
            out,
            "{{\\leftskip2em\\hangindent2em\\hangafter1$\\displaystyle {}$\\par}}\\smallskip",
            breakable(equation)
        )?;
    }
    writeln!(out, "\\endgroup")
}

/// Writes the cost of an answer as a table.
pub(crate) fn cost(table: &Table, out: &mut impl Write) -> Result<()> {
    writeln!(
        out,
        "\\begin{{center}}\\small\\begin{{tabular}}{{>{{\\raggedright}}p{{24mm}}>{{\\raggedright}}p{{33mm}}rrrr}}\\hline"
    )?;
    writeln!(out, "{} \\\\ \\hline", cost::HEADINGS.join(" & "))?;
    for row in cost::cells(table) {
        // A name may be broken after an underscore.
        let cell = |cell: String| escaped(&cell).replace('–', "--").replace("\\_", "\\_\\allowbreak ");
        writeln!(out, "{} \\\\", row.map(cell).join(" & "))?;
    }
    writeln!(out, "\\hline\\end{{tabular}}\\end{{center}}")?;
    paragraph(&format!("In all: {}", cost::in_all(table)), out)
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
    fn names_between_backticks() {
        assert_eq!(prose("`a_b` is 50%"), "\\texttt{a\\_b} is 50\\%");
    }
}
