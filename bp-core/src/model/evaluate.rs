//! Evaluates constant expressions, or expressions of given variables.
//!
//! In: an expression, and values of variables. Out: a number. Invariant: `None` if it depends on anything else.

use super::{Domain, Expression, Folded, IndexSpace, Model};
use crate::ids::{ExpressionId, Id, QuestionId, VariableId};

impl Model {
    /// The value of a constant expression; `None` if it depends on variables or parameters.
    pub fn constant(&self, id: ExpressionId) -> Option<f64> {
        self.evaluate(id, &|_| None)
    }

    /// The value of an expression for given variables; `None` if it depends on more.
    pub fn evaluate(&self, id: ExpressionId, value: &impl Fn(VariableId) -> Option<f64>) -> Option<f64> {
        if let Expression::Number(number) = &self.expressions[id] {
            return Some(*number);
        }
        let of = |expression: &Expression, below: &Folded<Option<f64>>| match expression {
            Expression::Number(number) => Some(*number),
            Expression::Variable(use_) if use_.element.is_none() => value(use_.variable),
            Expression::Unary(operator, operand) => Some(operator.apply((*below.of(*operand))?)),
            Expression::Binary(operator, left, right) => {
                Some(operator.apply((*below.of(*left))?, (*below.of(*right))?))
            }
            Expression::If { condition, then, otherwise } => {
                *below.of(if (*below.of(*condition))? != 0.0 { *then } else { *otherwise })
            }
            _ => None,
        };
        self.fold(id, of).root()
    }

    /// The number of elements of an index space, if it is known without any size.
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
