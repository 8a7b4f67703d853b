//! `bp draw`: the network of a program.
//!
//! In: a program, optionally a question. Out: SVG, or text for Graphviz. Invariant: the picture needs no other file.

use crate::failure::Failure;
use crate::{output, program};
use bp_core::compiler::draw::graph;
use std::io::Write;
use std::path::PathBuf;

/// Draw the network of a program.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  bp draw wet_grass.bp --out wet_grass.svg
  bp draw wet_grass.bp 'P(Rain | Wet = true)' > wet_grass.svg
  bp draw cell.bp state --dot | dot -Tpdf > cell.pdf    (Graphviz)

Ellipses are variables, diamonds are variables determined by a Dirac, and dashed
nodes belong to the previous instant. A rounded box is a plate or a family: it is
repeated for each value of its index. With a question, known variables are
shaded, and searched variables have a double outline.")]
pub(crate) struct Arguments {
    /// A program; `-` is stdin.
    file: PathBuf,
    /// A question, or the name of a declared one: its known and searched variables are marked.
    question: Option<String>,
    /// Write DOT, the language of Graphviz.
    #[arg(long)]
    dot: bool,
    /// Write to this file instead of stdout.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Limit of variables: the time of the layout is quadratic.
const MOST_NODES: usize = 20_000;

pub(crate) fn run(arguments: &Arguments, out: &mut impl Write) -> Result<(), Failure> {
    let mut network = program::network(&arguments.file, program::format_of(&arguments.file)?)?;
    let question = match &arguments.question {
        Some(typed) => program::questions(&mut network, Some(typed))?.pop(),
        None => None,
    };
    let nodes = network.model.variables.len();
    if nodes > MOST_NODES && !arguments.dot {
        return Err(Failure::Words(format!(
            "a picture of {nodes} variables is more than anybody sees; at most {MOST_NODES} are drawn: `--dot` writes \
             the network for other tools"
        )));
    }
    let graph = graph(&network.model, question.as_ref());
    let page = if arguments.dot { graph.dot() } else { graph.svg() };
    output::write(arguments.out.as_deref(), page.as_bytes(), out)
}
