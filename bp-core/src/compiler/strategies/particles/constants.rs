//! Constants over time: hidden reals that keep the value they have before the first instant.
//!
//! In: a program over time. Out: whether particles draw a constant; an error where few of its values are left. Invariant: a value
//! that no particle has any more does not come back, so that the particles of one origin are one draw of the constants: their
//! standard errors are those between origins at the start, and a few origins give none.

use super::{Cloud, Moves};
use crate::door::Advice;
use crate::error::Error;
use crate::ids::VariableId;
use crate::model::{Ask, Expression, Form, Model};

/// The effective number of values below which a standard error says nothing.
const FEW_VALUES: f64 = 5.0;

/// A real that is drawn once, before the first instant.
pub(super) fn constant(
    model: &Model,
    carried: &[(VariableId, VariableId)],
    linear: &[VariableId],
) -> Option<VariableId> {
    let keeps = |(now, before): &&(VariableId, VariableId)| {
        let form = model.factor_of(*now).map(|factor| &model.factors[factor].form);
        let Some(Form::Dirac(value)) = form else { return false };
        let is_real = !model.variables[*now].domain.is_finite() && !linear.contains(now);
        is_real
            && matches!(&model.expressions[*value], Expression::Variable(use_) if use_.variable == *before)
    };
    carried.iter().find(keeps).map(|(now, _)| *now)
}

impl Moves<'_> {
    /// The error that too few values of a constant are left after some instants.
    pub(crate) fn check_constants(&self, cloud: &Cloud, ask: &Ask) -> Result<(), Error> {
        let model = self.setting.model;
        let Some(id) = self.constant.filter(|_| cloud.values_left() < FEW_VALUES) else { return Ok(()) };
        let (name, count) = (model.variable_name(id), cloud.particles.len());
        let (left, instant) = (cloud.values_left().ceil(), cloud.effective.len());
        let reason = format!(
            "`{name}` is constant over time, and about {left} of its {count} draws are left at instant {instant}: \
             their error is not known; take the rows as the elements of a family (`{}`), or more particles (`{}`)",
            Advice::Rows,
            Advice::Draws
        );
        Err(Error::Unplanned { question: model.ask_text(ask), reason })
    }
}
