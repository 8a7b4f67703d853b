//! `bp print`: the Bayesian Program in the brace layout of the formalism.
//!
//! In: a program, which may be unfinished. Out: its parts as text, SVG, HTML or LaTeX, with its network. Invariant:
//! what is missing is listed; only a text that cannot be read as a program is an error.

use crate::failure::Failure;
use crate::{latex, output, page, program};
use bp_core::compiler::io::{self, Format};
use bp_core::compiler::plan::Notation;
use bp_core::compiler::print::{document, fragment, page as sheet_page, sheets};
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::parse;
use std::io::Write;
use std::path::PathBuf;

/// Print a program in the brace layout of the formalism, with its network.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  bp print wet_grass.bp
  bp print wet_grass.bp --svg --out wet_grass.svg
  bp print wet_grass.bp --html --out wet_grass.html
  bp print wet_grass.bp --latex > wet_grass.tex    (\\input in a figure)
  bp print wet_grass.bp --latex --standalone --out figure.tex
  bp print wet_grass.bp --interactive --out wet_grass.html
  bp print alarm.bif 'P(CVP | HR = HIGH)' --interactive --out alarm.html

Program { Description { Specification { Relevant variables, Decomposition, Forms },
Identification }, Question }. An unfinished program prints what there is, and
lists what is missing. The LaTeX needs amsmath, amssymb and graphicx. The page
of --interactive has sliders and menus for the evidence and the parameters of
each question; it computes the answers itself and needs no network.")]
pub(crate) struct Arguments {
    /// A program; `-` is stdin.
    file: PathBuf,
    /// With --interactive: a question, or the name of a declared one; all declared questions if left out.
    #[arg(requires = "interactive")]
    question: Option<String>,
    /// Write a figure for LaTeX.
    #[arg(long, conflicts_with_all = ["html", "svg"])]
    latex: bool,
    /// With --latex: write a complete document, each program on a page of its own size.
    #[arg(long, requires = "latex")]
    standalone: bool,
    /// Write a self-contained HTML page.
    #[arg(long, conflicts_with = "svg")]
    html: bool,
    /// Write a picture as SVG; of several programs the last.
    #[arg(long)]
    svg: bool,
    /// Write a self-contained HTML page whose answers follow sliders and menus.
    #[arg(long, conflicts_with_all = ["html", "svg", "latex"])]
    interactive: bool,
    /// Write to this file instead of stdout.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments, out: &mut impl Write) -> Result<(), Failure> {
    if arguments.interactive {
        let page = page::exported(&arguments.file, arguments.question.as_deref())?;
        return output::write(arguments.out.as_deref(), page.as_bytes(), out);
    }
    let source = match program::format_of(&arguments.file)? {
        Format::Program => program::read(&arguments.file)?,
        other => {
            let text = io::shown(&program::network(&arguments.file, other)?.model)?;
            Source::new(arguments.file.display().to_string(), text)
        }
    };
    let file = match parse(&source) {
        Ok(file) => file,
        Err(wrong) => return Err(Failure::Wrong(wrong, source)),
    };
    let notation = match (arguments.latex, arguments.html) {
        (true, _) => Notation::Latex,
        (_, true) => Notation::MathMl,
        _ => Notation::Unicode,
    };
    let sheets = sheets(&file, notation);
    let shown = if arguments.standalone {
        let document = document(&sheets);
        latex::check(&document)?;
        document
    } else if arguments.latex {
        sheets.iter().map(fragment).collect::<Vec<_>>().join("\n")
    } else if arguments.html {
        sheet_page(&sheets)
    } else if arguments.svg {
        sheets.last().map(|sheet| sheet.svg()).unwrap_or_default()
    } else {
        sheets.iter().map(|sheet| sheet.text()).collect::<Vec<_>>().join("\n")
    };
    output::write(arguments.out.as_deref(), shown.as_bytes(), out)
}
