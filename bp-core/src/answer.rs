//! Answers: distributions with the names of their values.
//!
//! In: a model, a question and the host's inputs. Out: an [`Answer`] for each thing asked. Invariant: the
//! probabilities of a row's context sum to one, or are all zero where the context itself has probability zero;
//! evidence of probability zero is an error.

mod check;

use crate::error::Error;
use crate::exec::{Filter, Inputs, Lanes, scalar::Scalar};
use crate::ids::VariableId;
use crate::lower::{Output, lower};
use crate::model::{Ask, Domain, Evidence, IndexSpace, Model, Question, Reduction, SetKind, Value};
use crate::plan::{self, Options, Plan, Route};
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};

/// What is answered to one thing asked.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Answer {
    /// What was asked, as a user would type it.
    pub question: String,
    /// ln P(evidence), where the evidence is one event; a density where it is real.
    pub ln_evidence: Option<f64>,
    /// The rows: all values of a distribution, the maximisers of an argmax, or one number.
    pub answer: Vec<Row>,
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
            Figure::Probability { p } => Some(p),
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
/// No exact route; inputs that are missing or do not fit; evidence of probability zero.
pub fn ask(model: &Model, question: &Question, inputs: &Inputs<'_, f64>) -> Result<Vec<Answer>, Error> {
    let plan = plan_for_answer(model, question)?;
    check::inputs(model, question, inputs)?;
    let mut answers = Vec::new();
    for route in &plan.routes {
        match route {
            Route::Gaussian(gaussian) => answers.extend(ask_gaussian(model, gaussian, inputs)?),
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
                    let nearest = match &ask.reduction {
                        Reduction::Argmax { nearest: Some(field) } => {
                            Some(tie_breaker(field, cells, inputs)?)
                        }
                        _ => None,
                    };
                    let read = Reading { model, ask, output, cells, nearest };
                    let answer = read.answer(&lanes, inputs, ln_evidence)?;
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

/// The field whose smallest value breaks ties.
fn tie_breaker<'i>(field: &str, cells: &[f64], inputs: &'i Inputs<'_, f64>) -> Result<&'i [f64], Error> {
    let found = inputs.find(field).ok_or_else(|| Error::input(field, "it was not given; it breaks ties"))?;
    match found.len() == cells.len() {
        true => Ok(found),
        false => Err(Error::input(
            field,
            format!("{} numbers were given, but {} are expected", found.len(), cells.len()),
        )),
    }
}

fn ask_gaussian(
    model: &Model,
    gaussian: &plan::Gaussian,
    inputs: &Inputs<'_, f64>,
) -> Result<Vec<Answer>, Error> {
    let given = |name: &str| inputs.find(name).and_then(|numbers| numbers.first().copied());
    let parameters: Vec<(&str, f64)> = (model.parameters.values())
        .filter_map(|parameter| Some((parameter.name.as_str(), given(&parameter.name)?)))
        .collect();
    let mut observations = Vec::new();
    for known in &gaussian.asks[0].known {
        let name = model.variable_name(known.variable);
        let value = match &known.evidence {
            Evidence::Hard(Value::Real(number)) => *number,
            Evidence::Hard(Value::Given(given_as)) => {
                given(given_as).ok_or_else(|| Error::input(given_as, "it was not given"))?
            }
            _ => given(&name).ok_or_else(|| Error::input(&name, "it was not given"))?,
        };
        observations.push((name, value));
    }
    let observations: Vec<(&str, f64)> =
        observations.iter().map(|(name, value)| (name.as_str(), *value)).collect();
    let belief = Filter::new(model, gaussian, &parameters)?.step(&observations)?;
    Ok((gaussian.asks.iter())
        .map(|ask| Answer {
            question: model.ask_text(ask),
            ln_evidence: (!observations.is_empty()).then_some(belief.ln_evidence),
            answer: (ask.searched.iter())
                .map(|searched| model.variable_name(searched.variable))
                .map(|name| {
                    let mean = belief.mean_of(&name).unwrap_or(f64::NAN);
                    let deviation = belief.deviation_of(&name).unwrap_or(f64::NAN);
                    Row { values: vec![(name, String::new())], figure: Figure::Normal { mean, deviation } }
                })
                .collect(),
        })
        .collect())
}

struct Reading<'r> {
    model: &'r Model,
    ask: &'r Ask,
    output: &'r Output,
    cells: &'r [f64],
    nearest: Option<&'r [f64]>,
}

impl Reading<'_> {
    fn answer(
        &self,
        lanes: &Lanes,
        inputs: &Inputs<'_, f64>,
        ln_evidence: Option<f64>,
    ) -> Result<Answer, Error> {
        let extents = lanes.extents(&self.output.name, inputs)?;
        // The plate's axes, if any, come after those of the named variables.
        let widths: Vec<usize> = self.output.variables.iter().map(|id| self.width(*id)).collect();
        let plate = extents.len() - widths.iter().sum::<usize>();
        let fixed = self.ask.searched.iter().filter_map(|searched| match &searched.at {
            Some(Value::Ordinal(ordinal)) if !self.output.variables.contains(&searched.variable) => {
                Some((searched.variable, self.model.value_name(searched.variable, *ordinal)))
            }
            Some(Value::Given(name)) => Some((searched.variable, name.clone())),
            Some(Value::Real(number)) => Some((searched.variable, number.to_string())),
            _ => None,
        });
        let fixed: Vec<(String, String)> =
            fixed.map(|(variable, value)| (self.model.variable_name(variable), value)).collect();
        let row = |position: usize, p: f64| {
            let (mut rest, mut ordinals) = (position, vec![0; extents.len()]);
            for (axis, extent) in extents.iter().enumerate().rev() {
                ordinals[axis] = rest % extent;
                rest /= extent;
            }
            let mut values: Vec<(String, String)> = Vec::new();
            let (own, place) = ordinals.split_at(ordinals.len() - plate);
            let mut own = own.iter().copied();
            for (variable, width) in self.output.variables.iter().zip(&widths) {
                let ordinals: Vec<usize> = own.by_ref().take(*width).collect();
                self.name_values(*variable, if *width == 0 { place } else { &ordinals }, &mut values);
            }
            if let (Some(index), false) = (self.model.plate_index(), self.over_plate()) {
                values.push((self.model.variable_name(index), joined(place)));
            }
            values.extend(fixed.clone());
            let figure = match self.ask.reduction {
                Reduction::Entropy => Figure::Entropy { entropy: p },
                _ => Figure::Probability { p },
            };
            Row { values, figure }
        };
        let rows = match &self.ask.reduction {
            Reduction::Argmax { .. } | Reduction::Maximum => {
                let known = |variable: &&VariableId| {
                    self.ask.searched.iter().all(|searched| searched.variable != **variable)
                };
                let rows = self.output.variables.iter().take_while(known).count();
                let rows: usize = widths[..rows].iter().sum();
                let searched_end = extents.len() - if self.over_plate() { 0 } else { plate };
                self.best(&extents, rows, searched_end)
            }
            _ => (0..self.cells.len()).collect(),
        };
        let answer = rows.into_iter().map(|position| row(position, self.cells[position])).collect();
        Ok(Answer { question: self.model.ask_text(self.ask), ln_evidence, answer })
    }

    /// The best positions of each context, which the axes before `start` and from `end` on tell apart.
    fn best(&self, extents: &[usize], start: usize, end: usize) -> Vec<usize> {
        let (rows, searched): (usize, usize) =
            (extents[..start].iter().product(), extents[start..end].iter().product());
        let places: usize = extents[end..].iter().product();
        let mut best = Vec::new();
        for context in 0..rows * places {
            let (row, place) = (context / places, context % places);
            let positions: Vec<usize> =
                (0..searched).map(|value| (row * searched + value) * places + place).collect();
            let gather =
                |field: &[f64]| positions.iter().map(|position| field[*position]).collect::<Vec<_>>();
            let tied = argmax(&gather(self.cells), self.nearest.map(gather).as_deref());
            let most = if self.ask.reduction == Reduction::Maximum { 1 } else { tied.len() };
            best.extend(tied.into_iter().take(most).map(|tied| positions[tied]));
        }
        best
    }

    /// How many axes of the output are a variable's own: none where it ranges over the plate's grid.
    fn width(&self, variable: VariableId) -> usize {
        let declared = &self.model.variables[variable];
        match (&declared.family, &declared.domain) {
            (Some(family), _) => self.model.index_count(&family.over).unwrap_or(1),
            (None, Domain::Set(set)) if self.model.sets[*set].kind == SetKind::Grid => {
                if self.model.plate.is_some_and(|plate| plate.set == *set) { 0 } else { 3 }
            }
            _ => 1,
        }
    }

    /// Whether a variable of the output ranges over the plate's grid.
    fn over_plate(&self) -> bool {
        self.output.variables.iter().any(|variable| self.width(*variable) == 0)
    }

    /// The names of a variable's value; of a family, one for each element.
    fn name_values(&self, variable: VariableId, ordinals: &[usize], values: &mut Vec<(String, String)>) {
        let name = self.model.variable_name(variable);
        match self.model.variables[variable].family.map(|family| family.over) {
            None if ordinals.len() > 1 => values.push((name, joined(ordinals))),
            None => values.push((name, self.model.value_name(variable, ordinals[0]))),
            Some(over) => {
                let low = if let IndexSpace::Range(range) = over { range.low } else { 0 };
                values.extend(ordinals.iter().zip(low..).map(|(ordinal, index)| {
                    (format!("{name}[{index}]"), self.model.value_name(variable, *ordinal))
                }));
            }
        }
    }
}

/// A cell, as text.
fn joined(place: &[usize]) -> String {
    place.iter().map(usize::to_string).collect::<Vec<_>>().join(",")
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
