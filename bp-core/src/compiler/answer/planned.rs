//! The marginals of many cases that know the same variables.
//!
//! In: a model, the wanted variables, and what a first case knows. Out: a plan, compiled once, whose inputs are the values of a
//! case. Invariant: the same strategies answer as where the values are written in the question.

use super::Answer;
use super::compiled::{CompiledQuestion, compile_with};
use super::marginals::{Asked, Knowledge, check};
use crate::error::Error;
use crate::exec::Inputs;
use crate::ids::VariableId;
use crate::model::{Finding, Known, Model, Value};
use crate::plan::{Group, Options};
use crate::sample::Sampling;
use crate::strategies::Case;

/// The marginals of cases that know the same variables, compiled once: their values are inputs.
pub(crate) struct Planned<'m> {
    model: &'m Model,
    wanted: Vec<VariableId>,
    compiled: CompiledQuestion<'m>,
}

impl<'m> Planned<'m> {
    /// The plan of cases that know what this one knows; `None` where each needs its own, as where components of a vector are
    /// missing, or where values that are not known in advance are answered in another way.
    pub(crate) fn new(
        model: &'m Model,
        wanted: Vec<VariableId>,
        knowledge: &Knowledge,
        options: Options,
    ) -> Option<Self> {
        let asked = Asked::new(&wanted, knowledge);
        let is_number = |known: &Known| {
            matches!(known.evidence, Finding::Hard(Value::Ordinal(_) | Value::Real(_)))
                && model.variables[known.variable].family.is_none()
        };
        let (weighed, hard): (Vec<&Known>, Vec<&Known>) =
            knowledge.known.iter().partition(|known| !matches!(known.evidence, Finding::Hard(_)));
        if !weighed.is_empty() || !hard.into_iter().all(is_number) {
            return None;
        }
        let elements = knowledge.elements.are_elements(model);
        let options = Options { group: Group::Marginals, elements, ..options };
        let own = asked.question(knowledge, &|known| known.evidence.clone());
        check(model, &own).ok()?;
        let own = compile_with(model, &own, options).ok()?;
        let given = |known: &Known| Finding::Hard(Value::Given(case_name(model, known.variable)));
        let compiled = compile_with(model, &asked.question(knowledge, &given), options).ok()?;
        (compiled.strategies == own.strategies).then_some(Self { model, wanted, compiled })
    }

    /// The posterior of each wanted variable in another case.
    ///
    /// # Errors
    /// As [`marginals`].
    pub(crate) fn marginals(
        &self,
        knowledge: &Knowledge,
        inputs: &Inputs<'_, f64>,
        sampling: Sampling,
    ) -> Result<Answer, Error> {
        let asked = Asked::new(&self.wanted, knowledge);
        let mut given = inputs.clone();
        for known in &knowledge.known {
            let number = match &known.evidence {
                Finding::Hard(Value::Ordinal(ordinal)) => {
                    self.model.variables[known.variable].domain.number(*ordinal)
                }
                Finding::Hard(Value::Real(number)) => *number,
                _ => {
                    return Err(Error::input(self.model.variable_name(known.variable), "it is not a number"));
                }
            };
            given = given.number(&case_name(self.model, known.variable), number);
        }
        let (question, findings) = (self.compiled.question(), Some(&knowledge.elements));
        let case = Case { question, inputs: &given, instants: &[], sampling, findings };
        let answers = self.compiled.answers(&case)?;
        asked.answer(self.model, (&self.wanted, knowledge), inputs, answers)
    }
}

/// The name of the input with the value of a variable in a case; no name of a program has a space.
fn case_name(model: &Model, variable: VariableId) -> String {
    format!("{} of the case", model.variable_name(variable))
}
