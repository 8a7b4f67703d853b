//! Questions of which each context is answered alone: `expectation P(Utility | Look)` of a real.
//!
//! In: a question whose known variables have no values, and no table over all of them. Out: its rows for each of their values.
//! Invariant: contexts are in the order of a table, the last variable fastest; an impossible one has no rows.

use super::{Answer, CompiledQuestion, Row};
use crate::error::Error;
use crate::exec::Inputs;
use crate::model::Model;
use crate::radix;
use crate::sample::Sampling;
use crate::strategies::Case;
use std::borrow::Cow;

impl CompiledQuestion<'_> {
    /// The rows of all contexts.
    ///
    /// # Errors
    /// As [`CompiledQuestion::ask`]; where all contexts are impossible, that of the last.
    pub(super) fn in_contexts(
        &self,
        inputs: &Inputs<'_, f64>,
        sampling: Sampling,
    ) -> Result<Vec<Answer>, Error> {
        let model: &Model = self.model();
        let counts: Vec<usize> =
            self.contexts.iter().filter_map(|id| model.variables[*id].domain.count()).collect();
        let (mut all, mut impossible) = (Vec::<Answer>::new(), None);
        for context in 0..counts.iter().product() {
            let ordinals = radix::in_order(context, counts.iter().copied());
            let (mut own, mut names) = (inputs.clone(), Vec::new());
            for (id, ordinal) in self.contexts.iter().zip(ordinals) {
                let (domain, name) = (&model.variables[*id].domain, model.variable_name(*id));
                own = own.numbers(&name, Cow::Owned(vec![domain.number(ordinal)]));
                names.push((name, model.value_name(*id, ordinal)));
            }
            let case =
                Case { question: self.question(), inputs: &own, instants: &[], sampling, findings: None };
            let answers = match self.answers(&case) {
                Err(error @ Error::Impossible(_)) => {
                    impossible = Some(error);
                    continue;
                }
                answers => answers?,
            };
            let named = |row: &Row| {
                let values = names.iter().chain(&row.values).cloned().collect();
                Row { values, figure: row.figure }
            };
            if all.is_empty() {
                all.extend(answers.iter().map(|answer| Answer {
                    answer: Vec::new().into(),
                    ln_evidence: None,
                    parts: Vec::new(),
                    ..answer.clone()
                }));
            }
            for (sum, answer) in all.iter_mut().zip(answers) {
                sum.answer.as_list().extend(answer.answer.iter().map(named));
                let effective = |of: &Answer| of.estimate.as_ref().map(|estimate| estimate.effective);
                if effective(&answer) < effective(sum) {
                    sum.estimate = answer.estimate;
                }
            }
        }
        for (answer, ask) in all.iter_mut().zip(&self.question().asks) {
            answer.question = model.ask_text(ask);
        }
        match (all.is_empty(), impossible) {
            (true, Some(error)) => Err(error),
            _ => Ok(all),
        }
    }
}
