//! Static properties of an expression: they hold for all values of variables and parameters.
//!
//! In: an expression. Out: whether it is a probability, finite. Invariant: a property is true only where the program text
//! implies it, so a kernel may skip the check.

use crate::ids::ExpressionId;
use crate::model::{Expression, Folded, Model, ParameterKind};
use crate::operators::{Binary, Unary};

/// Whether an expression lies in [0, 1] by construction.
pub(crate) fn is_probability(model: &Model, id: ExpressionId) -> bool {
    let of = |expression: &Expression, below: &Folded<bool>| match expression {
        Expression::Number(number) => (0.0..=1.0).contains(number),
        Expression::If { then, otherwise, .. } => *below.of(*then) && *below.of(*otherwise),
        _ => false,
    };
    model.fold(id, of).root()
}

/// Whether an expression is a finite number by construction.
pub(crate) fn is_finite(model: &Model, id: ExpressionId) -> bool {
    let of = |expression: &Expression, below: &Folded<bool>| match expression {
        Expression::Number(number) => number.is_finite(),
        Expression::Index(_)
        | Expression::First { .. }
        | Expression::Frontier { .. }
        | Expression::Innermost { .. } => true,
        Expression::Variable(use_) => model.variables[use_.variable].domain.is_finite(),
        Expression::Parameter { parameter, .. } => model.parameters[*parameter].kind == ParameterKind::Size,
        Expression::Unary(operator, operand) => match operator {
            Unary::Exponential
            | Unary::NaturalLogarithm
            | Unary::BinaryLogarithm
            | Unary::SquareRoot
            | Unary::LnGamma
            | Unary::LnBessel => false,
            _ => *below.of(*operand),
        },
        Expression::Binary(Binary::Divide | Binary::Power | Binary::Remainder, ..) => false,
        Expression::Binary(_, left, right) => *below.of(*left) && *below.of(*right),
        Expression::If { then, otherwise, .. } => *below.of(*then) && *below.of(*otherwise),
        _ => false,
    };
    model.fold(id, of).root()
}
