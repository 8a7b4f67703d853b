//! Answers: distributions with the names of their values.
//!
//! In: a model, a question and the host's inputs. Out: an [`Answer`] for each thing asked. Invariant: the
//! probabilities of a row's context sum to one, or are all zero where the context itself has probability zero;
//! evidence of probability zero is an error.

mod check;
mod instants;
mod link;
mod over_time;
mod reading;
mod sampled;

pub use instants::read_instants;
pub use link::link;

use crate::distribution::Setting;
use crate::error::Error;
use crate::exec::{Filter, Inputs, Lanes, scalar::Scalar};
use crate::ids::VariableId;
use crate::lower::lower;
use crate::model::{Ask, Evidence, Model, Question};
use crate::plan::{self, Options, Plan, Route};
use crate::sample::{Observations, Sampling};
use reading::Reading;
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};

/// What is answered to one thing asked.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Answer {
    /// What was asked, as a user would type it.
    pub question: String,
    /// ln P(evidence), where the evidence is one event; a density where it is real.
    pub ln_evidence: Option<f64>,
    /// How it was estimated, where it is not exact.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimate: Option<Estimate>,
    /// The rows: all values of a distribution, the maximisers of an argmax, or one number.
    pub answer: Vec<Row>,
}

/// How an answer was estimated.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Estimate {
    /// How many draws.
    pub particles: usize,
    /// How many draws of the answer itself would say as much.
    pub effective: f64,
    /// Where the random numbers began.
    pub seed: u64,
    /// The standard error of ln P(evidence), where that is told.
    pub ln_evidence_error: Option<f64>,
    /// What is to be minded.
    pub warning: Option<String>,
}

/// One row of an answer.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Row {
    /// The names of the values, variable by variable, in the order of the question.
    #[serde(serialize_with = "as_map")]
    pub values: Vec<(String, String)>,
    /// What is said of them.
    #[serde(flatten)]
    pub figure: Figure,
}

/// What is said of a row.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
#[serde(untagged)]
pub enum Figure {
    /// A probability, or the density of a given real.
    Probability {
        /// The probability.
        p: f64,
    },
    /// An entropy.
    Entropy {
        /// In nats.
        entropy: f64,
    },
    /// A probability, estimated.
    Estimated {
        /// The probability.
        p: f64,
        /// Its standard error.
        error: f64,
    },
    /// An expectation or a variance, estimated.
    Moment {
        /// It.
        value: f64,
        /// Its standard error.
        error: f64,
    },
    /// What draws say of a real; behind each number its standard error.
    Real {
        /// Mean.
        mean: [f64; 2],
        /// Standard deviation.
        deviation: [f64; 2],
        /// The quantiles at 5 %, 50 % and 95 %.
        quantiles: [[f64; 2]; 3],
    },
    /// A normal law.
    Normal {
        /// Mean.
        mean: f64,
        /// Standard deviation.
        deviation: f64,
    },
}

impl Row {
    /// The probability; `None` for a row that is no probability.
    pub fn p(&self) -> Option<f64> {
        match self.figure {
            Figure::Probability { p } | Figure::Estimated { p, .. } => Some(p),
            _ => None,
        }
    }
}

fn as_map<S: Serializer>(values: &[(String, String)], serializer: S) -> Result<S::Ok, S::Error> {
    let mut map = serializer.serialize_map(Some(values.len()))?;
    for (variable, value) in values {
        map.serialize_entry(variable, value)?;
    }
    map.end()
}

/// How a question to a model is planned when one wants to see the answer: with ln P(evidence) where the
/// evidence is one event.
///
/// # Errors
/// See [`plan::plan`].
pub fn plan_for_answer(model: &Model, question: &Question) -> Result<Plan, Error> {
    let finite = |variable: VariableId| model.variables[variable].domain.is_finite();
    // The density of a real is told without ln P(evidence), for which it would have to be integrated.
    let event = |ask: &Ask| {
        ask.known.iter().all(|known| !matches!(known.evidence, Evidence::Each))
            && ask.searched.iter().all(|item| finite(item.variable) || item.at.is_none())
    };
    let (events, tables): (Vec<Ask>, Vec<Ask>) = question.asks.iter().cloned().partition(event);
    let mut routes = Vec::new();
    for (asks, ln_evidence) in [(events, model.plate.is_none()), (tables, false)] {
        let part = Question { name: question.name.clone(), asks };
        routes.extend(plan::plan(model, &part, Options { ln_evidence, ..Options::default() })?.routes);
    }
    Ok(Plan { question: question.clone(), routes })
}

/// Asks a question of a model.
///
/// # Errors
/// No route; inputs that are missing or do not fit; evidence of probability zero.
pub fn ask(model: &Model, question: &Question, inputs: &Inputs<'_, f64>) -> Result<Vec<Answer>, Error> {
    ask_with(model, question, inputs, Sampling::default())
}

/// Asks a question of a model; what has no exact answer is estimated as `sampling` says.
///
/// # Errors
/// As [`ask`].
pub fn ask_with(
    model: &Model,
    question: &Question,
    inputs: &Inputs<'_, f64>,
    sampling: Sampling,
) -> Result<Vec<Answer>, Error> {
    let model = &*link(model)?;
    let plan = plan_for_answer(model, question)?;
    check::inputs(model, question, inputs)?;
    let mut answers = Vec::new();
    for route in &plan.routes {
        match route {
            Route::Gaussian(gaussian) => answers.extend(ask_gaussian(model, gaussian, inputs)?),
            Route::OverTime(over_time) => {
                let reason =
                    "it is asked over time: give what was observed, a row for each instant (`--data`)"
                        .to_owned();
                return Err(Error::Unplanned { question: model.ask_text(&over_time.ask), reason });
            }
            Route::Sampled(sampled) => answers.extend(sampled::answers(model, sampled, inputs, sampling)?),
            Route::Exact(exact) => {
                let lowered = lower(model, exact, &question.name)?;
                let lanes = Lanes::new(lowered.kernel);
                let outputs = lanes.run(inputs)?;
                let ln_evidence = exact.ln_evidence.then(|| outputs.get("ln_evidence")[0]);
                for output in &lowered.outputs {
                    let Some(ask) = &output.ask else { continue };
                    let cells = outputs.get(&output.name);
                    if cells.iter().any(|cell| cell.is_nan()) {
                        let reason = "its answer is not a number: a divisor or a standard deviation may be 0";
                        return Err(Error::input(&output.name, reason));
                    }
                    let extents = lanes.extents(&output.name, inputs)?;
                    let rows = Reading::new(model, ask, output, cells, &extents, inputs).rows()?;
                    let answer =
                        Answer { question: model.ask_text(ask), ln_evidence, estimate: None, answer: rows };
                    if exact.ln_evidence && answer.ln_evidence == Some(f64::NEG_INFINITY) {
                        return Err(Error::Impossible(answer.question));
                    }
                    answers.push(answer);
                }
            }
        }
    }
    // Asks that know the same were answered together; they are given back in the order of the question.
    let order: Vec<String> = question.asks.iter().map(|ask| model.ask_text(ask)).collect();
    answers.sort_by_key(|answer| order.iter().position(|asked| *asked == answer.question));
    Ok(answers)
}

fn ask_gaussian(
    model: &Model,
    gaussian: &plan::Gaussian,
    inputs: &Inputs<'_, f64>,
) -> Result<Vec<Answer>, Error> {
    let given = |name: &str| match inputs.find(name) {
        None => Ok(None),
        Some([number]) => Ok(Some(*number)),
        Some(several) => {
            let count = several.len();
            Err(Error::input(name, format!("{count} numbers were given, but 1 is expected")))
        }
    };
    let mut parameters: Vec<(&str, f64)> = Vec::new();
    for parameter in model.parameters.values() {
        if let Some(number) = given(&parameter.name)? {
            parameters.push((&parameter.name, number));
        }
    }
    let setting = Setting::new(model, inputs)?;
    let evidence = Observations::of(&setting, &gaussian.asks[0])?;
    let known = gaussian.asks[0].known.iter().filter(|known| Some(known.variable) != model.plate_index());
    let slots = known.flat_map(|known| setting.slots_of(known.variable));
    let observations: Vec<(String, f64)> =
        slots.map(|slot| (setting.slot_name(slot), evidence.values[slot])).collect();
    let observations: Vec<(&str, f64)> =
        observations.iter().map(|(name, value)| (name.as_str(), *value)).collect();
    let belief = Filter::new(model, gaussian, &parameters)?.step(&observations)?;
    Ok((gaussian.asks.iter())
        .map(|ask| Answer {
            question: model.ask_text(ask),
            ln_evidence: (!observations.is_empty()).then_some(belief.ln_evidence),
            estimate: None,
            answer: (ask.searched.iter())
                .flat_map(|searched| setting.slots_of(searched.variable))
                .map(|slot| setting.slot_name(slot))
                .map(|name| {
                    let mean = belief.mean_of(&name).unwrap_or(f64::NAN);
                    let deviation = belief.deviation_of(&name).unwrap_or(f64::NAN);
                    Row { values: vec![(name, String::new())], figure: Figure::Normal { mean, deviation } }
                })
                .collect(),
        })
        .collect())
}

/// Asks a question over time: what was observed at each instant, by name.
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
    let model = &*link(model)?;
    check::inputs(model, question, inputs)?;
    over_time::answers(model, question, observations, inputs, sampling)
}

/// How close to the largest a score must be to be as good, as a fraction of it.
const TIE: f64 = 1e-9;

/// The positions at which a score is largest; with `nearest`, the one of these at which that field is smallest
/// (the first, if several), so that at most one is left. None where no score is positive.
pub fn argmax<T: Scalar>(scores: &[T], nearest: Option<&[T]>) -> Vec<usize> {
    let best = scores.iter().fold(T::ZERO, |best, score| best.maximum(*score));
    if best <= T::ZERO {
        return Vec::new();
    }
    // In f32 neighbouring numbers are further apart than the tolerance; their own spacing is used then.
    let spacing = if T::from_f64(1.0 + TIE) == T::ONE { 1e-6 } else { TIE };
    let least = T::from_f64(best.to_f64() * (1.0 - spacing));
    let tied = (0..scores.len()).filter(|position| scores[*position] >= least);
    match nearest {
        None => tied.collect(),
        Some(field) => tied
            .reduce(|best, other| if field[other] < field[best] { other } else { best })
            .into_iter()
            .collect(),
    }
}
