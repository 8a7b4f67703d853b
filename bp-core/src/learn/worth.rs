//! What expressions are worth in a case.
//!
//! In: an expression, the numbers of variables, and the defaults of parameters. Out: a number. Invariant: `None` where it
//! depends on what no case says.

use crate::ids::{ExpressionId, ParameterId, VariableId};
use crate::model::{Expression, IndexSpace, Model};

/// The numbers of variables.
pub(super) type Numbers<'n> = &'n dyn Fn(VariableId) -> Option<f64>;

/// The number that an expression is, with parameters at their defaults.
pub(super) fn worth(model: &Model, id: ExpressionId, numbers: Numbers<'_>) -> Option<f64> {
    let of = |id: ExpressionId| worth(model, id, numbers);
    match &model.expressions[id] {
        Expression::Number(number) => Some(*number),
        Expression::Variable(use_) if use_.element.is_none() => {
            let number = numbers(use_.variable)?;
            // In an expression a bin is its centre, whatever number was read in it.
            let domain = &model.variables[use_.variable].domain;
            match domain.is_finite() {
                true => domain.ordinal_at(number).map(|ordinal| domain.number(ordinal)),
                false => Some(number),
            }
        }
        Expression::Parameter { parameter, indices } => {
            let place = place(model, *parameter, indices, numbers)?;
            match model.parameters[*parameter].default.as_slice() {
                [number] => Some(*number),
                several => several.get(place).copied(),
            }
        }
        Expression::Unary(operator, operand) => Some(operator.apply(of(*operand)?)),
        Expression::Binary(operator, left, right) => Some(operator.apply(of(*left)?, of(*right)?)),
        Expression::If { condition, then, otherwise } => {
            of(if of(*condition)? != 0.0 { *then } else { *otherwise })
        }
        _ => None,
    }
}

/// The place of a field that some indices mean: row-major, the last index fastest.
pub(super) fn place(
    model: &Model,
    parameter: ParameterId,
    indices: &[ExpressionId],
    numbers: Numbers<'_>,
) -> Option<usize> {
    let mut place = 0;
    for (index, over) in indices.iter().zip(&model.parameters[parameter].over) {
        let IndexSpace::Range(range) = over else { return None };
        let count = model.index_count(over)?;
        let offset = worth(model, *index, numbers)? - range.low as f64;
        if offset.fract() != 0.0 || offset < 0.0 || offset >= count as f64 {
            return None;
        }
        place = place * count + offset as usize;
    }
    Some(place)
}

/// How many places a field has.
pub(super) fn places(model: &Model, parameter: ParameterId) -> Option<usize> {
    model.parameters[parameter].over.iter().map(|over| model.index_count(over)).product()
}

/// Every expression below one, itself included.
pub(super) fn each_below(model: &Model, id: ExpressionId, visit: &mut impl FnMut(&Expression)) {
    let expression = &model.expressions[id];
    visit(expression);
    match expression {
        Expression::Parameter { indices, .. } => {
            indices.iter().for_each(|index| each_below(model, *index, visit));
        }
        Expression::Unary(_, operand) => each_below(model, *operand, visit),
        Expression::Binary(_, left, right) => {
            each_below(model, *left, visit);
            each_below(model, *right, visit);
        }
        Expression::If { condition, then, otherwise } => {
            for part in [condition, then, otherwise] {
                each_below(model, *part, visit);
            }
        }
        Expression::Vector(_, parts) => parts.iter().for_each(|part| each_below(model, *part, visit)),
        _ => {}
    }
}
