//! Questions that a reader moves: the evidence and the parameters are controls, and the answers follow.
//!
//! In: a program and questions. Out: an [`Interactive`]: a function of JavaScript for each sum of products, and for each
//! question its controls and how its answers are read from the results. Invariant: a question that has no such function
//! says why; with the initial values of its controls, a question is answered as it is written.

mod control;
mod instants;
mod open;
mod shown;
mod steps;

pub use control::{Control, Element, Kind};
pub use instants::Instants;
pub use open::{begun, given, opened};
pub use shown::{Axis, NamedStatistic, Shown, Source};
pub use steps::Steps;

use crate::emit::javascript::{Javascript, emit_javascript};
use crate::error::Error;
use crate::ids::AxisId;
use crate::kernel::{InputKey, Kernel, Reduce, Role};
use crate::lower::{Lowered, lower};
use crate::model::{Model, ParameterKind, Question};
use crate::plan::{Options, Plan, Route, Strategy, plan_for_answer};
use crate::strategies::by_tables;
use serde::Serialize;

/// The largest number of factors for which loops are written where a join tree would be chosen.
const MOST_LOOPS: usize = 2000;

/// The largest number of products that a page computes when a control moves: about a second.
const MOST_PRODUCTS: f64 = 1e8;

/// The largest number of constants in the code of a question.
const MOST_CONSTANTS: usize = 16_384;

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
    /// The functions of the code that it calls.
    pub functions: Vec<String>,
    /// Its answers.
    pub asks: Vec<Shown>,
    /// The reason why it has no functions.
    pub refused: Option<String>,
}

/// The moving questions of a program, whose derived variables have been posed ([`Model::pose`]).
pub fn interactive(model: &Model, questions: &[Question]) -> Interactive {
    let mut made = Interactive::default();
    let mut kernels: Vec<Kernel> = Vec::new();
    // The kernels of each question, by their places among all.
    let mut places: Vec<Vec<usize>> = Vec::new();
    for question in questions {
        let text: Vec<String> = question.asks.iter().map(|ask| model.ask_text(ask)).collect();
        let (name, text) = (question.name.clone(), text.join("; "));
        let (open, controls) = opened(model, question);
        let mut instants = Instants::of(model, question);
        let compiled = match &instants {
            Some(instants) => over_time(model, question, instants, controls.clone()),
            None => compiled(model, &open, controls.clone()).map(|compiled| (compiled, None)),
        };
        let (moving, own) = match compiled {
            Ok(((kernels, controls, asks), steps)) => {
                if let Some(instants) = &mut instants {
                    instants.steps = steps;
                }
                let functions = Vec::new();
                (Moving { name, text, controls, instants, functions, asks, refused: None }, kernels)
            }
            Err(Refused(reason)) => {
                let refused = Some(reason);
                let scalars = model.parameters.values().filter(|parameter| {
                    parameter.kind != ParameterKind::Size && parameter.default_number().is_some()
                });
                let controls = controls.into_iter().chain(scalars.map(Control::of_parameter)).collect();
                let (functions, asks) = (Vec::new(), Vec::new());
                (Moving { name, text, controls, instants, functions, asks, refused }, Vec::new())
            }
        };
        made.questions.push(moving);
        places.push((kernels.len()..kernels.len() + own.len()).collect());
        kernels.extend(own);
    }
    made.code = emit_javascript(&kernels).expect("internal: each kernel was written alone");
    for (moving, places) in made.questions.iter_mut().zip(&places) {
        moving.functions = places.iter().map(|place| made.code.names[*place].clone()).collect();
    }
    made
}

/// The kernels of a question, its controls with those of parameters, and its answers.
type Compiled = (Vec<Kernel>, Vec<Control>, Vec<Shown>);

/// The reason why a page does not compute a question.
struct Refused(String);

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
fn compiled(model: &Model, question: &Question, mut controls: Vec<Control>) -> Result<Compiled, Refused> {
    question.asks.iter().try_for_each(|ask| shown::is_read(model, ask))?;
    let plan = by_sums(model, question)?;
    let mut parts: Vec<(Lowered, Vec<usize>)> = Vec::new();
    for route in &plan.routes {
        let Some(exact) = route.exact() else {
            let text = model.ask_text(&plan.question.asks[0]);
            let (by, how) = (route.strategy().name().replace('_', " "), route.reason());
            return Err(Refused(format!(
                "`{text}` is answered by the strategy {by}, which a page does not compute ({how})"
            )));
        };
        let name = match question.name.as_str() {
            "" => model.ask_text(&plan.question.asks[0]),
            name => name.to_owned(),
        };
        let (tables, places) = by_tables(exact);
        let mut lowered = lower(model, &tables, &name)?;
        lowered.kernel = lowered.kernel.with_default_sizes()?;
        emit_javascript(std::slice::from_ref(&lowered.kernel))?;
        fits(&lowered.kernel)?;
        parts.push((lowered, places));
    }
    for (lowered, _) in &parts {
        add_parameters(model, &lowered.kernel, &mut controls)?;
    }
    let asks = plan.question.asks.iter().zip(&plan.places);
    let asks: Vec<Shown> =
        asks.map(|(ask, places)| shown::shown(model, ask, places, &parts)).collect::<Result<_, _>>()?;
    // A control that no kernel reads moves nothing, but the question has it: it stays.
    Ok((parts.into_iter().map(|(lowered, _)| lowered.kernel).collect(), controls, asks))
}

/// Compiles a question over time.
fn over_time(
    model: &Model,
    question: &Question,
    instants: &Instants,
    controls: Vec<Control>,
) -> Result<(Compiled, Option<Steps>), Refused> {
    let plan = plan_for_answer(model, question, Options::default())?;
    match (plan.routes.as_slice(), plan.question.asks.as_slice()) {
        ([Route::OverTime(route)], [ask]) => {
            let (compiled, steps) = steps::followed(model, ask, instants, route, controls)?;
            Ok((compiled, Some(steps)))
        }
        _ => compiled(model, question, controls).map(|compiled| (compiled, None)),
    }
}

/// Whether an input need not be given.
fn has_default(role: &Role) -> bool {
    matches!(role, Role::Input { default: Some(_), .. } | Role::Table { .. })
}

/// Whether a page can hold and run a kernel whose sizes are known.
fn fits(kernel: &Kernel) -> Result<(), Error> {
    let constants = |role: &Role| if let Role::Table { numbers, .. } = role { numbers.len() } else { 0 };
    let constants: usize = kernel.buffers.values().map(|buffer| constants(&buffer.role)).sum();
    let refused = |reason: String| Err(Error::Unplanned { question: kernel.name.clone(), reason });
    if constants > MOST_CONSTANTS {
        return refused(format!("its tables have {constants} numbers; a page holds {MOST_CONSTANTS}"));
    }
    let extent = |axis: &AxisId| kernel.axes[*axis].extent.known().unwrap_or(1) as f64;
    let products = kernel.nests.iter().map(|nest| {
        let folded = if let Reduce::Fold(_, axes) = &nest.reduce { axes.as_slice() } else { &[] };
        kernel.buffers[nest.out].axes.iter().chain(folded).map(extent).product::<f64>()
    });
    match products.sum::<f64>() {
        products if products > MOST_PRODUCTS => {
            refused(format!("it computes {products:.0} products; a page computes {MOST_PRODUCTS:.0}"))
        }
        _ => Ok(()),
    }
}

/// The plan by sums of products, where loops can be written.
fn by_sums(model: &Model, question: &Question) -> Result<Plan, Error> {
    let cheapest = plan_for_answer(model, question, Options::default())?;
    let is_tree = |route: &Route| matches!(route, Route::Tree(tree) if tree.factors.len() <= MOST_LOOPS);
    match cheapest.routes.iter().any(is_tree) {
        true => plan_for_answer(model, question, Options::from(Some(Strategy::Sums))).or(Ok(cheapest)),
        false => Ok(cheapest),
    }
}

/// Adds a control for each number that a kernel reads and that has none.
fn add_parameters(model: &Model, kernel: &Kernel, controls: &mut Vec<Control>) -> Result<(), Error> {
    for buffer in kernel.buffers.values() {
        let Some(key) = buffer.role.input() else { continue };
        match key {
            InputKey::Parameter(parameter) if buffer.axes.is_empty() => {
                if controls.iter().all(|control| control.name != buffer.name) {
                    controls.push(Control::of_parameter(&model.parameters[*parameter]));
                }
            }
            InputKey::Value(_, name) if controls.iter().any(|control| control.sets(name)) => {}
            _ if has_default(&buffer.role) => {}
            _ => return Err(Error::input(&buffer.name, "it is given when the question is asked")),
        }
    }
    Ok(())
}
