//! Questions that expand families into single variables once their sizes are known.
//!
//! In: a compiled question and its inputs. Out: the answers of the program that is written out, in the words of the one that
//! was asked. Invariant: it is written out where the question uses elements and no closed form answers it, or where
//! sums would need all elements of a family, some of which are missing.

use super::compiled::{CompiledQuestion, compile_sized, together};
use super::{Answer, Part, Table};
use crate::distribution::{Setting, WrittenOut, uses_elements};
use crate::error::Error;
use crate::exec::Inputs;
use crate::ids::VariableId;
use crate::model::{Domain, Finding, Known, Model, Question, Value};
use crate::plan::{self, Options, Plan, Strategy};
use crate::posterior::check;
use crate::sample::Sampling;
use crate::strategies::Case;
use std::borrow::Cow;
use std::collections::HashMap;

/// Whether families are expanded into single variables.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Elements {
    /// No: a family is one variable.
    Together,
    /// Yes, where they can.
    Apart,
    /// Yes, where an exact strategy then answers.
    IfExact,
}

/// Above this many numbers, families are not expanded to see whether an exact strategy then answers.
const MOST_EXPANDED: usize = 10_000;

/// The plan of a question for these inputs, whose numbers matter only as far as they are sizes; and the program of which it is
/// the plan: the model, or the model with its families expanded, as [`compile_sized`](super::compile_sized) answers it.
///
/// # Errors
/// As [`compile_sized`](super::compile_sized).
pub fn plan_sized<'m>(
    model: &'m Model,
    question: &Question,
    options: Options,
    inputs: &Inputs<'_, f64>,
) -> Result<(Cow<'m, Model>, Plan), Error> {
    let compiled = compile_sized(model, question, options)?;
    let (model, question) = match compiled.expanded(inputs)? {
        Some((expanded, _)) => {
            let expanded = expanded.into_owned();
            (Cow::Owned(expanded.model().clone()), expanded.question().clone())
        }
        None => (Model::with_constants(Cow::Borrowed(model), question), question.clone()),
    };
    let plan = plan::plan_or_contexts(&model, &question, options)?;
    Ok((model, plan))
}

/// The program, extended by what the question derives from it.
pub(super) fn posed<'m>(model: Cow<'m, Model>, question: &Question) -> (Cow<'m, Model>, Question) {
    if model.is_posed(question) {
        return (model, question.clone());
    }
    let mut model = model.into_owned();
    let question = model.pose(question);
    (Cow::Owned(model), question)
}

/// The same, with the numbers of constants in place of their variables.
pub(super) fn posed_with_constants<'m>(
    model: Cow<'m, Model>,
    question: &Question,
) -> (Cow<'m, Model>, Question) {
    let (model, question) = posed(model, question);
    (Model::with_constants(model, &question), question)
}

/// For each ask, the original of each of its variables: a variable, and its element.
type Back = Vec<HashMap<VariableId, (VariableId, Option<i64>)>>;

impl Elements {
    pub(super) fn of(model: &Model, question: &Question, by: Option<Strategy>) -> Self {
        let over_time = question.asks.iter().any(|ask| ask.when.is_over_time());
        let closed = by.is_none_or(|by| by == Strategy::Gaussian) && plan::is_closed(model, question);
        match over_time || closed || model.plate.is_some() || !uses_elements(model) {
            true => Elements::Together,
            false => Elements::Apart,
        }
    }
}

impl CompiledQuestion<'_> {
    /// The answers of the expanded program; `None` where it is not expanded.
    pub(super) fn ask_apart(
        &self,
        inputs: &Inputs<'_, f64>,
        sampling: Sampling,
    ) -> Result<Option<Vec<Answer>>, Error> {
        let Some((expanded, back)) = self.expanded(inputs)? else {
            return self.otherwise(|it| it.ask_with(inputs, sampling));
        };
        let mut answers = match expanded.ask_with(inputs, sampling) {
            // A missing element matters: the draws of the program as it is do without.
            Err(Error::Unplanned { .. }) if self.elements == Elements::IfExact => {
                return self.otherwise(|it| it.ask_with(inputs, sampling));
            }
            found => found.map_err(|error| self.as_asked(error))?,
        };
        for ((answer, back), ask) in answers.iter_mut().zip(&back).zip(&self.question().asks) {
            answer.question = self.model().ask_text(ask);
            let slots = |part: &mut Part| {
                for slot in part.of.iter_mut().chain(&mut part.given) {
                    if let Some((variable, index)) = back.get(&slot.variable) {
                        slot.variable = *variable;
                        slot.index = index.or(slot.index);
                    }
                }
            };
            answer.parts.iter_mut().for_each(slots);
        }
        Ok(Some(answers))
    }

    /// The tables of the expanded program; `None` where it is not expanded.
    pub(super) fn tables_apart(&self, inputs: &Inputs<'_, f64>) -> Result<Option<Vec<Table>>, Error> {
        let Some((expanded, _)) = self.expanded(inputs)? else {
            return self.otherwise(|it| it.tables(inputs));
        };
        let mut tables = expanded.tables(inputs).map_err(|error| self.as_asked(error))?;
        for (table, ask) in tables.iter_mut().zip(&self.question().asks) {
            table.question = self.model().ask_text(ask);
        }
        Ok(Some(tables))
    }

    /// The answer of the original program, which is compiled now if it was not before.
    fn otherwise<T>(
        &self,
        asked: impl FnOnce(&CompiledQuestion<'_>) -> Result<T, Error>,
    ) -> Result<Option<T>, Error> {
        match self.is_compiled() {
            true => Ok(None),
            false => {
                let (model, question) = (Cow::Borrowed(self.model()), self.question().clone());
                asked(&together(model, question, self.options())?).map(Some)
            }
        }
    }

    /// The same question of the expanded program; `None` where it is not expanded.
    fn expanded(&self, inputs: &Inputs<'_, f64>) -> Result<Option<(CompiledQuestion<'static>, Back)>, Error> {
        let compiled = |WrittenOut { model, question, back }: WrittenOut| {
            Ok((together(Cow::Owned(model), question, self.options())?, back))
        };
        match self.elements {
            Elements::Together => Ok(None),
            Elements::Apart => {
                let written = self.written_out(inputs, usize::MAX)?;
                written.map(compiled).transpose().map_err(|error| self.as_asked(error))
            }
            // Where it cannot be expanded, or no strategy then answers, the draws of the program as it is do.
            Elements::IfExact => {
                let expanded = self.written_out(inputs, MOST_EXPANDED).map(|written| written.map(compiled));
                Ok(match expanded {
                    Ok(Some(Ok((expanded, back)))) if !expanded.is_estimated() => Some((expanded, back)),
                    _ => None,
                })
            }
        }
    }

    /// A refusal of the expanded question, in the words of the one that was asked.
    fn as_asked(&self, error: Error) -> Error {
        let asked =
            || self.question().asks.first().map_or_else(String::new, |ask| self.model().ask_text(ask));
        match error {
            Error::Unplanned { reason, .. } => Error::Unplanned { question: asked(), reason },
            Error::Refused { by, reason, .. } => Error::Refused { by, question: asked(), reason },
            other => other,
        }
    }

    fn written_out(&self, inputs: &Inputs<'_, f64>, most: usize) -> Result<Option<WrittenOut>, Error> {
        check::inputs(self.model(), self.question(), inputs)?;
        let setting = Setting::new(self.model(), inputs)?;
        if setting.slots() > most { Ok(None) } else { setting.written_out(self.question()) }
    }

    /// The same question by a strategy that answers where elements of a family are missing: loops need all of them.
    pub(super) fn where_some_are_missing(
        &self,
        inputs: &Inputs<'_, f64>,
    ) -> Option<Result<CompiledQuestion<'_>, Error>> {
        if !self.is_answered_by(Strategy::Sums) || !self.known_lack_values(inputs) {
            return None;
        }
        let by = |by| self.by(by);
        Some(by(Strategy::JoinTree).or_else(|_| by(Strategy::Mixture)).or_else(|_| by(Strategy::Weighting)))
    }

    /// The answers of a group of asks, which may know single elements; by draws where an exact strategy needs what is missing.
    pub(super) fn answers_or_draws(&self, case: &Case<'_>) -> Result<Vec<Answer>, Error> {
        self.or_by_draws(self.answers(case), case.inputs, |drawn| drawn.answers(case))
    }

    /// What was found; by draws where an exact strategy needs what is missing, and the user leaves the strategy open.
    pub(super) fn or_by_draws<T>(
        &self,
        found: Result<T, Error>,
        inputs: &Inputs<'_, f64>,
        again: impl FnOnce(&CompiledQuestion<'_>) -> Result<T, Error>,
    ) -> Result<T, Error> {
        match found {
            Err(refused @ Error::Unplanned { .. })
                if self.options.by.is_none() && self.known_lack_values(inputs) =>
            {
                self.by_draws().map_or(Err(refused), |drawn| again(&drawn))
            }
            found => found,
        }
    }

    /// The same question by draws, which need no value of what is not observed; what does not depend on missing elements may still
    /// be exact.
    fn by_draws(&self) -> Result<CompiledQuestion<'_>, Error> {
        let mut drawn = self.by(Strategy::Weighting).or_else(|_| self.by(Strategy::Gibbs))?;
        if self.model().variables.values().any(|variable| variable.family.is_some()) {
            (drawn.elements, drawn.options) = (Elements::IfExact, self.options());
        }
        Ok(drawn)
    }

    fn by(&self, by: Strategy) -> Result<CompiledQuestion<'_>, Error> {
        let (model, question) = (Cow::Borrowed(self.model()), self.question().clone());
        together(model, question, Options { by: Some(by), ..self.options() })
    }

    /// Whether values of a known family, or components of a known vector, are missing.
    fn known_lack_values(&self, inputs: &Inputs<'_, f64>) -> bool {
        let is_missing = |known: &Known| {
            let variable = &self.model().variables[known.variable];
            let name = match &known.evidence {
                Finding::Hard(Value::Vector(numbers)) => return numbers.iter().any(|value| value.is_nan()),
                Finding::Hard(Value::Given(name)) => name.clone(),
                Finding::Each => self.model().variable_name(known.variable),
                _ => return false,
            };
            (variable.family.is_some() || matches!(variable.domain, Domain::Vector(_)))
                && inputs.find(&name).is_some_and(|given| given.iter().any(|value| value.is_nan()))
        };
        let asks = || self.question().asks.iter();
        asks().flat_map(|ask| ask.known.iter().chain(ask.statistic.from())).any(is_missing)
    }
}
