//! The semantics of expressions: the value of each node, given its operands.
//!
//! In: an expression, and an [`Environment`] that supplies variables, parameters, indices and an arithmetic. Out: a
//! number of that arithmetic. Invariant: operators and choices are written once, for numbers (draws, chains, trees,
//! learning, constants) and for the nodes of a kernel.

use super::{Domain, Expression, Folded, IndexSpace, Model, VariableUse};
use crate::ids::{ExpressionId, ParameterId, VariableId};
use crate::law::{Arithmetic, Numbers};

/// The values of the parts of an expression.
pub trait Environment: Sized {
    /// The arithmetic of the evaluation.
    type By: Arithmetic;
    /// The reason why an expression has no value.
    type Stop;

    /// The arithmetic.
    fn by(&mut self) -> &mut Self::By;
    /// The value of an operand.
    fn operand(&mut self, id: ExpressionId) -> Read<Self>;
    /// The value of an operand that is a scalar even where vectors are evaluated: an index or a condition.
    fn scalar(&mut self, id: ExpressionId) -> Read<Self> {
        self.operand(id)
    }
    /// A parameter; of a field, its element at these indices.
    fn parameter(&mut self, parameter: ParameterId, indices: &[ExpressionId]) -> Read<Self>;
    /// The number of a variable's value.
    fn variable(&mut self, use_: &VariableUse) -> Read<Self>;
    /// The index of the enclosing `prod` at this depth.
    fn index(&mut self, depth: usize) -> Read<Self>;
    /// The index of the first true element of a family.
    fn first(&mut self, family: VariableId, with: Option<(ExpressionId, ExpressionId)>) -> Read<Self>;
    /// The answer of another program, a value at a cell of a grid, or a vector.
    fn other(&mut self, expression: &Expression) -> Read<Self>;

    /// The value of a node.
    ///
    /// # Errors
    /// As the operands and the environment.
    fn value(&mut self, expression: &Expression) -> Read<Self> {
        Ok(match expression {
            Expression::Number(number) => self.by().constant(*number),
            Expression::Parameter { parameter, indices } => self.parameter(*parameter, indices)?,
            Expression::Variable(use_) => self.variable(use_)?,
            Expression::Index(depth) => self.index(*depth)?,
            Expression::Unary(operator, operand) => {
                let operand = self.operand(*operand)?;
                self.by().unary(*operator, operand)
            }
            Expression::Binary(operator, left, right) => {
                let (left, right) = (self.operand(*left)?, self.operand(*right)?);
                self.by().binary(*operator, left, right)
            }
            Expression::If { condition, then, otherwise } => {
                let condition = self.scalar(*condition)?;
                match self.by().known(condition) {
                    Some(condition) => self.operand(if condition != 0.0 { *then } else { *otherwise })?,
                    None => {
                        let (then, otherwise) = (self.operand(*then)?, self.operand(*otherwise)?);
                        self.by().select(condition, then, otherwise)
                    }
                }
            }
            Expression::First { family, with } => self.first(*family, *with)?,
            other => self.other(other)?,
        })
    }
}

/// The value of an expression in an environment, or the reason why it has none.
pub type Read<E> = Result<<<E as Environment>::By as Arithmetic>::Number, <E as Environment>::Stop>;

/// An environment in which only some variables have values. An expression that depends on others has no value.
struct Partly<'e, F> {
    value: &'e F,
    index: &'e dyn Fn(usize) -> Option<f64>,
    below: &'e Folded<Option<f64>>,
    by: Numbers,
}

impl<F: Fn(&VariableUse) -> Option<f64>> Environment for Partly<'_, F> {
    type By = Numbers;
    type Stop = ();

    fn by(&mut self) -> &mut Numbers {
        &mut self.by
    }
    fn operand(&mut self, id: ExpressionId) -> Read<Self> {
        self.below.of(id).ok_or(())
    }
    fn parameter(&mut self, _: ParameterId, _: &[ExpressionId]) -> Read<Self> {
        Err(())
    }
    fn variable(&mut self, use_: &VariableUse) -> Read<Self> {
        (self.value)(use_).ok_or(())
    }
    fn index(&mut self, depth: usize) -> Read<Self> {
        (self.index)(depth).ok_or(())
    }
    fn first(&mut self, _: VariableId, _: Option<(ExpressionId, ExpressionId)>) -> Read<Self> {
        Err(())
    }
    fn other(&mut self, _: &Expression) -> Read<Self> {
        Err(())
    }
}

impl Model {
    /// The value of a constant expression; `None` if it depends on variables or parameters.
    pub fn constant(&self, id: ExpressionId) -> Option<f64> {
        self.evaluate(id, &|_| None)
    }

    /// The value of an expression for given variables; `None` if it depends on more.
    pub fn evaluate(&self, id: ExpressionId, value: &impl Fn(VariableId) -> Option<f64>) -> Option<f64> {
        self.evaluate_uses(id, &|use_| use_.element.is_none().then(|| value(use_.variable)).flatten())
    }

    /// The number of an expression at these values of variables and elements of families.
    pub fn evaluate_uses(
        &self,
        id: ExpressionId,
        value: &impl Fn(&VariableUse) -> Option<f64>,
    ) -> Option<f64> {
        self.evaluate_partly(id, value, &|_| None)
    }

    /// The number of an expression where the indices of `prod`s are known, by their depths; `None` if it depends on more.
    pub(crate) fn evaluate_at(&self, id: ExpressionId, index: &dyn Fn(usize) -> Option<f64>) -> Option<f64> {
        self.evaluate_partly(id, &|_| None, index)
    }

    fn evaluate_partly(
        &self,
        id: ExpressionId,
        value: &impl Fn(&VariableUse) -> Option<f64>,
        index: &dyn Fn(usize) -> Option<f64>,
    ) -> Option<f64> {
        if let Expression::Number(number) = &self.expressions[id] {
            return Some(*number);
        }
        let of = |expression: &Expression, below: &Folded<Option<f64>>| {
            Partly { value, index, below, by: Numbers }.value(expression).ok()
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
}
