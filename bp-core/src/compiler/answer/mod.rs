//! Answers: plan a question, prepare its routes, run them.
//!
//! In: a model, a question and the host's inputs. Out: an [`Answer`] for each ask. Invariant: evidence of probability
//! zero is an error.

mod again;
mod compiled;
mod contexts;
mod elements;
mod instants;
mod link;
mod marginals;
mod open;
mod planned;
mod soft;

pub use crate::posterior::{
    Answer, AnswerRows, Column, ConditionalGaussian, Covariance, Drawn, Estimate, Figure, NamedLaw, Numbers,
    Part, PartLaw, Row, Slot, Stored, Table, argmax, ordinals,
};
pub use crate::strategies::{Findings, Observed};
pub use again::{Asked, again, again_at, no_law, refused, refused_at};
pub use compiled::{CompiledQuestion, compile, compile_by, compile_sized};
pub use elements::plan_sized;
pub use instants::{OtherColumns, read_instants, read_sequences};
pub use link::link;
pub(crate) use marginals::marginals_strategy;
pub use marginals::{Knowledge, marginals, together};
pub use open::{filled, open};
pub(crate) use planned::Planned;

use crate::error::Error;
use crate::exec::Inputs;
use crate::model::{Model, Question};
use crate::plan::Options;
use crate::sample::Sampling;

/// Answers a question of a model.
///
/// # Errors
/// No route; inputs that are missing or do not fit; evidence of probability zero.
pub fn ask(model: &Model, question: &Question, inputs: &Inputs<'_, f64>) -> Result<Vec<Answer>, Error> {
    ask_with(model, question, inputs, Sampling::default())
}

/// Answers a question of a model; `sampling` sets the number of draws and the seed of estimates.
///
/// # Errors
/// As [`ask`].
pub fn ask_with(
    model: &Model,
    question: &Question,
    inputs: &Inputs<'_, f64>,
    sampling: Sampling,
) -> Result<Vec<Answer>, Error> {
    compile(model, question)?.ask_with(inputs, sampling)
}

/// Answers a question over time, given the observations of each instant by name.
///
/// # Errors
/// As [`ask`]; a question that is not over time.
pub fn ask_over_time(
    model: &Model,
    question: &Question,
    observations: &[Vec<(String, f64)>],
    inputs: &Inputs<'_, f64>,
    sampling: Sampling,
) -> Result<Vec<Answer>, Error> {
    ask_over_time_by(model, question, observations, inputs, sampling, Options::default())
}

/// Answers a question over time by one strategy.
///
/// # Errors
/// As [`ask_over_time`]; the strategy does not answer it.
pub fn ask_over_time_by(
    model: &Model,
    question: &Question,
    observations: &[Vec<(String, f64)>],
    inputs: &Inputs<'_, f64>,
    sampling: Sampling,
    by: impl Into<Options>,
) -> Result<Vec<Answer>, Error> {
    ask_over_time_knowing(model, question, (observations, None), inputs, sampling, by)
}

/// The same, with likelihoods at instants.
///
/// # Errors
/// As [`ask_over_time_by`]; likelihoods where all that is carried is not finite.
pub(crate) fn ask_over_time_knowing(
    model: &Model,
    question: &Question,
    known: (&[Observed], Option<&Findings>),
    inputs: &Inputs<'_, f64>,
    sampling: Sampling,
    by: impl Into<Options>,
) -> Result<Vec<Answer>, Error> {
    let of_families = instants::of_families(model, question);
    let mut answers = compile_by(model, &of_families, by)?.ask_over(known, inputs, sampling)?;
    if of_families != *question {
        let (model, question) = model.posed(question);
        let texts = question.asks.iter().map(|ask| model.ask_text(ask));
        answers.iter_mut().zip(texts).for_each(|(answer, text)| answer.question = text);
    }
    Ok(answers)
}
