//! Schedules: the order of a kernel's loops, and the depth at which each value is computed.
//!
//! In: a [`Kernel`]. Out: groups of nests that share one pass over the plate. Invariant: the back ends that run blocks
//! of lanes (at run time, or printed as Rust) use these groups and this order of arithmetic.
//!
//! A value is *varying* if it differs along the last parallel axis, else *uniform*: computed once for a block.
//! A scratch buffer that no other group reads is *local*: it lives for one block only.

use super::{Fold, Kernel, Node, Reduce, Role};
use crate::ids::{AxisId, Id, ValueId};
use std::collections::BTreeSet;

/// The order of a kernel's loops.
#[derive(Clone, PartialEq, Debug)]
pub struct Schedule {
    /// The groups, in order.
    pub groups: Vec<Group>,
    /// For each value: the axes on which it depends.
    axes: Vec<BTreeSet<AxisId>>,
    /// The axis of the lanes.
    lane: Option<AxisId>,
    /// For each buffer: whether it lives for one block only.
    pub local: Vec<bool>,
}

/// Nests that share one pass.
#[derive(Clone, PartialEq, Debug)]
pub struct Group {
    /// Whether the pass runs over the kernel's parallel axes; else it is done once.
    pub parallel: bool,
    /// The nests, in order.
    pub nests: Vec<Loops>,
}

/// One nest's loops inside a pass.
#[derive(Clone, PartialEq, Debug)]
pub struct Loops {
    /// The nest of the kernel.
    pub nest: usize,
    /// Axes of the result, outermost first, without the parallel ones and the scanned one.
    pub outer: Vec<AxisId>,
    /// Folded axes, or the scanned one.
    pub inner: Vec<AxisId>,
    /// The values computed at each depth: first outside all loops, then inside the first, …
    pub levels: Vec<Vec<ValueId>>,
}

impl Schedule {
    /// Schedules a kernel.
    pub fn of(kernel: &Kernel) -> Self {
        let mut groups: Vec<Group> = Vec::new();
        let mut pass: Vec<usize> = Vec::new();
        for (position, nest) in kernel.nests.iter().enumerate() {
            if is_parallel(kernel, position) {
                pass.push(position);
                continue;
            }
            let made: Vec<_> = pass.iter().map(|nest| kernel.nests[*nest].out).collect();
            let reads = roots(&nest.reduce, nest.value).into_iter().any(|root| {
                reachable(kernel, root).into_iter().any(|value| match &kernel.nodes[value] {
                    Node::Load { buffer, .. } => made.contains(buffer),
                    _ => false,
                })
            });
            if reads {
                groups.push(group(kernel, &std::mem::take(&mut pass), true));
            }
            groups.push(group(kernel, &[position], false));
        }
        if !pass.is_empty() {
            groups.push(group(kernel, &pass, true));
        }
        let local = kernel.buffers.ids().map(|buffer| {
            let made_in =
                |group: &Group| group.nests.iter().any(|nest| kernel.nests[nest.nest].out == buffer);
            let read_in = |group: &Group| {
                let values = group.nests.iter().flat_map(|nest| nest.levels.iter().flatten());
                values.into_iter().any(
                    |value| matches!(&kernel.nodes[*value], Node::Load { buffer: of, .. } if *of == buffer),
                )
            };
            kernel.buffers[buffer].role == Role::Scratch
                && groups
                    .iter()
                    .all(|group| (group.parallel && made_in(group)) || !(made_in(group) || read_in(group)))
        });
        let lane = kernel.parallel.last().copied();
        Self { axes: axes(kernel), lane, local: local.collect(), groups }
    }

    /// Whether a value differs along the lanes.
    pub fn is_varying(&self, value: ValueId) -> bool {
        self.lane.is_some_and(|lane| self.axes_of(value).contains(&lane))
    }

    /// The axes on which a value depends.
    pub fn axes_of(&self, value: ValueId) -> &BTreeSet<AxisId> {
        &self.axes[value.position()]
    }
}

/// The values that a nest needs directly.
pub(crate) fn roots(reduce: &Reduce, value: ValueId) -> Vec<ValueId> {
    match reduce {
        Reduce::Scan { keep, initial, .. } => vec![value, *keep, *initial],
        _ => vec![value],
    }
}

fn is_parallel(kernel: &Kernel, position: usize) -> bool {
    let axes = &kernel.buffers[kernel.nests[position].out].axes;
    !kernel.parallel.is_empty() && kernel.parallel.iter().all(|axis| axes.contains(axis))
}

/// The operands of a value and the value itself, recursively.
pub(crate) fn reachable(kernel: &Kernel, root: ValueId) -> BTreeSet<ValueId> {
    let (mut seen, mut rest) = (BTreeSet::new(), vec![root]);
    while let Some(value) = rest.pop() {
        if seen.insert(value) {
            rest.extend(kernel.operands(value));
        }
    }
    seen
}

fn axes(kernel: &Kernel) -> Vec<BTreeSet<AxisId>> {
    let mut axes: Vec<BTreeSet<AxisId>> = Vec::with_capacity(kernel.nodes.len());
    // Operands precede the nodes that use them, so one pass is enough.
    for (id, node) in kernel.nodes.iter() {
        let mut own: BTreeSet<AxisId> = node.axes().into_iter().collect();
        kernel.operands(id).into_iter().for_each(|operand| own.extend(&axes[operand.position()]));
        axes.push(own);
    }
    axes
}

fn group(kernel: &Kernel, nests: &[usize], parallel: bool) -> Group {
    Group { parallel, nests: nests.iter().map(|nest| loops(kernel, *nest, parallel)).collect() }
}

fn loops(kernel: &Kernel, position: usize, parallel: bool) -> Loops {
    let nest = &kernel.nests[position];
    let mut inner = match &nest.reduce {
        Reduce::None => Vec::new(),
        Reduce::Fold(_, axes) => axes.clone(),
        Reduce::Scan { axis, .. } => vec![*axis],
    };
    let mut outer: Vec<AxisId> = kernel.buffers[nest.out].axes.clone();
    outer.retain(|axis| !(inner.contains(axis) || parallel && kernel.parallel.contains(axis)));
    // Axes of unknown extent are outermost, so that values that do not depend on the short, known ones are hoisted.
    let known = |axis: &AxisId| kernel.axes[*axis].extent.known().is_some();
    outer.sort_by_key(known);
    inner.sort_by_key(known);
    let order: Vec<AxisId> = outer.iter().chain(&inner).copied().collect();
    let mut levels: Vec<Vec<ValueId>> = vec![Vec::new(); order.len() + 1];
    let mut depth_of: Vec<usize> = vec![0; kernel.nodes.len()];
    let needed: BTreeSet<ValueId> =
        roots(&nest.reduce, nest.value).into_iter().flat_map(|root| reachable(kernel, root)).collect();
    for value in needed {
        let depth =
            |axis: &AxisId| order.iter().position(|other| other == axis).map_or(0, |position| position + 1);
        let own = kernel.nodes[value].axes().iter().map(depth).max().unwrap_or(0);
        let operands = kernel.operands(value).into_iter().map(|operand| depth_of[operand.position()]);
        depth_of[value.position()] = operands.fold(own, usize::max);
        levels[depth_of[value.position()]].push(value);
    }
    Loops { nest: position, outer, inner, levels }
}

impl Reduce {
    /// The fold, if it is one.
    pub fn fold(&self) -> Option<Fold> {
        match self {
            Reduce::Fold(fold, _) => Some(*fold),
            _ => None,
        }
    }
}
