//! Simplification of kernels for emitted code, in which every array is given.
//!
//! In: a kernel. Out: the same without the checks whether the host gave an array. Invariant: a missing optional input
//! is a negative number, which is not a probability; emitted code always has the array.

use crate::kernel::{Kernel, Node, Role, rewritten};
use crate::operators::Binary;

/// The kernel of a host that gives every array.
pub(super) fn given(kernel: &Kernel) -> Kernel {
    rewritten(kernel, |builder, node| {
        let Node::Select(condition, _, kept) = node else { return None };
        let nodes = &builder.so_far().nodes;
        let Node::Binary(Binary::Less, asked, zero) = nodes[*condition] else { return None };
        let Node::Load { buffer, .. } = &nodes[*kept] else { return None };
        let may_be_left_out = matches!(kernel.buffers[*buffer].role, Role::Input { default: Some(default), .. } if default < 0.0);
        (asked == *kept && builder.as_constant(zero) == Some(0.0) && may_be_left_out).then_some(*kept)
    })
}
