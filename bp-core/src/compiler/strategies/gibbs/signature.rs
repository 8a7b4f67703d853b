//! When two instances of a factor are the same function of the drawn variables.
//!
//! In: an expression in an instance. Out: its leaves as numbers. Invariant: where they are equal, the expression has equal values
//! whatever the drawn variables are.

use crate::distribution::{Instance, Setting};
use crate::ids::ExpressionId;
use crate::model::Expression;

/// The leaves of an expression: numbers, and the slots that it reads as `place` names them.
pub(super) fn signature(
    setting: &Setting<'_>,
    id: ExpressionId,
    instance: &Instance,
    place: &dyn Fn(usize) -> u64,
) -> Vec<u64> {
    let mut leaves = Vec::new();
    let mut rest = vec![id];
    while let Some(id) = rest.pop() {
        let read = |id: ExpressionId| setting.slots_read(id, &instance.indices);
        match &setting.model.expressions[id] {
            Expression::Number(_) => {}
            Expression::Index(_) => leaves.push(setting.expression(id, instance, &[]).to_bits()),
            Expression::Parameter { indices, .. } if indices.iter().all(|index| read(*index).is_empty()) => {
                leaves.push(setting.expression(id, instance, &[]).to_bits());
            }
            Expression::Variable(use_) => {
                leaves.extend(setting.slots_used(use_, &instance.indices).map(place));
                // An index that depends on a variable.
                rest.extend(use_.element.filter(|element| !read(*element).is_empty()));
            }
            Expression::First { family, .. } => {
                leaves.extend(setting.slots_of(*family).map(place));
                setting.model.expressions[id].each_operand(&mut |operand| rest.push(operand));
            }
            other => other.each_operand(&mut |operand| rest.push(operand)),
        }
    }
    leaves
}
