//! Questions that expand families into single variables once their sizes are known.
//!
//! In: a compiled question and its inputs. Out: the answers of the program that is written out, in the words of the one that
//! was asked. Invariant: it is written out where the question uses elements and no closed form answers it, or where
//! sums would need all elements of a family, some of which are missing.

use super::compiled::{CompiledQuestion, together};
use super::{Answer, Part, Table};
use crate::distribution::{Setting, WrittenOut, uses_elements};
use crate::error::Error;
use crate::exec::Inputs;
use crate::model::{Finding, Known, Model, Question, Value};
use crate::plan::{self, Options, Strategy};
use crate::posterior::check;
use crate::sample::Sampling;
use std::borrow::Cow;

/// Whether families are expanded into single variables.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Elements {
    /// No: a family is one variable.
    Together,
    /// Yes, where they can.
    Apart,
}

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
        let Some(written) = self.written_out(inputs)? else {
            return self.otherwise(|it| it.ask_with(inputs, sampling));
        };
        let compiled = together(Cow::Borrowed(&written.model), written.question.clone(), self.options())?;
        let mut answers = compiled.ask_with(inputs, sampling)?;
        for ((answer, back), ask) in answers.iter_mut().zip(&written.back).zip(&self.question().asks) {
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
        let Some(written) = self.written_out(inputs)? else { return self.otherwise(|it| it.tables(inputs)) };
        let compiled = together(Cow::Borrowed(&written.model), written.question.clone(), self.options())?;
        let mut tables = compiled.tables(inputs)?;
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

    fn written_out(&self, inputs: &Inputs<'_, f64>) -> Result<Option<WrittenOut>, Error> {
        if self.elements == Elements::Together {
            return Ok(None);
        }
        check::inputs(self.model(), self.question(), inputs)?;
        Setting::new(self.model(), inputs)?.written_out(self.question())
    }

    /// The same question by a strategy that answers where elements of a family are missing: loops need all of them.
    pub(super) fn where_some_are_missing(
        &self,
        inputs: &Inputs<'_, f64>,
    ) -> Option<Result<CompiledQuestion<'_>, Error>> {
        let is_missing = |known: &Known| match &known.evidence {
            Finding::Hard(Value::Given(name)) if self.model().variables[known.variable].family.is_some() => {
                inputs.find(name).is_some_and(|given| given.iter().any(|value| value.is_nan()))
            }
            _ => false,
        };
        let known = self.question().asks.iter().flat_map(|ask| ask.known.iter().chain(ask.statistic.from()));
        if !self.is_answered_by(Strategy::Sums) || !known.into_iter().any(is_missing) {
            return None;
        }
        let by = |by| {
            let (model, question) = (Cow::Borrowed(self.model()), self.question().clone());
            together(model, question, Options { by, ..self.options() })
        };
        Some(by(Some(Strategy::JoinTree)).or_else(|_| by(Some(Strategy::Weighting))))
    }
}
