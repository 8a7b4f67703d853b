//! Reals that are constants: `P(C) = dirac(2)`.
//!
//! In: a program and a question. Out: the program in which other forms read the number in place of the variable. Invariant: the
//! variable keeps its factor, so that it can be searched; where it is known, it may have another value, and nothing is replaced.
//!
//! So `normal(C * X, 1)` is linear in X, and `poisson(C * L)` has a conjugate prior.

use super::{Domain, Expression, Form, Known, Model, Question};
use crate::ids::VariableId;
use std::borrow::Cow;

impl Model {
    /// The program with the numbers of constants in place of their variables.
    pub fn with_constants<'m>(model: Cow<'m, Self>, question: &Question) -> Cow<'m, Self> {
        let mut model = model;
        // A constant may be made of others.
        while let Some((variable, number)) = model.next_constant(question) {
            let is_read =
                |node: &Expression| matches!(node, Expression::Variable(use_) if use_.variable == variable);
            let own = model.to_mut();
            for id in own.expressions.ids().collect::<Vec<_>>() {
                if is_read(&own.expressions[id]) {
                    own.expressions[id] = Expression::Number(number);
                }
            }
        }
        model
    }

    /// A real with a constant value that some form reads, and that the question does not know.
    fn next_constant(&self, question: &Question) -> Option<(VariableId, f64)> {
        let knows = |known: &[Known], id: VariableId| known.iter().any(|known| known.variable == id);
        let asks = question.asks.iter().flat_map(|ask| [&ask.known[..], ask.statistic.from()]);
        self.factors.values().find_map(|factor| {
            let (Form::Dirac(value), [left]) = (&factor.form, factor.left.as_slice()) else { return None };
            let variable = &self.variables[left.variable];
            if variable.domain != Domain::Real || variable.family.is_some() || variable.previous_of.is_some() {
                return None;
            }
            let number = self.constant(*value).filter(|number| number.is_finite())?;
            let reads = |node: &Expression| matches!(node, Expression::Variable(use_) if use_.variable == left.variable);
            let is_known = asks.clone().any(|known| knows(known, left.variable));
            (!is_known && self.expressions.values().any(reads)).then_some((left.variable, number))
        })
    }
}
