//! Values that several nests of a block need, computed once before them.
//!
//! In: the items of a block. Out: the statements that compute these values. Invariant: a hoisted value is the same in all
//! cells of a lane, and reads nothing that the block computes.

use super::blocks::Room;
use super::fused::Item;
use super::nest::Nests;
use crate::ids::{Id, ValueId};
use crate::kernel::Node;
use crate::kernel::schedule::{Loops, reachable, roots};
use crate::loops::{Local, Of, Statement};
use std::collections::{BTreeMap, BTreeSet};

impl<'k> Nests<'k> {
    /// The statements before the nests of a block; memory for the values is added to `rooms`.
    pub(super) fn hoist(
        &mut self,
        items: &[Item<'k>],
        rooms: &mut BTreeMap<Local, Room>,
    ) -> Option<Vec<Statement>> {
        let alone: Vec<&Loops> = items
            .iter()
            .filter_map(|item| match item {
                Item::Alone(loops) => Some(*loops),
                Item::Run(_) => None,
            })
            .collect();
        let hoisted = self.needed_by_several(&alone);
        let values: BTreeSet<ValueId> =
            hoisted.iter().flat_map(|value| reachable(self.kernel, *value)).collect();
        let values: Vec<ValueId> = values.into_iter().collect();
        values.iter().for_each(|value| self.depth[value.position()] = 0);
        let kept = self.used_by_others(&alone, &hoisted);
        let mut made = self.fetches(&values);
        made.push(self.lanes(&values, 0, &kept, Vec::new())?);
        rooms.extend(kept.into_iter().map(|value| (Of::Kept(value).into(), Room::Block)));
        self.hoisted = hoisted;
        Some(made)
    }

    /// A nest's loops without the hoisted values, and without what only these need.
    pub(super) fn without_hoisted(&self, loops: &Loops) -> Loops {
        let nest = &self.kernel.nests[loops.nest];
        let mut needed: BTreeSet<ValueId> = BTreeSet::new();
        let mut rest = roots(&nest.reduce, nest.value);
        while let Some(value) = rest.pop() {
            if !self.hoisted.contains(&value) && needed.insert(value) {
                rest.extend(self.kernel.operands(value));
            }
        }
        let mut loops = loops.clone();
        loops.levels.iter_mut().for_each(|level| level.retain(|value| needed.contains(value)));
        loops
    }

    /// The values that more than one of these nests computes outside its loops.
    fn needed_by_several(&self, nests: &[&Loops]) -> BTreeSet<ValueId> {
        let (mut once, mut several) = (BTreeSet::new(), BTreeSet::new());
        for value in nests.iter().flat_map(|loops| &loops.levels[0]) {
            if self.varies(*value) && !self.is_fetched(*value) && !once.insert(*value) {
                several.insert(*value);
            }
        }
        several.retain(|value| !self.reads_own(*value));
        several
    }

    /// Whether a value reads an array that this group computes.
    fn reads_own(&self, value: ValueId) -> bool {
        reachable(self.kernel, value).into_iter().any(|value| match &self.kernel.nodes[value] {
            Node::Load { buffer, .. } => {
                self.group.nests.iter().any(|nest| self.kernel.nests[nest.nest].out == *buffer)
            }
            _ => false,
        })
    }

    /// Those hoisted values that the nests themselves use.
    fn used_by_others(&self, nests: &[&Loops], hoisted: &BTreeSet<ValueId>) -> BTreeSet<ValueId> {
        let mut used: BTreeSet<ValueId> = BTreeSet::new();
        for loops in nests {
            let nest = &self.kernel.nests[loops.nest];
            used.extend(roots(&nest.reduce, nest.value));
            let others = loops.levels.iter().flatten().filter(|value| !hoisted.contains(value));
            used.extend(others.flat_map(|value| self.kernel.operands(*value)));
        }
        used.intersection(hoisted).copied().collect()
    }
}
