//! Recomputation of a question of emitted code whose numbers are suspect.
//!
//! In: a model, a question and its inputs. Out: the outputs, computed with separate exponents where necessary, or the
//! reason why there are none. Invariant: the arrays have the names and the layout of the emitted kernel's.
//!
//! Emitted code only detects a total that is too small or not finite. The consequences are computed here, in the same
//! way as for questions of a program text.

use super::link;
use crate::distribution::Setting;
use crate::equation::Exact;
use crate::error::{Error, Impossible};
use crate::exec::compiled::Report;
use crate::exec::scalar::Scalar;
use crate::exec::{Inputs, Lanes, Outputs};
use crate::kernel::{Kernel, OutputKey};
use crate::lower::{Phase, lower_guarded};
use crate::model::{Ask, Model, Question};
use crate::plan::{Mark, Route, plan_for_code};
use crate::posterior::check;
use crate::strategies::over_time::{InstantCode, OverTime};
use crate::strategies::sums;
use std::borrow::Cow;

/// The question of a module: its name, and the route that the module answers.
#[derive(Clone, Copy, Debug)]
pub struct Asked<'q> {
    /// The name of the question.
    pub question: &'q str,
    /// The index of the route, from 0.
    pub route: usize,
}

/// The outputs of a question without a plate, where `suspects` of `contexts` contexts were suspect.
///
/// # Errors
/// A number outside the range of a form; evidence of probability zero, where no context is possible.
pub fn again(
    model: &Model,
    asked: Asked<'_>,
    inputs: &Inputs<'_, f64>,
    (suspects, contexts): (usize, usize),
) -> Result<(Outputs<f64>, Report), Error> {
    let (model, question) = posed(model, asked)?;
    let model = &*model;
    let exact = exact(model, &question, asked.route)?;
    let kernel = lower_guarded(model, &exact, asked.question)?.kernel;
    let log = exact.mark(model) == Mark::Log;
    let (outputs, impossible) =
        guarded(kernel, inputs, log, suspects, || check::not_a_number(model, &exact.asks[0], inputs))?;
    match impossible == contexts {
        true => Err(sums::impossible(model, &exact.asks[0], inputs)),
        false => Ok((outputs, Report { impossible })),
    }
}

/// The outputs of one instant of a filter without a plate, as [`again`].
///
/// # Errors
/// As [`again`].
pub fn again_at(
    model: &Model,
    (asked, phase): (Asked<'_>, Phase),
    inputs: &Inputs<'_, f64>,
    (suspects, contexts): (usize, usize),
) -> Result<(Outputs<f64>, Report), Error> {
    let (model, question) = posed(model, asked)?;
    let route = over_time(&model, &question, asked.route)?;
    let InstantCode::Chain { step, exact, lowered } = route.instant(&model, phase, asked.question, true)?
    else {
        return Err(no_law(&model, asked, inputs));
    };
    let log = exact.mark(&step.model) == Mark::Log;
    let ask = route.ask();
    let (outputs, impossible) = guarded(lowered.kernel, inputs, log, suspects, || {
        refused_at(&model, asked, inputs).unwrap_or_else(|| not_finite(&model, ask))
    })?;
    match impossible == contexts {
        true => {
            let reason = "at this instant, given the earlier ones".to_owned();
            Err(Error::Impossible(Impossible { question: model.ask_text(ask), reason: Some(reason) }))
        }
        false => Ok((outputs, Report { impossible })),
    }
}

/// The error of an instant whose normal law has a moment that is not a number.
pub fn no_law(model: &Model, asked: Asked<'_>, inputs: &Inputs<'_, f64>) -> Error {
    refused_at(model, asked, inputs).unwrap_or_else(|| match posed(model, asked) {
        Ok((model, question)) => not_finite(&model, &question.asks[0]),
        Err(error) => error,
    })
}

/// The invalid number of a form at an instant, if there is one.
pub fn refused_at(model: &Model, asked: Asked<'_>, inputs: &Inputs<'_, f64>) -> Option<Error> {
    let found = posed(model, asked).and_then(|(model, question)| {
        let unknown = model.sets.values().filter(|set| inputs.find_size(&set.name).is_none());
        let inputs = unknown.fold(inputs.clone(), |inputs, set| inputs.size(&set.name, 1));
        let route = over_time(&model, &question, asked.route)?;
        Ok(route
            .refused(&Setting::new(&model, &inputs)?)
            .or_else(|| check::refused(&model, route.ask(), &inputs)))
    });
    found.unwrap_or_else(Some)
}

fn not_finite(model: &Model, ask: &Ask) -> Error {
    let message = "a number of the answer is not finite: the earlier observations exclude this one, or the numbers \
                   leave the range of their type";
    Error::Number { form: model.ask_text(ask), context: String::new(), message: message.to_owned() }
}

fn over_time(model: &Model, question: &Question, route: usize) -> Result<OverTime, Error> {
    match plan_for_code(model, question)?.routes.swap_remove(route) {
        Route::OverTime(route) => Ok(route),
        other => {
            let reason = format!("it is compiled over time, but `{}` answers it", other.strategy().name());
            Err(Error::Unplanned { question: question.name.clone(), reason })
        }
    }
}

/// The outputs with separate exponents where these are needed, and the number of impossible contexts.
fn guarded(
    kernel: Kernel,
    inputs: &Inputs<'_, f64>,
    log: bool,
    suspects: usize,
    refused: impl FnOnce() -> Error,
) -> Result<(Outputs<f64>, usize), Error> {
    let found = Lanes::new(kernel).run_guarded(inputs, log)?;
    let arrays = &found.outputs.arrays;
    let is_wrong = |key: OutputKey, cell: f64| match key {
        OutputKey::Total => false,
        // ln 0 of impossible evidence.
        OutputKey::LnEvidence => cell.is_nan() || cell == f64::INFINITY,
        _ => !cell.is_finite(),
    };
    if arrays.iter().any(|(key, cells)| cells.iter().any(|cell| is_wrong(*key, *cell))) {
        return Err(refused());
    }
    // A total may be too small for f64 and yet positive.
    let zeros = match &found.extended {
        Some(extended) => zeros(&extended.arrays),
        None => zeros(arrays),
    };
    Ok((found.outputs, zeros.unwrap_or(suspects)))
}

/// The invalid number of a form that made an answer over a plate NaN; `None` where every form is valid and a product
/// only left the range of the number type: those elements count as impossible.
pub fn refused(model: &Model, asked: Asked<'_>, inputs: &Inputs<'_, f64>) -> Option<Error> {
    let found = posed(model, asked).and_then(|(model, question)| {
        let exact = exact(&model, &question, asked.route)?;
        // The kernel may not have read the size of every set.
        let unknown = model.sets.values().filter(|set| inputs.find_size(&set.name).is_none());
        let inputs = unknown.fold(inputs.clone(), |inputs, set| inputs.size(&set.name, 1));
        Ok(check::refused(&model, &exact.asks[0], &inputs))
    });
    found.unwrap_or_else(Some)
}

/// The number of totals that are 0, where totals are an output.
fn zeros<T: Scalar>(arrays: &[(OutputKey, Vec<T>)]) -> Option<usize> {
    let (_, totals) = arrays.iter().find(|(key, _)| *key == OutputKey::Total)?;
    Some(totals.iter().filter(|total| **total == T::ZERO).count())
}

/// The program, extended by what the question derives from it, and the question.
fn posed<'m>(model: &'m Model, asked: Asked<'_>) -> Result<(Cow<'m, Model>, Question), Error> {
    let model = link(model)?;
    let question = model.question(asked.question).expect("internal: the question has been compiled").clone();
    Ok(super::elements::posed(model, &question))
}

fn exact(model: &Model, question: &Question, route: usize) -> Result<Exact, Error> {
    let routes = plan_for_code(model, question)?.routes;
    Ok(routes[route].exact().expect("internal: the route has been compiled").clone())
}
