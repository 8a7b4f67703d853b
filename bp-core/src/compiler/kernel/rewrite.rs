//! Rewriting of kernels: nodes are rebuilt one by one, with replacements by a rule.
//!
//! In: a kernel and a rule. Out: an equivalent kernel, if the rule is correct. Invariant: buffers and axes keep their
//! ids; nests keep their order.

use super::schedule::roots;
use super::{Index, Kernel, KernelBuilder, Nest, Node, Reduce, Role};
use crate::ids::{AxisId, Id, ValueId};
use std::collections::HashMap;

/// Replaces nodes by a rule, which is given the node with its operands already replaced.
pub(crate) fn rewritten(
    kernel: &Kernel,
    mut rule: impl FnMut(&mut KernelBuilder, &Node) -> Option<ValueId>,
) -> Kernel {
    let mut builder = KernelBuilder::without_nodes(kernel);
    let mut replaced: Vec<ValueId> = Vec::with_capacity(kernel.nodes.len());
    for node in kernel.nodes.values() {
        let node = with_operands(node, |operand| replaced[operand.position()]);
        let value = rule(&mut builder, &node).unwrap_or_else(|| builder.made_again(node));
        replaced.push(value);
    }
    for nest in &kernel.nests {
        let Nest { out, reduce, value } = nest_with(nest, |value| replaced[value.position()]);
        builder.nest(out, reduce, value);
    }
    builder.build()
}

/// A node with other operands.
pub(super) fn with_operands(node: &Node, of: impl Fn(ValueId) -> ValueId) -> Node {
    let at = |index: &Index| match index {
        Index::Axis(axis) => Index::Axis(*axis),
        Index::At(value) => Index::At(of(*value)),
        Index::Turned { axis, by, wraps } => Index::Turned { axis: *axis, by: of(*by), wraps: of(*wraps) },
    };
    match node {
        Node::Constant(_) | Node::Axis(_) => node.clone(),
        Node::Unary(operator, operand) => Node::Unary(*operator, of(*operand)),
        Node::Binary(operator, left, right) => Node::Binary(*operator, of(*left), of(*right)),
        Node::Select(condition, then, otherwise) => Node::Select(of(*condition), of(*then), of(*otherwise)),
        Node::Mass(law, operands) => Node::Mass(*law, operands.map(of)),
        Node::Load { buffer, indices, otherwise } => Node::Load {
            buffer: *buffer,
            indices: indices.iter().map(at).collect(),
            otherwise: otherwise.map(of),
        },
    }
}

/// A nest with other values.
fn nest_with(nest: &Nest, of: impl Fn(ValueId) -> ValueId) -> Nest {
    let reduce = match &nest.reduce {
        Reduce::Scan { axis, backward, keep, initial } => {
            Reduce::Scan { axis: *axis, backward: *backward, keep: of(*keep), initial: of(*initial) }
        }
        other => other.clone(),
    };
    Nest { out: nest.out, reduce, value: of(nest.value) }
}

/// A value of the kernel under construction at another index of an axis.
pub(super) fn at_another(
    builder: &mut KernelBuilder,
    value: ValueId,
    (axis, at): (AxisId, ValueId),
    known: &mut HashMap<ValueId, ValueId>,
) -> ValueId {
    if let Some(made) = known.get(&value) {
        return *made;
    }
    for operand in builder.so_far().operands(value) {
        at_another(builder, operand, (axis, at), known);
    }
    let made = match with_operands(&builder.so_far().nodes[value], |operand| known[&operand]) {
        Node::Axis(running) if running == axis => at,
        node => builder.made_again(node),
    };
    known.insert(value, made);
    made
}

/// Removes nests that only copy the result of an earlier nest that no other nest reads.
pub(crate) fn without_copies(mut kernel: Kernel) -> Kernel {
    while let Some((maker, copy)) = copy_of(&kernel) {
        let (made, out) = (kernel.nests[maker].out, kernel.nests[copy].out);
        kernel.checks.iter_mut().filter(|(checked, _)| *checked == made).for_each(|check| check.0 = out);
        kernel.nests[maker].out = out;
        kernel.nests.remove(copy);
    }
    kernel
}

/// A nest that computes a scratch array, and the only nest that reads it, which is a copy.
fn copy_of(kernel: &Kernel) -> Option<(usize, usize)> {
    kernel.nests.iter().enumerate().find_map(|(copy, nest)| {
        let Node::Load { buffer, indices, otherwise: None } = &kernel.nodes[nest.value] else { return None };
        let axes = &kernel.buffers[*buffer].axes;
        let is_whole = nest.reduce == Reduce::None
            && *axes == kernel.buffers[nest.out].axes
            && indices.iter().zip(axes).all(|(index, axis)| *index == Index::Axis(*axis))
            && kernel.buffers[*buffer].role == Role::Scratch;
        let reads = |node: &Node| matches!(node, Node::Load { buffer: read, .. } if read == buffer);
        let readers = kernel.nodes.values().filter(|node| reads(node)).count();
        let used = kernel.nodes.ids().any(|value| kernel.operands(value).contains(&nest.value));
        let users =
            kernel.nests.iter().filter(|other| roots(&other.reduce, other.value).contains(&nest.value));
        let is_alone = readers == 1 && !used && users.count() == 1;
        let maker = kernel.nests[..copy].iter().position(|maker| maker.out == *buffer);
        maker.filter(|_| is_whole && is_alone).map(|maker| (maker, copy))
    })
}
