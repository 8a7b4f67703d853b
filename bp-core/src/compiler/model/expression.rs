//! Expressions: the arithmetic in the forms of a model, over its variables and parameters.
//!
//! In: ids of variables, parameters and other expressions. Out: one node of the model's expression arena. Invariant: a
//! node only refers to nodes made before it; a `let` is replaced by a shared node.

use crate::ids::{ExpressionId, ParameterId, VariableId};
use crate::operators::{Binary, Unary};
use serde::{Deserialize, Serialize};

/// A variable, or one element of a family of variables.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct VariableUse {
    /// The variable.
    pub variable: VariableId,
    /// For a family: the element; `None` means all elements.
    pub element: Option<ExpressionId>,
}

impl From<VariableId> for VariableUse {
    fn from(variable: VariableId) -> Self {
        Self { variable, element: None }
    }
}

/// One node.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub enum Expression {
    /// A number; `true` is 1, a label is the number that its domain gives it.
    Number(f64),
    /// A parameter, with one index for each set that it ranges over.
    Parameter {
        /// The parameter.
        parameter: ParameterId,
        /// Its indices.
        indices: Vec<ExpressionId>,
    },
    /// The value of a variable as a number (see [`super::Domain`]), or as an element of its set, or as a vector.
    Variable(VariableUse),
    /// The index of the `depth`-th enclosing `prod` of the factor, outermost first.
    Index(usize),
    /// An operator on one operand.
    Unary(Unary, ExpressionId),
    /// An operator on two. `Add` and `Subtract` of a grid's element and a displacement move it.
    Binary(Binary, ExpressionId, ExpressionId),
    /// `if condition { then } else { otherwise }`; a `match` is a chain of these.
    If {
        /// A truth value.
        condition: ExpressionId,
        /// Where it is true.
        then: ExpressionId,
        /// Where it is false.
        otherwise: ExpressionId,
    },
    /// `first(G with O at C)`: the index of the first true element of the family, with `value` in place of the element
    /// at index `at`; one past the last index if all are false.
    First {
        /// A family of booleans along a range.
        family: VariableId,
        /// The replacement of one element: (value, index).
        with: Option<(ExpressionId, ExpressionId)>,
    },
    /// The answer of another program at a cell: `map.P(O | C)`, `map.H`. Given at run time under its text.
    Foreign {
        /// Its text, in normal spacing: the name under which it is given.
        path: String,
        /// The cell; `None` if the answer is one number.
        at: Option<ExpressionId>,
    },
    /// Length of the backward differences of a foreign field along the three axes of its grid (paper, Eq. 6).
    GradientNorm {
        /// The field: a `Foreign` node.
        field: ExpressionId,
        /// The cell.
        at: ExpressionId,
        /// The value of the field before the first cell of a line; without it the difference there is 0.
        before: Option<ExpressionId>,
    },
    /// `frontier(condition, C)`: whether C is the last cell, going outwards from the first, before the first one at
    /// which the condition fails (paper, section 3, step 1). The condition uses the same C.
    Frontier {
        /// A truth value at each cell.
        condition: ExpressionId,
        /// The cell.
        at: ExpressionId,
    },
    /// `innermost(C)`: whether C is the first cell, going outwards.
    Innermost {
        /// The cell.
        at: ExpressionId,
    },
    /// Components of a vector, or a function of vectors that has no kernel yet (`rotate`).
    Vector(String, Vec<ExpressionId>),
}
