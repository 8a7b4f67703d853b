//! Validation of kernels before they reach a back end.
//!
//! In: a complete kernel. Out: nothing; a panic with the word `internal` and the reason where the kernel breaks a rule,
//! since only this crate builds kernels. Invariant: back ends rely on these checks.
//!
//! The rules: ids exist, and operands precede the nodes that use them; a load has an index for each axis of its buffer,
//! within its extent; a nest computes a buffer that no other nest computes, from inputs or finished buffers, and runs
//! along every axis that its value depends on; a buffer with an axis of the plate has all of them, last; each input and
//! each output is one buffer; every size and set has a name.

use super::schedule::{reachable, roots};
use super::{Displacements, Extent, Index, InputKey, Kernel, Nest, Node, Reduce, Role};
use crate::ids::{AxisId, BufferId, Id, ValueId};
use std::collections::BTreeSet;

impl Kernel {
    /// The kernel, if it is valid.
    ///
    /// # Panics
    /// The kernel is invalid.
    pub(crate) fn validated(self) -> Self {
        if let Err(reason) = self.validate() {
            panic!("internal: the kernel `{}` is not valid: {reason}", self.name);
        }
        self
    }

    fn validate(&self) -> Result<(), String> {
        self.arrays()?;
        for (id, node) in self.nodes.iter() {
            self.node(id, node)?;
        }
        let axes = self.axes_of();
        let mut finished: BTreeSet<BufferId> =
            self.buffers.iter().filter(|(_, buffer)| is_given(&buffer.role)).map(|(id, _)| id).collect();
        for (place, nest) in self.nests.iter().enumerate() {
            self.nest(nest, &axes, &finished).map_err(|reason| format!("nest {place}: {reason}"))?;
            finished.insert(nest.out);
        }
        let unmade = self.outputs().map(|(id, _)| id).chain(self.checks.iter().map(|(id, _)| *id));
        match unmade.into_iter().find(|id| !finished.contains(id)) {
            Some(id) => Err(format!("no nest makes `{}`", self.buffers[id].name)),
            None => Ok(()),
        }
    }

    /// The axes on which each value depends.
    pub(super) fn axes_of(&self) -> Vec<BTreeSet<AxisId>> {
        let mut axes: Vec<BTreeSet<AxisId>> = Vec::with_capacity(self.nodes.len());
        for (id, node) in self.nodes.iter() {
            let mut own: BTreeSet<AxisId> = node.axes().into_iter().collect();
            for operand in self.operands(id) {
                own.extend(&axes[operand.position()]);
            }
            axes.push(own);
        }
        axes
    }

    /// Buffers, sizes and sets.
    fn arrays(&self) -> Result<(), String> {
        for key in self.size_keys() {
            expect(self.sizes.iter().any(|size| size.key == key), || format!("{key:?} has no name"))?;
        }
        for (id, buffer) in self.buffers.iter() {
            let name = &buffer.name;
            let known = buffer.axes.iter().all(|axis| axis.position() < self.axes.len());
            expect(known, || format!("`{name}` has an axis that does not exist"))?;
            let others =
                self.buffers.iter().take_while(|(other, _)| *other != id).map(|(_, other)| &other.role);
            let is_same = |other: &Role| match (&buffer.role, buffer.role.input()) {
                (_, Some(key)) => other.input() == Some(key),
                (Role::Positions(..) | Role::Output(_), _) => *other == buffer.role,
                _ => false,
            };
            expect(!others.into_iter().any(is_same), || format!("`{name}` is there twice"))?;
            match &buffer.role {
                Role::Table { numbers, .. } => {
                    let cells = self.known_cells(&buffer.axes);
                    expect(cells.is_none_or(|cells| cells == numbers.len()), || {
                        format!("`{name}` has {} numbers for {cells:?} cells", numbers.len())
                    })?;
                }
                Role::Positions(Displacements::Of(set) | Displacements::Steps(set), _)
                | Role::Input { key: InputKey::Wraps(set), .. } => {
                    let named = self.sets.iter().any(|(known, _)| known == set);
                    expect(named, || format!("the set of `{name}` has no name"))?;
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn node(&self, id: ValueId, node: &Node) -> Result<(), String> {
        let fault = |what: &str| format!("value {}: {what}", id.position());
        expect(self.operands(id).into_iter().all(|operand| operand < id), || {
            fault("an operand comes after it")
        })?;
        let known = node.axes().into_iter().all(|axis| axis.position() < self.axes.len());
        expect(known, || fault("an axis does not exist"))?;
        let Node::Load { buffer, indices, otherwise } = node else { return Ok(()) };
        expect(buffer.position() < self.buffers.len(), || fault("a buffer does not exist"))?;
        let axes = &self.buffers[*buffer].axes;
        expect(axes.len() == indices.len(), || fault("a buffer is read with a wrong number of indices"))?;
        let outside = indices.iter().zip(axes).any(|(index, axis)| match index {
            Index::Axis(running) => exceeds(self.axes[*running].extent, self.axes[*axis].extent),
            _ => false,
        });
        expect(otherwise.is_some() || !outside, || fault("a buffer is read beyond its end"))
    }

    fn nest(
        &self,
        nest: &Nest,
        axes: &[BTreeSet<AxisId>],
        finished: &BTreeSet<BufferId>,
    ) -> Result<(), String> {
        expect(nest.out.position() < self.buffers.len(), || "its buffer does not exist".to_owned())?;
        let out = &self.buffers[nest.out];
        let fault = |what: &str| format!("`{}`: {what}", out.name);
        let is_made = matches!(out.role, Role::Scratch | Role::Output(_));
        expect(is_made && !finished.contains(&nest.out), || fault("it is given, or made twice"))?;
        let mut runs: BTreeSet<AxisId> = out.axes.iter().copied().collect();
        expect(runs.len() == out.axes.len(), || fault("it has an axis twice"))?;
        match &nest.reduce {
            Reduce::None => {}
            Reduce::Fold(_, over) => {
                let apart = over.iter().all(|axis| axis.position() < self.axes.len() && runs.insert(*axis));
                expect(apart, || fault("it is folded over an axis of its own, or twice"))?;
            }
            Reduce::Scan { axis, initial, .. } => {
                let inside = runs.contains(axis) && !axes[initial.position()].contains(axis);
                expect(inside, || {
                    fault("it is scanned along an axis that it has not, or on which it begins")
                })?;
            }
        }
        let plate = out.axes.iter().filter(|axis| self.parallel.contains(axis)).count();
        let whole = plate == 0 || out.axes.ends_with(&self.parallel);
        expect(whole, || fault("it has some axes of the plate, but not all of them last"))?;
        for root in roots(&nest.reduce, nest.value) {
            expect(axes[root.position()].is_subset(&runs), || {
                fault("a value depends on an axis that does not run")
            })?;
            for value in reachable(self, root) {
                if let Node::Load { buffer, .. } = &self.nodes[value] {
                    let read = &self.buffers[*buffer].name;
                    expect(finished.contains(buffer), || {
                        fault(&format!("`{read}` is read before it is made"))
                    })?;
                }
            }
        }
        Ok(())
    }
}

/// Whether a buffer exists before any nest runs.
fn is_given(role: &Role) -> bool {
    matches!(role, Role::Input { .. } | Role::Table { .. } | Role::Positions(..))
}

/// Whether a loop always exceeds an extent.
fn exceeds(running: Extent, extent: Extent) -> bool {
    running.size == extent.size && running.offset > extent.offset
}

fn expect(holds: bool, reason: impl FnOnce() -> String) -> Result<(), String> {
    if holds { Ok(()) } else { Err(reason()) }
}

#[cfg(test)]
mod tests {
    use super::super::{Extent, Fold, KernelBuilder, OutputKey, Role};
    use super::*;

    /// `half[x] = x`, `out[x] = Σ_y half[x]`, changed by a caller.
    fn broken(change: impl FnOnce(&mut Kernel)) -> Option<String> {
        let mut builder = KernelBuilder::new("sum");
        let [x, y] = ["x", "y"].map(|name| builder.axis(name, Extent::constant(3)));
        let half = builder.buffer("half", Role::Scratch, &[x]);
        let out = builder.buffer("out", Role::Output(OutputKey::Ask(0)), &[x]);
        let running = builder.running(x);
        builder.nest(half, Reduce::None, running);
        let read = builder.load(half, vec![Index::Axis(x)]);
        builder.nest(out, Reduce::Fold(Fold::Sum, vec![y]), read);
        let mut kernel = builder.build();
        change(&mut kernel);
        kernel.validate().err()
    }

    #[test]
    fn each_rule_is_held() {
        assert_eq!(broken(|_| {}), None);
        type Spoil = fn(&mut Kernel);
        let rules: [(Spoil, &str); 5] = [
            (|kernel| kernel.nests.swap(0, 1), "`half` is read before it is made"),
            (|kernel| kernel.nests.truncate(1), "no nest makes `out`"),
            (|kernel| kernel.nests[1].out = kernel.nests[0].out, "made twice"),
            (|kernel| kernel.buffers[kernel.nests[0].out].axes.clear(), "a wrong number of indices"),
            (
                |kernel| {
                    let own = kernel.buffers[kernel.nests[1].out].axes.clone();
                    kernel.nests[1].reduce = Reduce::Fold(Fold::Sum, own);
                },
                "an axis of its own",
            ),
        ];
        for (change, words) in rules {
            let reason = broken(change).unwrap_or_else(|| panic!("{words}: it passes"));
            assert!(reason.contains(words), "{reason}");
        }
    }

    #[test]
    fn a_value_runs_along_its_axes_and_inside_its_buffers() {
        let [other, longer] = [true, false].map(|other| {
            let mut builder = KernelBuilder::new("axes");
            let [x, y] =
                [("x", 3), ("y", 4)].map(|(name, count)| builder.axis(name, Extent::constant(count)));
            let first = builder.buffer("first", Role::Scratch, &[x]);
            let out = builder.buffer("out", Role::Output(OutputKey::Ask(0)), &[if other { x } else { y }]);
            let running = builder.running(x);
            builder.nest(first, Reduce::None, running);
            let value = if other { builder.running(y) } else { builder.load(first, vec![Index::Axis(y)]) };
            builder.nest(out, Reduce::None, value);
            builder.build().validate().unwrap_err()
        });
        assert!(other.contains("an axis that does not run"), "{other}");
        assert!(longer.contains("beyond its end"), "{longer}");
    }
}
