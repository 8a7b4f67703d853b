//! The Bayesian Program in the brace layout of the formalism, for a terminal, a browser and a paper.
//!
//! In: the tree of a program, which may be unfinished. Out: a [`Sheet`], which prints as text, SVG, HTML and LaTeX.
//! Invariant: every declaration, factor, form and question of the program is shown; what is missing is listed.
//!
//! Bessière, Mazer, Ahuactzin and Mekhnacha, *Bayesian Programming*, CRC 2013: Program { Description { Specification {
//! Relevant variables, Decomposition, Forms }, Identification }, Question }.

mod forms;
mod html;
mod latex;
mod network;
mod svg;
mod terminal;
mod variables;

use crate::diagnostic::Diagnostics;
use crate::draw::{Graph, graph};
use crate::equation::Notation;
use crate::model::Model;
use crate::syntax::ast::{Factor, File, FormKind, Learnt, Program, SectionKind, Term};
use crate::syntax::check;

pub use html::{page, sections};
pub use latex::{document, fragment};

/// A line of a sheet.
#[derive(Clone, PartialEq, Debug)]
pub struct Line {
    /// How far it is indented.
    pub depth: usize,
    /// Mathematics, in the notation of the sheet.
    pub mathematics: String,
}

/// A part of a sheet.
#[derive(Clone, PartialEq, Debug)]
pub enum Part {
    /// A name before a brace that holds other parts.
    Brace(&'static str, Vec<Part>),
    /// A title with lines.
    Lines(&'static str, Vec<Line>),
}

/// A program in the parts of the formalism.
#[derive(Clone, PartialEq, Debug)]
pub struct Sheet {
    /// The name of the program.
    pub name: String,
    /// Its documentation.
    pub documentation: String,
    /// Program { Description { Specification { … }, Identification }, Question }.
    pub whole: Part,
    /// What is missing or wrong; empty for a finished program.
    pub missing: Vec<String>,
    /// Its network.
    pub network: Graph,
    notation: Notation,
}

/// The programs of a file in a notation. An unfinished program has the parts that there are.
pub fn sheets(file: &File, notation: Notation) -> Vec<Sheet> {
    let checked = check(file);
    (file.programs.iter().enumerate())
        .map(|(position, program)| {
            let model = checked.as_ref().ok().map(|models| &models[position]);
            sheet(program, model, missing(program, checked.as_ref().err()), notation)
        })
        .collect()
}

/// The errors within a program, and its missing sections.
fn missing(program: &Program, wrong: Option<&Diagnostics>) -> Vec<String> {
    let span = program.at.0;
    let inside = wrong
        .into_iter()
        .flat_map(Diagnostics::iter)
        .filter(|wrong| wrong.span.start >= span.start && wrong.span.end <= span.end);
    let mut missing: Vec<String> = inside.map(|wrong| wrong.message.clone()).collect();
    if !program.sections.iter().any(|section| matches!(section.kind, SectionKind::Question { .. })) {
        missing.push("no question is declared; any question can be asked".to_owned());
    }
    missing
}

fn sheet(program: &Program, model: Option<&Model>, missing: Vec<String>, notation: Notation) -> Sheet {
    let network = model.map_or_else(|| network::of_tree(program), |model| graph(model, None));
    let specification = Part::Brace(
        "Specification",
        vec![
            Part::Lines("Relevant variables", variables::variables(program, notation)),
            Part::Lines("Decomposition", decomposition(program, notation)),
            Part::Lines("Forms", forms::forms(program, notation)),
        ],
    );
    let description = Part::Brace(
        "Description",
        vec![specification, Part::Lines("Identification", identification(program, notation))],
    );
    let whole =
        Part::Brace("Program", vec![description, Part::Lines("Question", questions(program, notation))]);
    Sheet {
        name: program.name.text.clone(),
        documentation: program.comments.documentation(),
        whole,
        missing,
        network,
        notation,
    }
}

impl Line {
    fn new(depth: usize, mathematics: impl Into<String>) -> Self {
        Self { depth, mathematics: mathematics.into() }
    }

    /// A line of words.
    fn words(notation: Notation, words: &str) -> Self {
        Self::new(0, text(notation, words))
    }
}

/// Words in mathematics, which may be broken between them.
fn text(notation: Notation, words: &str) -> String {
    match notation {
        Notation::Unicode => words.to_owned(),
        Notation::Latex => {
            let each = words.split(' ').map(|word| format!("\\text{{{}}}", crate::latex::escaped(word)));
            each.collect::<Vec<_>>().join("\\ ")
        }
        Notation::MathMl => {
            let each = words.split(' ').map(|word| format!("<mtext>{}</mtext>", crate::xml::escaped(word)));
            each.collect::<Vec<_>>().join("<mspace width=\"0.27em\"/> ")
        }
    }
}

/// The joint distribution as the product of the factors.
fn decomposition(program: &Program, notation: Notation) -> Vec<Line> {
    let terms: Vec<&Term> = (program.sections.iter())
        .filter_map(|section| match &section.kind {
            SectionKind::Decomposition(terms) => Some(terms),
            _ => None,
        })
        .flatten()
        .collect();
    if terms.is_empty() {
        return vec![Line::words(notation, "none yet")];
    }
    let mut all = variables::names(program, notation);
    all.extend(distributed_index(program, &terms).map(|index| notation.word(index)));
    let shown: Vec<String> = terms.iter().map(|term| term_of(term, notation)).collect();
    let blank = notation.choose(" ", " ", "<mspace width=\"0.15em\"/> ");
    vec![
        Line::new(0, notation.distribution(&all, &[])),
        Line::new(1, format!("{} {}", notation.choose("=", "{} =", "<mo>=</mo>"), shown.join(blank))),
    ]
}

/// The index of the plate, if a factor distributes it.
fn distributed_index<'p>(program: &'p Program, terms: &[&Term]) -> Option<&'p str> {
    let index = program.plate.as_ref()?.index.text.as_str();
    let mut found = false;
    terms.iter().for_each(|term| {
        each_factor(term, &mut |factor| found |= factor.left.iter().any(|one| one.name.text == index));
    });
    found.then_some(index)
}

/// Calls `visit` with each factor of a term.
fn each_factor<'t>(term: &'t Term, visit: &mut impl FnMut(&'t Factor)) {
    match term {
        Term::Factor(factor) => visit(factor),
        Term::Product(product) => product.terms.iter().for_each(|term| each_factor(term, visit)),
    }
}

/// The factors of a program.
fn factors(program: &Program) -> Vec<&Factor> {
    let mut found = Vec::new();
    for section in &program.sections {
        if let SectionKind::Decomposition(terms) = &section.kind {
            terms.iter().for_each(|term| each_factor(term, &mut |factor| found.push(factor)));
        }
    }
    found
}

fn term_of(term: &Term, notation: Notation) -> String {
    match term {
        Term::Factor(factor) => notation.typeset(&factor.to_string()),
        Term::Product(product) => {
            let index = notation.word(&product.index.text);
            let over = match &product.space {
                None => index,
                Some(space) => notation.relation(&index, "∈", &variables::space(space, notation)),
            };
            let terms: Vec<String> = product.terms.iter().map(|term| term_of(term, notation)).collect();
            let body = terms.join(notation.choose(" ", " ", "<mspace width=\"0.15em\"/> "));
            let body = if terms.len() > 1 { notation.group(&body) } else { body };
            format!("{}{body}", notation.product_over(&over))
        }
    }
}

fn identification(program: &Program, notation: Notation) -> Vec<Line> {
    let mut lines = Vec::new();
    for section in &program.sections {
        match &section.kind {
            SectionKind::Identification(list) => {
                lines.extend(list.iter().map(|learnt| Line::new(0, learnt_of(learnt, notation))));
            }
            SectionKind::Forms(definitions) => {
                for definition in definitions {
                    if matches!(&definition.form.kind, FormKind::Named { name, .. } if name.text == "unknown")
                    {
                        let head = notation.typeset(&definition.head.to_string());
                        let words = text(notation, "is learned from data");
                        lines.push(Line::new(0, format!("{head}{}{words}", space(notation))));
                    }
                }
            }
            _ => {}
        }
    }
    lines.extend(expectation(program, notation));
    if lines.is_empty() {
        lines.push(Line::words(notation, "none: the forms are given"));
    }
    lines
}

/// The two steps of expectation maximisation, if variables are declared hidden: q(H) for each case, then the parameters θ.
fn expectation(program: &Program, notation: Notation) -> Vec<Line> {
    let learnt = program.sections.iter().filter_map(|section| match &section.kind {
        SectionKind::Identification(list) => Some(list),
        _ => None,
    });
    let hidden = learnt.flatten().filter(|learnt| learnt.from.is_none());
    let hidden: Vec<String> =
        hidden.flat_map(|learnt| &learnt.names).map(|name| notation.word(&name.text)).collect();
    if hidden.is_empty() {
        return Vec::new();
    }
    let mut all = hidden.clone();
    all.extend(variables::names(program, notation).into_iter().filter(|name| !hidden.contains(name)));
    let theta = notation.word("θ");
    let joint = notation.distribution(&all, std::slice::from_ref(&theta));
    let blank = notation.choose(" ", "\\,", "<mspace width=\"0.25em\"/>");
    let q = format!("{}{}", notation.word("q"), notation.group(&hidden.join(blank)));
    let ln =
        notation.choose(" ln ", " \\ln ", "<mspace width=\"0.17em\"/><mi>ln</mi><mspace width=\"0.17em\"/>");
    let (e, m) = (text(notation, "E step, of each case:"), text(notation, "M step:"));
    let (cases, blank) = (text(notation, "cases"), space(notation));
    let likelihood = format!("{}{}{q}{ln}{joint}", notation.sum(&[cases]), notation.sum(&hidden));
    let best = format!("{}{likelihood}", notation.extremum("argmax", std::slice::from_ref(&theta)));
    vec![
        Line::new(0, format!("{e}{blank}{}", notation.relation(&q, "∝", &joint))),
        Line::new(0, format!("{m}{blank}{}", notation.relation(&theta, "←", &best))),
    ]
}

/// A blank between words and mathematics.
fn space(notation: Notation) -> &'static str {
    notation.choose(" ", "\\ ", "<mspace width=\"0.27em\"/> ")
}

fn learnt_of(learnt: &Learnt, notation: Notation) -> String {
    let list = |names: &[crate::syntax::ast::Name]| {
        let names: Vec<_> = names.iter().map(|name| notation.word(&name.text)).collect();
        names.join(notation.choose(", ", ",\\, ", "<mo separator=\"true\">,</mo> "))
    };
    let blank = space(notation);
    let names = list(&learnt.names);
    let Some(from) = &learnt.from else {
        return format!("{names}{blank}{}", text(notation, "not observed"));
    };
    let from = text(notation, &format!("from the data {}", from.text));
    match learnt.by.as_slice() {
        [] => format!("{names}{blank}{from}"),
        by => format!("{names}{blank}{from}{blank}{}{blank}{}", text(notation, "for each"), list(by)),
    }
}

fn questions(program: &Program, notation: Notation) -> Vec<Line> {
    let mut lines = Vec::new();
    for section in &program.sections {
        let SectionKind::Question { name, asks } = &section.kind else { continue };
        let asks: Vec<String> = asks.iter().map(|ask| notation.typeset(&ask.to_string())).collect();
        let joined = asks.join(notation.choose("; ", ";\\quad ", "<mo separator=\"true\">;</mo> "));
        let blank = space(notation);
        lines.push(Line::new(0, format!("{}{blank}{joined}", text(notation, &format!("{}:", name.text)))));
    }
    if lines.is_empty() {
        lines.push(Line::words(notation, "none yet"));
    }
    lines
}
