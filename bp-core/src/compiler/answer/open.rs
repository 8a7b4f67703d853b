//! Questions with open values: `P(Rain | Wet)`, `P(Rain | Wet = wet)`.
//!
//! In: a question, and which of its open variables are given or missing. Out: the question to be asked. Invariant: a
//! given value replaces an open one; a missing variable is removed from the known ones.

use super::{Answer, CompiledQuestion};
use crate::error::Error;
use crate::exec::Inputs;
use crate::ids::VariableId;
use crate::model::{Finding, Known, Model, Question, Statistic, Value};
use crate::sample::Sampling;
use std::borrow::Cow;
use std::collections::BTreeSet;

/// The variables whose values a question leaves open.
pub fn open(question: &Question) -> BTreeSet<VariableId> {
    let mut open = BTreeSet::new();
    each_open(&mut question.clone(), &mut |id, _| {
        open.insert(id);
        Filled::Not
    });
    open
}

/// The question with some of its open variables given under their own names, and others removed from the known ones.
pub fn filled(
    model: &Model,
    question: &Question,
    given: &BTreeSet<VariableId>,
    missing: &BTreeSet<VariableId>,
) -> Question {
    let mut question = question.clone();
    each_open(&mut question, &mut |id, _| match (missing.contains(&id), given.contains(&id)) {
        (true, _) => Filled::Missing,
        (_, true) => Filled::With(Value::Given(model.variable_name(id))),
        _ => Filled::Not,
    });
    question
}

/// The treatment of an open variable.
enum Filled {
    Not,
    With(Value),
    Missing,
}

/// Applies `fill` to each open variable, with the value that the question names.
fn each_open(question: &mut Question, fill: &mut dyn FnMut(VariableId, Option<&Value>) -> Filled) {
    let mut visit = |known: &mut Vec<Known>| {
        known.retain_mut(|known| {
            let filled = match &known.evidence {
                Finding::Each => fill(known.variable, None),
                Finding::Hard(value @ Value::Given(_)) => fill(known.variable, Some(value)),
                _ => Filled::Not,
            };
            if let Filled::With(value) = filled {
                known.evidence = Finding::Hard(value);
                return true;
            }
            matches!(filled, Filled::Not)
        });
    };
    for ask in &mut question.asks {
        visit(&mut ask.known);
        if let Statistic::Divergence { from, .. } = &mut ask.statistic {
            visit(from);
        }
    }
    for item in question.asks.iter_mut().flat_map(|ask| &mut ask.searched) {
        let Some(value @ Value::Given(_)) = &item.at else { continue };
        match fill(item.variable, Some(value)) {
            Filled::Not => {}
            Filled::With(value) => item.at = Some(value),
            Filled::Missing => item.at = None,
        }
    }
}

impl CompiledQuestion<'_> {
    /// The inputs, with the defaults of parameters that the question names as values: `P(Mu | Y = effect)`.
    pub(super) fn with_defaults<'i>(&self, inputs: &Inputs<'i, f64>) -> Inputs<'i, f64> {
        let known = self.question().asks.iter().flat_map(|ask| ask.known.iter().chain(ask.statistic.from()));
        let named = known.filter_map(|known| match &known.evidence {
            Finding::Hard(Value::Given(name)) => Some((known.variable, name)),
            _ => None,
        });
        let searched = self.question().asks.iter().flat_map(|ask| &ask.searched);
        let named = named.chain(searched.filter_map(|item| match &item.at {
            Some(Value::Given(name)) => Some((item.variable, name)),
            _ => None,
        }));
        let mut inputs = inputs.clone();
        for (variable, name) in named {
            let parameter = self.model().parameters.values().find(|parameter| parameter.name == *name);
            let alone = self.model().variables[variable].family.is_none();
            if let Some(default) = parameter.map(|parameter| &parameter.default)
                && inputs.find(name).is_none()
                && (default.len() > 1 || alone && !default.is_empty())
            {
                inputs = inputs.numbers(name, Cow::Owned(default.clone()));
            }
        }
        inputs
    }

    /// Answers a question whose open variables may be given under their own names; the answers show the values.
    ///
    /// # Errors
    /// As [`CompiledQuestion::ask`].
    pub fn ask_filled(&self, inputs: &Inputs<'_, f64>, sampling: Sampling) -> Result<Vec<Answer>, Error> {
        let (model, question) = (self.model(), self);
        let mut filled = question.question().clone();
        each_open(&mut filled, &mut |id, value| {
            let name = model.variable_name(id);
            match (value, inputs.find(&name)) {
                (Some(Value::Given(given)), Some([number])) if *given == name => {
                    let domain = &model.variables[id].domain;
                    Filled::With(match domain.ordinal_among(*number, None).filter(|_| domain.is_finite()) {
                        Some(ordinal) => Value::Ordinal(ordinal),
                        None => Value::Real(*number),
                    })
                }
                _ => Filled::Not,
            }
        });
        let texts: Vec<String> = filled.asks.iter().map(|ask| model.ask_text(ask)).collect();
        let mut answers = question.ask_with(inputs, sampling).map_err(|error| match error {
            Error::Impossible(mut impossible) => {
                let mut asks = question.question().asks.iter();
                if let Some(at) = asks.position(|ask| model.ask_text(ask) == impossible.question) {
                    impossible.question.clone_from(&texts[at]);
                }
                Error::Impossible(impossible)
            }
            other => other,
        })?;
        for (answer, text) in answers.iter_mut().zip(texts) {
            answer.question = text;
        }
        Ok(answers)
    }
}
