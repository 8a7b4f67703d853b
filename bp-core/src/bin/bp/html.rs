//! The HTML page of a program: its text, its network, the derivation of each answer, and its cost.
//!
//! In: a model, its text, plans. Out: one self-contained HTML page without scripts. Invariant: the page is well-formed
//! XML too; text from a program is never markup.
//!
//! Mathematics is MathML Core, which browsers render. A line of it is split at the blanks of the notation, and each
//! piece is a `math` element, so that a long equation breaks like text.

use crate::explain::{asked, derived, routes};
use crate::{cost, highlight, parameters};
use bp_core::compiler::draw::graph;
use bp_core::compiler::model::{Model, Question};
use bp_core::compiler::plan::{Marked, Notation, Plan};
use bp_core::compiler::xml::{escaped, pieces};
use std::borrow::Cow;
use std::io::{Result, Write};

/// The style sheet.
const STYLE: &str = include_str!("page.css");

/// Writes the page.
pub(crate) fn write(
    model: &Model,
    text: &str,
    plans: &[(Cow<'_, Model>, Plan)],
    forms: bool,
    out: &mut impl Write,
) -> Result<()> {
    let name = escaped(&model.name);
    writeln!(out, "<!DOCTYPE html>")?;
    writeln!(out, "<html xmlns=\"http://www.w3.org/1999/xhtml\" lang=\"en\">")?;
    writeln!(out, "<head><meta charset=\"utf-8\"/><title>Program {name}</title>")?;
    writeln!(out, "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>")?;
    writeln!(out, "<style>\n{STYLE}</style></head>\n<body><main>")?;
    writeln!(out, "<h1>{name}</h1>")?;
    let documentation = model.documentation.trim();
    for paragraph in documentation.split("\n\n").filter(|paragraph| !paragraph.trim().is_empty()) {
        writeln!(out, "<p class=\"documentation\">{}</p>", escaped(paragraph))?;
    }
    if plans.len() != 1 {
        figure(model, None, out)?;
    }
    writeln!(out, "<h2>The program</h2>\n<pre>{}</pre>", highlight::highlighted(text.trim()))?;
    writeln!(out, "<p>{}.</p>", prose(&sentence(&parameters::in_words(model, None))))?;
    for (model, plan) in plans {
        answer(model, plan, plans.len() == 1, forms, out)?;
    }
    writeln!(out, "</main></body>\n</html>")
}

fn answer(model: &Model, plan: &Plan, alone: bool, forms: bool, out: &mut impl Write) -> Result<()> {
    let name = match plan.question.name.as_str() {
        "" => String::new(),
        name => format!("{}: ", escaped(name)),
    };
    writeln!(out, "<section>\n<h2>{name}<code>{}</code></h2>", escaped(&asked(model, &plan.question)))?;
    figure(model, Some(&plan.question), out)?;
    writeln!(out, "<h3>{}</h3>", if alone { "The derivation" } else { "Its derivation" })?;
    steps(model, plan, forms, out)?;
    writeln!(out, "<h3>Computation</h3>")?;
    computed(model, plan, out)?;
    for Marked { product, mark, reason } in plan.marks(model, Notation::MathMl) {
        writeln!(out, "<p>Range of numbers: {}, {}:</p>", mark.word(), prose(&reason))?;
        writeln!(out, "{}", mathematics(&product))?;
    }
    for table in cost::tables(model, plan) {
        writeln!(out, "<table>\n<thead><tr>")?;
        cost::HEADINGS.iter().try_for_each(|heading| write!(out, "<th>{heading}</th>"))?;
        writeln!(out, "</tr></thead>\n<tbody>")?;
        for row in cost::cells(&table) {
            write!(out, "<tr>")?;
            row.iter().try_for_each(|cell| write!(out, "<td>{}</td>", escaped(cell)))?;
            writeln!(out, "</tr>")?;
        }
        writeln!(
            out,
            "</tbody>\n<tfoot><tr><td colspan=\"6\">In all: {}.</td></tr></tfoot></table>",
            cost::in_all(&table)
        )?;
    }
    writeln!(out, "</section>")
}

/// The steps of a derivation, as a list.
pub(crate) fn steps(model: &Model, plan: &Plan, forms: bool, out: &mut impl Write) -> Result<()> {
    writeln!(out, "<ol>")?;
    for (rule, reason, equation) in derived(model, plan, forms, Notation::MathMl) {
        writeln!(
            out,
            "<li><p><span class=\"rule\">{}.</span> {}.</p>\n{}</li>",
            escaped(&sentence(&rule)),
            prose(&sentence(&reason)),
            mathematics(&equation)
        )?;
    }
    writeln!(out, "</ol>")
}

/// The equation that is computed, and the route.
pub(crate) fn computed(model: &Model, plan: &Plan, out: &mut impl Write) -> Result<()> {
    for equation in plan.computed(model, Notation::MathMl) {
        writeln!(out, "{}", mathematics(&equation))?;
    }
    writeln!(out, "<p>The route is {}.</p>", prose(&routes(plan)))
}

/// Limit of variables of a picture in a page.
const MOST_NODES: usize = 2000;

/// The network, with the known and searched variables of a question marked.
fn figure(model: &Model, question: Option<&Question>, out: &mut impl Write) -> Result<()> {
    if model.variables.len() > MOST_NODES {
        let nodes = model.variables.len();
        return writeln!(out, "<p>The network has {nodes} variables, too many for a picture.</p>");
    }
    let graph = graph(model, question);
    let mut signs = Vec::new();
    if question.is_some() {
        signs.push("a double outline is searched, shaded is known");
    }
    if graph.nodes.iter().any(|node| node.deterministic) {
        signs.push("a diamond has a Dirac form");
    }
    if graph.nodes.iter().any(|node| node.previous) {
        signs.push("dashed is the previous instant");
    }
    if graph.over.is_some() || !graph.plates.is_empty() {
        signs.push("a box is repeated for each value of its index");
    }
    let signs = match signs.is_empty() {
        true => String::new(),
        false => format!(": {}", signs.join("; ")),
    };
    writeln!(out, "<figure>\n{}<figcaption>The network{signs}.</figcaption></figure>", graph.svg())
}

/// A line of mathematics in pieces, between which it can break.
fn mathematics(equation: &str) -> String {
    let pieces = pieces(equation);
    let pieces: Vec<_> =
        pieces.iter().map(|piece| format!("<math displaystyle=\"true\">{piece}</math>")).collect();
    format!("<div class=\"equation\">{}</div>", pieces.join(" "))
}

/// A sentence with names in backticks.
fn prose(text: &str) -> String {
    let parts = text.split('`').enumerate().map(|(position, part)| match position % 2 {
        0 => escaped(part),
        _ => format!("<code>{}</code>", escaped(part)),
    });
    parts.collect()
}

/// A text with a capital initial; a name stays as it is, and so does a symbol, which is one letter (but `a` is an article).
fn sentence(text: &str) -> String {
    let mut characters = text.chars();
    match characters.next() {
        Some(symbol) if symbol != 'a' && characters.as_str().starts_with(' ') => text.to_owned(),
        Some(first) => first.to_uppercase().chain(characters).collect(),
        None => String::new(),
    }
}
