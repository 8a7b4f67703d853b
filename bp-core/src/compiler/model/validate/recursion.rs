//! Validation of factors that read other elements of families than the one at their own index.
//!
//! In: a factor. Out: its first fault. Invariant: without faults, and without a cycle of factors, no element depends on itself.

use super::{Fault, Place, fault, fault_with_help};
use crate::ids::FactorId;
use crate::model::recursion::Reading;
use crate::model::{Expression, IndexSpace, Model, VariableUse};

/// The help for a family that depends on itself.
pub(super) const EARLIER: &str = "an element of a family may depend on earlier ones, such as `Y[t - 1]`";

pub(super) fn recursion_fault(model: &Model, id: FactorId) -> Option<Fault> {
    let factor = &model.factors[id];
    let depth = factor.left.first().and_then(|left| model.shifted(left.element?)?.depth)?;
    let (_, over) = factor.products.get(depth)?;
    let in_turn = model.in_turn(id);
    let depends = |use_: &VariableUse| in_turn.contains(&use_.variable);
    let name = |use_: &VariableUse| model.use_name(use_, &factor.products);
    let head = || model.head(factor);
    let cycle = |use_: &VariableUse| {
        let message = format!("`{}` depends on `{}` in turn", name(use_), name(&factor.left[0]));
        fault_with_help(Place::Factor(id), message, EARLIER)
    };
    let later =
        |use_: &&VariableUse| !matches!(model.reading(factor, use_), Reading::Back(0..) | Reading::At(_));
    if let Some(use_) = factor.right.iter().filter(|use_| depends(use_)).find(later) {
        return Some(cycle(use_));
    }
    let mut unread = None;
    factor.form.each_expression(&mut |root| {
        for node in model.nodes_below(root) {
            let Expression::Variable(use_) = &model.expressions[node] else { continue };
            let same = |own: &VariableUse| {
                own.variable == use_.variable && model.reading(factor, own) == model.reading(factor, use_)
            };
            if depends(use_) && unread.is_none() && !factor.right.iter().any(same) {
                let message = format!("`{}` is not on the right of `{}`", name(use_), head());
                let help = format!(
                    "a form may only use the variables that its factor depends on: add `{}` there",
                    name(use_)
                );
                unread = Some(fault_with_help(Place::Expression(id, node), message, help));
            }
        }
    });
    if unread.is_some() {
        return unread;
    }
    // The indices at which something before the first element may be read, or an element that comes later.
    let first = |use_: &VariableUse| model.variables[use_.variable].family.map(|family| family.over.first());
    let last = factor.right.iter().filter_map(|use_| match model.reading(factor, use_) {
        Reading::Back(lag) if lag != 0 => Some(first(use_)? + lag - 1),
        Reading::At(at) if depends(use_) => Some(at),
        _ => None,
    });
    for index in over.first()..=last.max()? {
        for (node, use_) in model.uses_at(factor, depth, index) {
            let place = node.map_or(Place::Form(id), |node| Place::Expression(id, node));
            let (at, fixed) = match model.reading(factor, &use_) {
                Reading::Back(lag) => (index - lag, false),
                Reading::At(at) => (at, true),
                Reading::Any => continue,
            };
            let named = &factor.products[depth].0;
            let read = || format!("`{}[{at}]`", model.spelled(use_.variable));
            if let Some(family) = model.variables[use_.variable].family
                && at < family.over.first()
            {
                let own = &factor.left[0];
                let (begins, follows) = (over.first(), index + 1);
                let message =
                    format!("where {named} = {index}, `{}` reads {}, which does not exist", head(), read());
                let help = match model.variables[own.variable].family.map(|family| family.over) {
                    Some(IndexSpace::Range(_)) => format!(
                        "give the first elements factors of their own: `P({}[{begins}])`, and begin the product later: \
                         `prod({named} in {follows}..=…)`",
                        model.spelled(own.variable)
                    ),
                    _ => format!("choose by `if {named} > {index} {{ … }} else {{ … }}`"),
                };
                return Some(fault_with_help(place, message, help));
            }
            if fixed && depends(&use_) && at >= index {
                let message =
                    format!("where {named} = {index}, `{}` reads {}, which depends on it", head(), read());
                return Some(fault(place, message));
            }
        }
    }
    None
}
