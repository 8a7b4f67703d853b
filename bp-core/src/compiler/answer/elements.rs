//! Questions that expand families into single variables once their sizes are known.
//!
//! In: a compiled question and its inputs. Out: the answers of the expanded program, with the names of the original
//! one. Invariant: a family is expanded where the question uses single elements, or where only expansion makes the
//! program linear and Gaussian.

use super::compiled::{CompiledQuestion, together};
use super::{Answer, Part, Table};
use crate::distribution::{Setting, WrittenOut, may_be_linear, speaks_of_elements};
use crate::error::Error;
use crate::exec::Inputs;
use crate::model::{Model, Question};
use crate::plan::{self, Strategy};
use crate::posterior::check;
use crate::sample::Sampling;
use std::borrow::Cow;

/// Whether families are expanded into single variables.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Elements {
    /// No: a family is one variable.
    Together,
    /// Yes, if the expanded program is linear and Gaussian.
    Perhaps,
    /// Yes, wherever possible.
    Apart,
}

impl Elements {
    pub(super) fn of(model: &Model, question: &Question, by: Option<Strategy>) -> Self {
        let over_time = question.asks.iter().any(|ask| ask.when.is_over_time());
        let closed = by.is_none_or(|by| by == Strategy::Gaussian);
        match over_time || model.plate.is_some() {
            true => Elements::Together,
            false if speaks_of_elements(model) => Elements::Apart,
            false if closed && may_be_linear(model) => Elements::Perhaps,
            false => Elements::Together,
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
        let written = Setting::new(self.model(), inputs)?.written_out(self.question())?;
        let closed = |it: &WrittenOut| plan::is_closed(&it.model, &it.question);
        Ok(written.filter(|it| self.elements == Elements::Apart || closed(it)))
    }
}
