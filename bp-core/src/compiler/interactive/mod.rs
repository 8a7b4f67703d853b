//! Questions that a reader moves: the evidence and the parameters are controls, and the answers follow.
//!
//! In: a program and questions. Out: an [`Interactive`]: a function of JavaScript for each sum of products, and for each
//! question its controls and how its answers are read from the results. Invariant: a question that has no such function
//! says why; with the initial values of its controls, a question is answered as it is written.

mod control;
mod instants;
mod limits;
mod missing;
mod now;
mod open;
mod run;
mod shown;
mod steps;

pub use control::{Control, Element, Kind};
pub use instants::Instants;
pub use limits::Limit;
pub use open::{begun, given, opened};
pub use run::{Run, State, Steps, Way};
pub use shown::{Axis, NamedStatistic, Shown, Soft, Source};

use crate::analysis::relevant_factors;
use crate::emit::javascript::{Javascript, emit_javascript};
use crate::error::Error;
use crate::ids::{FactorId, Id};
use crate::kernel::{InputKey, Kernel};
use crate::model::{Ask, Model, ParameterKind, Question};
use crate::plan::Route;
use now::{by_sums, has_default};
use serde::Serialize;

/// The questions of a program, and their code.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Interactive {
    /// The functions.
    pub code: Javascript,
    /// The questions, in order.
    pub questions: Vec<Moving>,
}

/// A question with controls.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Moving {
    /// Its name; empty for a question that was typed.
    pub name: String,
    /// The question, as a user would type it.
    pub text: String,
    /// What a reader can set.
    pub controls: Vec<Control>,
    /// What a reader can set at each instant, of a question over time.
    pub instants: Option<Instants>,
    /// How its results are computed.
    pub runs: Vec<Run>,
    /// Its answers.
    pub asks: Vec<Shown>,
    /// The reason why it has no functions.
    pub refused: Option<String>,
}

/// The moving questions of a program, each posed in a program of its own.
pub fn interactive(model: &Model, questions: &[Question]) -> Interactive {
    let mut made = Interactive::default();
    let mut kernels: Vec<Kernel> = Vec::new();
    // The number of kernels of each run of each question.
    let mut places: Vec<Vec<usize>> = Vec::new();
    for question in questions {
        let (model, question) = model.posed(question);
        let (model, question) = (model.as_ref(), question.as_ref());
        let text: Vec<String> = question.asks.iter().map(|ask| model.ask_text(ask)).collect();
        let (name, text) = (question.name.clone(), text.join("; "));
        let (open, controls) = opened(model, question);
        let instants = Instants::of(model, question);
        let (moving, own) = match compiled(model, &open, instants.as_ref(), controls.clone()) {
            Ok(Compiled { parts, controls, asks }) => {
                let runs = parts.iter().map(|part| Run { functions: Vec::new(), steps: part.steps.clone() });
                let runs = runs.collect();
                (Moving { name, text, controls, instants, runs, asks, refused: None }, parts)
            }
            Err(Refused(reason)) => {
                let refused = Some(reason);
                let scalars = model.parameters.iter().filter(|(_, parameter)| {
                    parameter.kind != ParameterKind::Size && parameter.default_number().is_some()
                });
                let factors = relevant(model, question);
                let scalars = scalars.map(|(id, parameter)| {
                    Control::of_parameter(parameter, limits::limits(model, &factors, id))
                });
                let controls = controls.into_iter().chain(scalars).collect();
                let (runs, asks) = (Vec::new(), Vec::new());
                (Moving { name, text, controls, instants, runs, asks, refused }, Vec::new())
            }
        };
        made.questions.push(moving);
        places.push(own.iter().map(|part| part.kernels.len()).collect());
        kernels.extend(own.into_iter().flat_map(|part| part.kernels));
    }
    made.code = emit_javascript(&kernels).expect("internal: each kernel was written alone");
    let mut names = made.code.names.iter();
    for (moving, counts) in made.questions.iter_mut().zip(&places) {
        for (run, count) in moving.runs.iter_mut().zip(counts) {
            run.functions = names.by_ref().take(*count).cloned().collect();
        }
    }
    made
}

/// A part of a question: its kernels, how they are run, and where the answer of each of its asks is found.
struct Part {
    kernels: Vec<Kernel>,
    steps: Option<Steps>,
    sources: Vec<Source>,
}

/// The parts of a question, one for each run; its controls with those of parameters, and its answers.
struct Compiled {
    parts: Vec<Part>,
    controls: Vec<Control>,
    asks: Vec<Shown>,
}

/// The reason why a page does not compute a question.
struct Refused(String);

impl Refused {
    fn of(model: &Model, ask: &Ask, reason: impl Into<String>) -> Self {
        Self::from(Error::Unplanned { question: model.ask_text(ask), reason: reason.into() })
    }
}

impl From<Error> for Refused {
    fn from(error: Error) -> Self {
        Self(match error {
            // The question may have an exact answer that a page does not compute.
            Error::Unplanned { question, reason } => {
                format!("a page does not compute `{question}`: {reason}")
            }
            other => other.to_string(),
        })
    }
}

/// Compiles an opened question.
fn compiled(
    model: &Model,
    question: &Question,
    instants: Option<&Instants>,
    mut controls: Vec<Control>,
) -> Result<Compiled, Refused> {
    question.asks.iter().try_for_each(|ask| shown::is_read(model, ask, instants.is_some()))?;
    let plan = by_sums(model, question)?;
    let mut parts: Vec<Part> = Vec::new();
    // Where the answer of each ask of each route is found.
    let mut sources: Vec<Vec<Source>> = Vec::new();
    for route in &plan.routes {
        let name = match question.name.as_str() {
            "" => model.ask_text(&plan.question.asks[0]),
            name => name.to_owned(),
        };
        let own = match route {
            Route::Exact(exact) => now::sums(model, exact, parts.len(), &name)?,
            Route::Gaussian(gaussian) => now::normal(model, gaussian, parts.len(), &name)?,
            Route::OverTime(route) => steps::followed(model, route, parts.len(), &name)?,
            _ => {
                let text = model.ask_text(&plan.question.asks[0]);
                let (by, how) = (route.strategy().name().replace('_', " "), route.reason());
                return Err(Refused(format!(
                    "`{text}` is answered by the strategy {by}, which a page does not compute ({how})"
                )));
            }
        };
        sources.push(own.iter().flat_map(|part| part.sources.iter().cloned()).collect());
        parts.extend(own);
    }
    let factors = relevant(model, question);
    for part in &parts {
        for kernel in &part.kernels {
            let times = (part.steps.as_ref(), instants);
            add_parameters((model, &factors), kernel, times, &mut controls)?;
        }
    }
    let mut asks = Vec::with_capacity(plan.places.len());
    for (ask, places) in plan.question.asks.iter().zip(&plan.places) {
        let own = places.iter().map(|place| sources[place.route][place.ask].clone()).collect();
        asks.push(shown::shown(model, ask, own)?);
    }
    // A control that no kernel reads moves nothing, but the question has it: it stays.
    Ok(Compiled { parts, controls, asks })
}

/// The factors that matter for a question.
fn relevant(model: &Model, question: &Question) -> Vec<FactorId> {
    question.asks.iter().flat_map(|ask| relevant_factors(model, std::slice::from_ref(ask))).collect()
}

/// Adds a control for each number that a kernel reads and that has none.
fn add_parameters(
    (model, factors): (&Model, &[FactorId]),
    kernel: &Kernel,
    (steps, instants): (Option<&Steps>, Option<&Instants>),
    controls: &mut Vec<Control>,
) -> Result<(), Error> {
    let is_column =
        |name: &str| instants.is_some_and(|instants| instants.columns.iter().any(|column| column.sets(name)));
    for buffer in kernel.buffers.values() {
        let Some(key) = buffer.role.input() else { continue };
        let given = match (key, steps) {
            // Whether an observation is given is no parameter of the program.
            (InputKey::Parameter(id), _) if id.position() >= model.parameters.len() => true,
            (InputKey::Parameter(id), _) if buffer.axes.is_empty() => {
                if controls.iter().all(|control| control.name != buffer.name) {
                    let limits = limits::limits(model, factors, *id);
                    controls.push(Control::of_parameter(&model.parameters[*id], limits));
                }
                true
            }
            (InputKey::Value(_, name), Some(steps)) => {
                is_column(name) || steps.states.iter().any(|state| state.input == *name)
            }
            (InputKey::Value(_, name), None) => controls.iter().any(|control| control.sets(name)),
            (InputKey::Law(_), Some(_)) => true,
            (InputKey::Previous(_) | InputKey::Answer(_), Some(steps)) => {
                [&steps.carried, &steps.later].contains(&&buffer.name)
            }
            _ => false,
        };
        if !given && !has_default(&buffer.role) {
            return Err(Error::input(&buffer.name, "it is given when the question is asked"));
        }
    }
    Ok(())
}
