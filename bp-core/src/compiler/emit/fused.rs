//! Fusion of nests into one loop, so that a nest reads the results of the previous one from registers.
//!
//! In: the nests of a parallel group. Out: [`Item`]s in an order in which everything is computed before it is read.
//! Invariant: short axes are unrolled; nests of an item have the same other loop, or none, and read the results of
//! their item only at the current indices.

use super::nest::Nests;
use crate::ids::{AxisId, BufferId, ValueId};
use crate::kernel::schedule::{Loops, roots};
use crate::kernel::{Index, Kernel, Node, Reduce};
use crate::operators::Unary;
use std::collections::{BTreeSet, HashMap};

/// The longest axis that is unrolled, in a nest of arithmetic and in one that calls functions: several of their polynomials at
/// once do not fit in registers.
const WRITTEN_OUT: [usize; 2] = [8, 4];

/// Limit of the copies of a nest.
const MOST_COPIES: usize = 16;

/// A unit of execution.
pub(super) enum Item<'k> {
    /// One nest, loop by loop.
    Alone(&'k Loops),
    /// Nests that are executed tile by tile.
    Run(Run<'k>),
}

/// Items that process the same tiles: each reads the results of the previous ones from registers.
#[derive(Default)]
pub(super) struct Run<'k> {
    pub(super) items: Vec<Fused<'k>>,
}

/// Nests that share a loop, or have none.
pub(super) struct Fused<'k> {
    pub(super) axis: Option<AxisId>,
    pub(super) nests: Vec<&'k Loops>,
}

impl Fused<'_> {
    pub(super) fn has(&self, nest: &Loops) -> bool {
        self.nests.iter().any(|own| own.nest == nest.nest)
    }
}

impl<'k> Nests<'k> {
    /// The known, short axes of a nest.
    pub(super) fn written_out(&self, loops: &Loops) -> Vec<AxisId> {
        let calls = |value: &ValueId| match &self.kernel.nodes[*value] {
            Node::Unary(operator, _) => !matches!(operator, Unary::Negate | Unary::Not | Unary::Absolute),
            Node::Mass(..) => true,
            _ => false,
        };
        // Values that are the same in all lanes are computed outside them.
        let mut values = loops.levels.iter().flatten();
        let has_calls = values.any(|value| calls(value) && self.schedule.is_varying(*value));
        let most = WRITTEN_OUT[usize::from(has_calls)];
        let short =
            |axis: &&AxisId| self.kernel.axes[**axis].extent.known().is_some_and(|count| count <= most);
        loops.outer.iter().chain(&loops.inner).filter(short).copied().collect()
    }

    /// The group's nests in the order of execution.
    pub(super) fn items(&self) -> Vec<Item<'k>> {
        let mut rest: Vec<&'k Loops> = self.group.nests.iter().collect();
        let mut items: Vec<Item<'k>> = Vec::new();
        let mut done: BTreeSet<BufferId> = BTreeSet::new();
        while !rest.is_empty() {
            let first = rest.remove(0);
            let Some(axis) = self.shared_loop(first) else {
                done.insert(self.kernel.nests[first.nest].out);
                items.push(Item::Alone(first));
                continue;
            };
            let mut fused = Fused { axis, nests: vec![first] };
            let mut position = 0;
            while position < rest.len() {
                let fits = self.shared_loop(rest[position]) == Some(axis)
                    && self.may_join(&fused, rest[position], &done);
                match fits {
                    true => fused.nests.push(rest.remove(position)),
                    false => position += 1,
                }
            }
            done.extend(fused.nests.iter().map(|nest| self.kernel.nests[nest.nest].out));
            match items.last_mut() {
                Some(Item::Run(run)) if self.may_follow(run, &fused) => run.items.push(fused),
                _ => items.push(Item::Run(Run { items: vec![fused] })),
            }
        }
        items
    }

    /// Whether an item reads the results of a run only at the current indices: then they are in the same tile.
    fn may_follow(&self, run: &Run<'k>, fused: &Fused<'k>) -> bool {
        let values = fused.nests.iter().flat_map(|nest| nest.levels.iter().flatten());
        values.into_iter().all(|value| match &self.kernel.nodes[*value] {
            Node::Load { buffer, indices, otherwise } if self.is_made_in(run, *buffer) => {
                otherwise.is_none() && indices.iter().all(|index| matches!(index, Index::Axis(_)))
            }
            _ => true,
        })
    }

    /// Whether a nest of a run computes a buffer.
    pub(super) fn is_made_in(&self, run: &Run<'k>, buffer: BufferId) -> bool {
        let mut nests = run.items.iter().flat_map(|item| &item.nests);
        nests.any(|nest| self.kernel.nests[nest.nest].out == buffer)
    }

    /// Whether a nest reads a buffer.
    pub(super) fn reads(&self, nest: &Loops, buffer: BufferId) -> bool {
        let mut values = nest.levels.iter().flatten();
        values
            .any(|value| matches!(&self.kernel.nodes[*value], Node::Load { buffer: of, .. } if *of == buffer))
    }

    /// The only loop of a nest that is not unrolled, if its shape allows sharing.
    fn shared_loop(&self, loops: &Loops) -> Option<Option<AxisId>> {
        let nest = &self.kernel.nests[loops.nest];
        if matches!(nest.reduce, Reduce::Scan { .. }) {
            return None;
        }
        let short = self.written_out(loops);
        let copies: usize = short.iter().filter_map(|axis| self.kernel.axes[*axis].extent.known()).product();
        let long: Vec<AxisId> =
            loops.outer.iter().chain(&loops.inner).filter(|axis| !short.contains(axis)).copied().collect();
        let plain = loops.levels.iter().flatten().all(|value| match &self.kernel.nodes[*value] {
            Node::Load { .. } if self.varies(*value) => self.is_fetched(*value) && !self.is_merged(*value),
            _ => true,
        });
        // A value that varies along the lanes but not along the loop is stored, if it costs more than a few operations:
        // such a nest is executed loop by loop.
        let kept = loops.levels.iter().take(loops.levels.len() - 1).flatten().any(|value| {
            self.varies(*value)
                && !matches!(self.kernel.nodes[*value], Node::Load { .. })
                && !long.iter().all(|axis| self.schedule.axes_of(*value).contains(axis))
        });
        match long.as_slice() {
            _ if !plain || copies > MOST_COPIES || (kept && !long.is_empty()) => None,
            [] => Some(None),
            [one] => Some(Some(*one)),
            _ => None,
        }
    }

    /// Whether a nest reads only finished arrays, or results of these nests at the current indices.
    fn may_join(&self, fused: &Fused<'k>, loops: &Loops, done: &BTreeSet<BufferId>) -> bool {
        let own: BTreeSet<BufferId> =
            self.group.nests.iter().map(|nest| self.kernel.nests[nest.nest].out).collect();
        loops.levels.iter().flatten().all(|value| {
            let Node::Load { buffer, indices, otherwise } = &self.kernel.nodes[*value] else { return true };
            if !own.contains(buffer) || done.contains(buffer) {
                return true;
            }
            let Some(maker) = fused.nests.iter().find(|nest| self.kernel.nests[nest.nest].out == *buffer)
            else {
                return false;
            };
            let running = indices.iter().zip(&self.kernel.buffers[*buffer].axes);
            otherwise.is_none()
                && running.into_iter().all(|(index, axis)| *index == Index::Axis(*axis))
                && fused.axis.is_none_or(|axis| maker.outer.contains(&axis))
        })
    }
}

/// Every combination of values of some axes of known extent.
pub(super) fn choices(kernel: &Kernel, axes: &[AxisId]) -> Vec<HashMap<AxisId, usize>> {
    let mut choices = vec![HashMap::new()];
    for axis in axes {
        let count = kernel.axes[*axis].extent.known().expect("internal: only known extents are written out");
        choices = (choices.iter())
            .flat_map(|choice: &HashMap<AxisId, usize>| {
                (0..count).map(|value| {
                    let mut choice = choice.clone();
                    choice.insert(*axis, value);
                    choice
                })
            })
            .collect();
    }
    choices
}

/// The values that a nest computes, its roots last.
pub(super) fn values(kernel: &Kernel, loops: &Loops) -> Vec<ValueId> {
    let nest = &kernel.nests[loops.nest];
    let mut values: Vec<ValueId> = loops.levels.iter().flatten().copied().collect();
    values.extend(roots(&nest.reduce, nest.value));
    values.sort();
    values.dedup();
    values
}
