//! Reports faults of the model at their source.
//!
//! In: [`Fault`]s with places in the model. Out: diagnostics with spans. Invariant: an error of a declaration, a factor
//! or a form is not reported a second time in other words.

use super::Checker;
use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::model::{Fault, Model, Place};
use crate::source::Span;

/// A fault at a span.
pub(super) fn diagnostic(fault: &Fault, span: Span) -> Diagnostic {
    Diagnostic { span, message: fault.message.clone(), labels: Vec::new(), help: fault.help.clone() }
}

impl Checker<'_> {
    /// The model, or all its errors.
    pub(super) fn finish(mut self) -> Result<Model, Diagnostics> {
        let model = std::mem::replace(&mut self.model, crate::model::ModelBuilder::new(""));
        let before = model.so_far().clone();
        match model.build() {
            Ok(model) => self.wrong.or(model),
            Err(faults) => {
                for fault in faults {
                    if !self.is_reported(&before, fault.place) {
                        let span = self.span_of(fault.place);
                        self.wrong.push(diagnostic(&fault, span));
                    }
                }
                self.wrong.sort();
                Err(self.wrong)
            }
        }
    }

    fn is_reported(&self, model: &Model, place: Place) -> bool {
        match place {
            Place::Variable(id) => self.broken_variables.contains(&id),
            Place::Form(id) | Place::Expression(id, _) | Place::Row(id, ..) => {
                let factor = &model.factors[id];
                let mut uses = factor.left.iter().chain(&factor.right);
                self.broken_forms.contains(&id)
                    || uses.any(|use_| self.broken_variables.contains(&use_.variable))
            }
            Place::Parameter(_) | Place::Factor(_) | Place::Ask(..) => false,
        }
    }

    fn span_of(&self, place: Place) -> Span {
        let found = match place {
            Place::Parameter(id) => self.parameter_spans.get(&id).copied(),
            Place::Variable(id) => self.variable_spans.get(&id).copied(),
            Place::Factor(id) => self.factor_spans.get(&id).copied(),
            Place::Form(id) => self.form_spans.get(&id).or_else(|| self.factor_spans.get(&id)).copied(),
            Place::Expression(id, expression) => {
                self.expression_spans.get(&expression).or_else(|| self.form_spans.get(&id)).copied()
            }
            Place::Row(id, first, last) => {
                let of = |entry| self.span_of(Place::Expression(id, entry));
                Some(of(first).to(of(last)))
            }
            Place::Ask(Some(question), position) => self.ask_spans.get(&(question, position)).copied(),
            Place::Ask(None, _) => None,
        };
        found.unwrap_or(self.program.name.at.0)
    }
}
