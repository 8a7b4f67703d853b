//! Derivations: how the answer follows from the program, step by step.
//!
//! In: a program and a question. Out: [`Derivation`], as text, LaTeX and MathML. Invariant: each form shows the same steps of
//! the same plan, which is the plan that answers the question.

use crate::origin::{Rebuilt, function};
use bp_core::compiler::model::{Model, Question};
use bp_core::compiler::plan::{Notation, Options, Plan, plan};
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::parse_question;
use bp_core::prelude::{Error, Program};
use pyo3::prelude::*;

/// A step: rule, reason, and the equation as text, in LaTeX and in MathML.
type Step = (String, String, String, String, String);

/// The question, the route, the steps, and what is computed.
type Parts = (String, String, Vec<Step>, Vec<(String, String, String)>);

/// The derivation of the answer to one question.
#[derive(Clone)]
struct Derived {
    question: String,
    route: String,
    steps: Vec<Step>,
    /// What is computed, as text, in LaTeX and in MathML.
    computed: Vec<(String, String, String)>,
}

/// The derivation of answers, step by step. It prints as text, and shows as mathematics in a notebook.
#[pyclass(frozen, module = "bayesian_programs")]
pub(crate) struct Derivation {
    program: String,
    parts: Vec<Derived>,
}

/// A derivation of a program's name and its parts: how a pickled one comes back.
#[pyfunction]
#[pyo3(name = "_derivation")]
pub(crate) fn restored(program: String, parts: Vec<Parts>) -> Derivation {
    let part = |(question, route, steps, computed)| Derived { question, route, steps, computed };
    Derivation { program, parts: parts.into_iter().map(part).collect() }
}

/// A question as typed, or the declared ones.
///
/// # Errors
/// A wrong question, under its words; a program that declares none.
pub(crate) fn questions(program: &Program, typed: Option<&str>) -> Result<Vec<Question>, Error> {
    let model = program.model();
    let Some(typed) = typed else {
        let all: Vec<Question> = model.questions.values().cloned().collect();
        return match all.is_empty() {
            true => Err(Error::input("question", format!("`{}` declares none: give one", model.name))),
            false => Ok(all),
        };
    };
    let source = Source::new("question", typed);
    parse_question(&source, model).map(|one| vec![one]).map_err(|wrong| Error::program(&source, wrong))
}

impl Derivation {
    pub(crate) fn of(program: &Program, question: Option<&str>, options: Options) -> Result<Self, Error> {
        let model = program.model();
        let part = |one: &Question| Ok(derived(model, &plan(model, one, options)?));
        let parts = questions(program, question)?.iter().map(part).collect::<Result<_, Error>>()?;
        Ok(Self { program: program.name().to_owned(), parts })
    }
}

fn derived(model: &Model, plan: &Plan) -> Derived {
    let [text, latex, mathml] = [Notation::Unicode, Notation::Latex, Notation::MathMl]
        .map(|notation| (plan.derivation(model, notation), plan.computed(model, notation)));
    let steps = text.0.into_iter().zip(latex.0).zip(mathml.0);
    type Line = (String, String, String);
    let step = |((line, latex), mathml): ((Line, Line), Line)| (line.0, line.1, line.2, latex.2, mathml.2);
    let computed = text.1.into_iter().zip(latex.1).zip(mathml.1);
    let mut reasons: Vec<&str> = plan.routes.iter().map(|route| route.reason()).collect();
    reasons.dedup();
    Derived {
        question: plan.question.asks.iter().map(|ask| model.ask_text(ask)).collect::<Vec<_>>().join("; "),
        route: reasons.join("; "),
        steps: steps.map(step).collect(),
        computed: computed.map(|((text, latex), mathml)| (text, latex, mathml)).collect(),
    }
}

#[pymethods]
impl Derivation {
    /// The name of the program.
    #[getter]
    fn program(&self) -> &str {
        &self.program
    }

    /// The questions, as a user types them.
    #[getter]
    fn questions(&self) -> Vec<String> {
        self.parts.iter().map(|part| part.question.clone()).collect()
    }

    /// The steps of all questions, one after the other: (rule, reason, equation), the equation as text.
    #[getter]
    fn steps(&self) -> Vec<(String, String, String)> {
        let all = self.parts.iter().flat_map(|part| &part.steps);
        all.map(|(rule, reason, text, ..)| (rule.clone(), reason.clone(), text.clone())).collect()
    }

    /// The question, the route, the steps (rule, reason, text, LaTeX, MathML) and what is computed, for each question.
    #[getter]
    fn _parts(&self) -> Vec<Parts> {
        let part = |one: &Derived| {
            (one.question.clone(), one.route.clone(), one.steps.clone(), one.computed.clone())
        };
        self.parts.iter().map(part).collect()
    }

    /// As an `align*` environment of LaTeX (package amsmath) for each question.
    fn to_latex<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("bayesian_programs.display")?.call_method1("derivation_latex", (slf,))
    }

    fn __str__(&self) -> String {
        let mut text = String::new();
        for part in &self.parts {
            if !text.is_empty() {
                text.push('\n');
            }
            text.push_str(&format!("program {}: {}\n", self.program, part.question));
            for (at, (rule, reason, equation, ..)) in part.steps.iter().enumerate() {
                text.push_str(&format!("\n{:>2}. {rule}\n    {reason}\n      {equation}\n", at + 1));
            }
            text.push_str(&format!("\nroute: {}\n", part.route));
            for (equation, ..) in &part.computed {
                text.push_str(&format!("computed: {equation}\n"));
            }
        }
        text
    }

    fn __repr__(&self) -> String {
        self.__str__()
    }

    fn __reduce__(&self, py: Python<'_>) -> PyResult<Rebuilt<(String, Vec<Parts>)>> {
        Ok((function(py, "_derivation")?, (self.program.clone(), self._parts())))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("bayesian_programs.display")?.call_method1("derivation", (slf,))
    }

    fn _repr_latex_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("bayesian_programs.display")?.call_method1("derivation_latex", (slf,))
    }
}
