//! Recomputation of a question of emitted code whose numbers are suspect.
//!
//! In: a model, a question and its inputs. Out: the outputs, computed with separate exponents where necessary, or the
//! reason why there are none. Invariant: the arrays have the names and the layout of the emitted kernel's.
//!
//! Emitted code only detects a total that is too small or not finite. The consequences are computed here, in the same
//! way as for questions of a program text.

use super::link;
use crate::equation::Exact;
use crate::error::Error;
use crate::exec::compiled::Report;
use crate::exec::scalar::Scalar;
use crate::exec::{Inputs, Lanes, Outputs};
use crate::kernel::OutputKey;
use crate::lower::lower_guarded;
use crate::model::{Model, Question};
use crate::plan::{Mark, plan_for_code};
use crate::posterior::check;
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
    let found = Lanes::new(kernel).run_guarded(inputs, exact.mark(model) == Mark::Log)?;
    let arrays = &found.outputs.arrays;
    if arrays
        .iter()
        .any(|(key, cells)| *key != OutputKey::Total && !cells.iter().all(|cell| cell.is_finite()))
    {
        return Err(check::not_a_number(model, &exact.asks[0], inputs));
    }
    // A total may be too small for f64 and yet positive.
    let zeros = match &found.extended {
        Some(extended) => zeros(&extended.arrays),
        None => zeros(arrays),
    };
    let impossible = zeros.unwrap_or(suspects);
    match impossible == contexts {
        true => Err(sums::impossible(model, &exact.asks[0], inputs)),
        false => Ok((found.outputs, Report { impossible })),
    }
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
    let mut model = link(model)?;
    let question = model.question(asked.question).expect("internal: the question has been compiled").clone();
    match model.is_posed(&question) {
        true => Ok((model, question)),
        false => {
            let question = model.to_mut().pose(&question);
            Ok((model, question))
        }
    }
}

fn exact(model: &Model, question: &Question, route: usize) -> Result<Exact, Error> {
    let routes = plan_for_code(model, question)?.routes;
    Ok(routes[route].exact().expect("internal: the route has been compiled").clone())
}
