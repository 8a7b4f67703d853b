//! What expressions are worth where nothing, or only variables, need to be known.
//!
//! In: an expression, and values of variables. Out: a number. Invariant: `None` where it depends on more; nothing is
//! guessed.

use super::{Domain, Expression, IndexSpace, Model};
use crate::ids::{ExpressionId, Id, QuestionId, VariableId};

impl Model {
    /// The number that an expression is, whatever the variables and parameters are; `None` if it depends on them.
    pub fn constant(&self, id: ExpressionId) -> Option<f64> {
        self.evaluate(id, &|_| None)
    }

    /// The number that an expression is where variables have these values; `None` if it depends on more.
    pub fn evaluate(&self, id: ExpressionId, value: &impl Fn(VariableId) -> Option<f64>) -> Option<f64> {
        match &self.expressions[id] {
            Expression::Number(number) => Some(*number),
            Expression::Variable(use_) if use_.element.is_none() => value(use_.variable),
            Expression::Unary(operator, operand) => Some(operator.apply(self.evaluate(*operand, value)?)),
            Expression::Binary(operator, left, right) => {
                Some(operator.apply(self.evaluate(*left, value)?, self.evaluate(*right, value)?))
            }
            Expression::If { condition, then, otherwise } => {
                let branch = if self.evaluate(*condition, value)? != 0.0 { *then } else { *otherwise };
                self.evaluate(branch, value)
            }
            _ => None,
        }
    }

    /// How many elements an index space has, where that is known without any size.
    pub fn index_count(&self, over: &IndexSpace) -> Option<usize> {
        match over {
            IndexSpace::Range(range) => Domain::Finite { labels: Vec::new(), range: Some(*range) }.count(),
            IndexSpace::Set(_) => None,
        }
    }

    /// The position of a question among the declared ones.
    pub fn question_id(&self, name: &str) -> Option<QuestionId> {
        self.questions
            .ids()
            .find(|id| self.questions[*id].name == name && id.position() < self.questions.len())
    }
}
