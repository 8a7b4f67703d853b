//! Tree to model: every name is given its meaning, every expression its type.
//!
//! In: an [`ast::File`]. Out: a [`Model`] for each program, or all errors. The checker checks names, types, and shapes
//! that the model cannot represent; the model validates itself, and its faults are reported at their source. Invariant:
//! an error is reported once: its consequences are not reported.

mod covariances;
mod cover;
mod declarations;
mod decomposition;
mod derived;
mod domains;
mod expressions;
mod faults;
mod foreign;
mod forms;
mod functions;
mod initial;
mod linked_forms;
mod lists;
mod named_forms;
mod operators;
mod patterns;
mod pieces;
mod predicates;
mod questions;
mod quotes;
mod subroutines;
mod tables;
mod types;
mod unknown;
mod words;

use super::ast::{self, File, Name, Program, SectionKind};
use super::parse;
use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::guess as names;
use crate::ids::{ExpressionId, FactorId, ParameterId, QuestionId, SetId, VariableId};
use crate::model::{Model, ModelBuilder, Place, Question};
use crate::source::{Source, Span};
use std::collections::{HashMap, HashSet};

/// Checks the programs of a file, and returns their models. A program may ask questions of earlier programs.
pub fn check(file: &File) -> Result<Vec<Model>, Diagnostics> {
    let (mut models, mut wrong): (Vec<Model>, _) = (Vec::new(), Diagnostics::default());
    for (position, program) in file.programs.iter().enumerate() {
        let same = |other: &&Program| other.name.text == program.name.text;
        if let Some(first) = file.programs[..position].iter().find(same) {
            let message = format!("two programs are called `{}`", program.name.text);
            wrong.push(
                Diagnostic::new(program.name.span(), message).with_label(first.name.span(), "first here"),
            );
        }
        let mut checker = Checker::new(program, &models);
        checker.sections();
        match checker.finish() {
            Ok(model) => models.push(model),
            Err(mistakes) => mistakes.0.into_iter().for_each(|mistake| wrong.push(mistake)),
        }
    }
    wrong.or(models)
}

/// Parses and checks a text; returns the last program, to which the earlier ones are subroutines.
pub fn compile(source: &Source) -> Result<Model, Diagnostics> {
    let mut models = check(&parse::parse(source)?)?;
    Ok(models.pop().expect("internal: the grammar promises a program"))
}

/// Parses a question as a user types it: `P(Rain | Wet = true)`, or the name of a declared one.
pub fn parse_question(source: &Source, model: &Model) -> Result<Question, Diagnostics> {
    question_of(source, model).map_err(|wrong| quotes::suggested(wrong, &source.text, model))
}

fn question_of(source: &Source, model: &Model) -> Result<Question, Diagnostics> {
    let text = source.text.trim();
    let is_name =
        !text.is_empty() && text.chars().all(|character| character.is_alphanumeric() || character == '_');
    if is_name {
        return model.question(text).cloned().ok_or_else(|| {
            let start = source.text.len() - source.text.trim_start().len();
            let span = Span::new(start, start + text.len());
            let declared: Vec<&str> =
                model.questions.values().map(|question| question.name.as_str()).collect();
            let mut wrong = Diagnostic::new(span, format!("`{}` has no question `{text}`", model.name));
            let earlier = model.subroutines.iter().map(|own| &own.program);
            let mut of_another = earlier.filter(|program| program.question(text).is_some()).map(|program| {
                format!(
                    "`{text}` is a question of `{}`; of the programs in a file the last one, `{}`, is asked",
                    program.name, model.name
                )
            });
            wrong.help = of_another
                .next()
                .or_else(|| names::did_you_mean(text, declared.iter().copied()))
                .or_else(|| {
                    let listed = names::listed(declared, "and");
                    (!listed.is_empty()).then(|| format!("its questions are {listed}"))
                });
            wrong.into()
        });
    }
    let written = parse::parse_asks(source)?;
    let mut wrong = Diagnostics::default();
    let question = questions::typed(model, &written, &mut wrong);
    if wrong.is_empty() {
        for fault in model.question_faults(&question) {
            let number = if let Place::Ask(_, number) = fault.place { number } else { 0 };
            wrong.push(faults::diagnostic(&fault, written[number].at.0));
        }
    }
    wrong.or(question)
}

/// The meaning of a name in the whole program.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Meaning {
    Set(SetId),
    Parameter(ParameterId),
    Variable(VariableId),
    /// A parameter in `identification`, whose shape is determined by its first use.
    Learnt,
}

/// The state of the checker for one program.
struct Checker<'p> {
    program: &'p Program,
    /// The earlier programs.
    earlier: &'p [Model],
    model: ModelBuilder,
    wrong: Diagnostics,
    names: HashMap<String, (Meaning, Span)>,
    /// The spans of all parts of the model that may have a fault.
    parameter_spans: HashMap<ParameterId, Span>,
    variable_spans: HashMap<VariableId, Span>,
    factor_spans: HashMap<FactorId, Span>,
    form_spans: HashMap<FactorId, Span>,
    expression_spans: HashMap<ExpressionId, Span>,
    ask_spans: HashMap<(QuestionId, usize), Span>,
    /// Factors by their heads, as `decomposition::key` writes them.
    factors: HashMap<String, FactorId>,
    /// The factors of the first instant.
    initials: Vec<initial::Initial>,
    /// The factors of some elements of families; and for each such family its factor, with the places of its pieces.
    pieces: Vec<pieces::Piece>,
    wholes: Vec<(FactorId, Vec<usize>)>,
    /// Heads of wrong factors, whose forms are not checked.
    broken_heads: HashSet<String>,
    /// Variables with a wrong declaration or factor: no further errors are reported for them.
    broken_variables: HashSet<VariableId>,
    /// The names of variables whose domain is not known: what depends on it is not checked.
    untyped: HashSet<String>,
    /// Factors with a wrong or missing form: no further errors are reported for them.
    broken_forms: HashSet<FactorId>,
    /// Unknown names that have been reported.
    unknown: HashSet<String>,
}

impl<'p> Checker<'p> {
    fn new(program: &'p Program, earlier: &'p [Model]) -> Self {
        Self {
            program,
            earlier,
            model: ModelBuilder::new(&program.name.text),
            wrong: Diagnostics::default(),
            names: HashMap::new(),
            parameter_spans: HashMap::new(),
            variable_spans: HashMap::new(),
            factor_spans: HashMap::new(),
            form_spans: HashMap::new(),
            expression_spans: HashMap::new(),
            ask_spans: HashMap::new(),
            factors: HashMap::new(),
            initials: Vec::new(),
            pieces: Vec::new(),
            wholes: Vec::new(),
            broken_heads: HashSet::new(),
            broken_variables: HashSet::new(),
            untyped: HashSet::new(),
            broken_forms: HashSet::new(),
            unknown: HashSet::new(),
        }
    }

    /// The stages in the order of their dependencies, whatever the order of the text.
    fn sections(&mut self) {
        self.model.documentation(&self.program.comments.documentation());
        self.once_each();
        if let Some(plate) = &self.program.plate {
            self.plate(plate);
        }
        let program = self.program;
        let each = |visit: &mut dyn FnMut(&'p SectionKind)| {
            program.sections.iter().for_each(|section| visit(&section.kind));
        };
        each(&mut |kind| {
            if let SectionKind::Parameters(list) = kind {
                list.iter().for_each(|parameter| self.parameter(parameter));
            }
        });
        each(&mut |kind| {
            if let SectionKind::Variables(list) = kind {
                list.iter().for_each(|declaration| self.declaration(declaration));
            }
        });
        each(&mut |kind| {
            if let SectionKind::Identification(list) = kind {
                list.iter().for_each(|learnt| self.announce(learnt));
            }
        });
        each(&mut |kind| {
            if let SectionKind::Decomposition(terms) = kind {
                self.terms(terms, &mut Vec::new());
            }
        });
        self.bind_pieces();
        self.bind_initials();
        let mut definitions = Vec::new();
        each(&mut |kind| {
            if let SectionKind::Forms(list) = kind {
                definitions.extend(list);
            }
        });
        self.definitions(&definitions);
        each(&mut |kind| {
            if let SectionKind::Identification(list) = kind {
                list.iter().for_each(|learnt| self.identification(learnt));
            }
        });
        each(&mut |kind| {
            if let SectionKind::Question { name, asks } = kind {
                self.question(name, asks);
            }
        });
    }

    /// Every section except questions occurs at most once.
    fn once_each(&mut self) {
        let mut seen: HashMap<&str, Span> = HashMap::new();
        let mut has_variables = false;
        for section in &self.program.sections {
            let title = match &section.kind {
                SectionKind::Parameters(_) => "parameters",
                SectionKind::Variables(_) => "variables",
                SectionKind::Decomposition(_) => "decomposition",
                SectionKind::Forms(_) => "forms",
                SectionKind::Identification(_) => "identification",
                SectionKind::Question { .. } => continue,
            };
            has_variables |= title == "variables";
            let start = section.at.0.start;
            let span = Span::new(start, start + title.len());
            if let Some(first) = seen.insert(title, span) {
                let twice = Diagnostic::new(span, format!("the section `{title}` is written twice"))
                    .with_label(first, "first here")
                    .with_help("put both into one section");
                self.wrong.push(twice);
            }
        }
        if !has_variables {
            let message = format!("program `{}` has no variables", self.program.name.text);
            let wrong = Diagnostic::new(self.program.name.span(), message);
            self.wrong.push(wrong.with_help("declare them: `variables { Rain : bool; }`"));
        }
    }

    /// Whether a text of the language has the name of a variable whose domain is not known.
    fn has_untyped(&self, text: &str) -> bool {
        let mut words = text.split(|letter: char| !(letter.is_alphanumeric() || letter == '_'));
        !self.untyped.is_empty() && words.any(|word| self.untyped.contains(word))
    }

    /// Defines a name, unless it is already defined.
    fn declare(&mut self, name: &Name, meaning: Meaning) -> bool {
        if let Some((_, first)) = self.names.get(&name.text) {
            let twice = Diagnostic::new(name.span(), format!("`{}` is declared twice", name.text))
                .with_label(*first, "first here");
            self.wrong.push(twice);
            return false;
        }
        self.names.insert(name.text.clone(), (meaning, name.span()));
        true
    }

    fn meaning(&self, name: &str) -> Option<Meaning> {
        self.names.get(name).map(|(meaning, _)| *meaning)
    }

    fn complain(&mut self, span: Span, message: impl Into<String>) {
        self.wrong.push(Diagnostic::new(span, message));
    }

    fn complain_and_help(&mut self, span: Span, message: impl Into<String>, help: impl Into<String>) {
        self.wrong.push(Diagnostic::new(span, message).with_help(help));
    }
}

/// The number of a constant expression.
fn constant(expr: &ast::Expr) -> Option<f64> {
    use ast::{BinaryOp, ExprKind, UnaryOp};
    Some(match &expr.kind {
        ExprKind::Number(text) => number(text)?,
        ExprKind::Group(inner) => constant(inner)?,
        ExprKind::Unary(UnaryOp::Minus, inner) => -constant(inner)?,
        ExprKind::Binary(op, left, right) => {
            let (left, right) = (constant(left)?, constant(right)?);
            match op {
                BinaryOp::Plus => left + right,
                BinaryOp::Minus => left - right,
                BinaryOp::Times => left * right,
                BinaryOp::Over => left / right,
                _ => return None,
            }
        }
        _ => return None,
    })
}

/// A number as written, `1_000` and `1e-3` included.
fn number(text: &str) -> Option<f64> {
    text.replace('_', "").parse().ok().filter(|number: &f64| number.is_finite())
}

/// A whole number with its sign.
fn integer(sign: ast::Sign, text: &str) -> Option<i64> {
    let magnitude: i64 = text.replace('_', "").parse().ok()?;
    // Far larger than any domain, and safe to add to.
    let most = 1 << 40;
    let value = if sign == ast::Sign::Minus { -magnitude } else { magnitude };
    (-most..=most).contains(&value).then_some(value)
}
