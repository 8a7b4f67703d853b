//! What expressions are worth where nothing, or only variables, need to be known.
//!
//! In: an expression, and values of variables. Out: a number. Invariant: `None` where it depends on more; nothing is
//! guessed.

use super::{Domain, Expression, Folded, IndexSpace, Model};
use crate::ids::{ExpressionId, Id, QuestionId, VariableId};

impl Model {
    /// The number that an expression is, whatever the variables and parameters are; `None` if it depends on them.
    pub fn constant(&self, id: ExpressionId) -> Option<f64> {
        self.evaluate(id, &|_| None)
    }

    /// The number that an expression is where variables have these values; `None` if it depends on more.
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
