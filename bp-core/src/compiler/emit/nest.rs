//! The loops of one group of nests: blocks of lanes, all nests fused in one pass.
//!
//! In: a schedule's group. Out: its loops, in the loop language. Invariant: values that are uniform over a block are
//! computed once, before the loops over lanes; contiguous lanes are fetched, not loaded one by one.

use super::blocks::{Blocks, Room};
use super::fused::Item;
use super::load::Load;
use super::names::local;
use super::print;
use super::question::room;
use super::text::Text;
use crate::ids::{AxisId, BufferId, Id, ValueId};
use crate::kernel::schedule::{Group, Loops, Schedule};
use crate::kernel::{Buffer, Fold, Index, Kernel, Node, Reduce, Role};
use crate::loops::{Expression, Grain, Kind, Lanes, Local, Of, Operation, Statement, Target, Type, validate};
use crate::operators::Binary;
use std::collections::{BTreeMap, BTreeSet};

pub(super) struct Nests<'k> {
    pub(super) kernel: &'k Kernel,
    pub(super) schedule: &'k Schedule,
    pub(super) group: &'k Group,
    /// Depth at which each value of the nest at hand is computed.
    pub(super) depth: Vec<usize>,
    /// Values that a block computes before its nests, because several of them need these.
    pub(super) hoisted: BTreeSet<ValueId>,
    /// Whether products are plain multiplications ([`crate::equation::Mark::Linear`]).
    pub(super) is_linear: bool,
}

impl<'k> Nests<'k> {
    pub(super) fn new(kernel: &'k Kernel, schedule: &'k Schedule, group: &'k Group, is_linear: bool) -> Self {
        let (depth, hoisted) = (vec![0; kernel.nodes.len()], BTreeSet::new());
        Self { kernel, schedule, group, depth, hoisted, is_linear }
    }

    /// A group that is executed once.
    pub(super) fn serial(&mut self, text: &mut Text) {
        let group = self.group;
        for nest in &group.nests {
            let out = self.kernel.nests[nest.nest].out;
            room(self.kernel, out, text);
            let nested = self.folded_cells(nest).unwrap_or_else(|| self.nest(nest, &[]));
            let body = [Statement::Scope(nested)];
            validate(&body, []);
            print::statements(&body, text);
            let array = local("m", out);
            text.line(format!("let {array}: &[T] = &{array}[..];"));
            self.looked_at_once(out).iter().for_each(|look| text.line(print::look(*look, &array)));
        }
    }

    /// A group that runs over blocks of the plate.
    pub(super) fn blocks(&mut self, shared: &[BufferId]) -> Blocks {
        let group = self.group;
        let mut items = Vec::new();
        let mut rooms: BTreeMap<Local, Room> = BTreeMap::new();
        let found = self.items();
        // Arrays passed between nests block by block must stay in the first cache.
        let is_kept = found.iter().any(|item| matches!(item, Item::Alone(_)));
        let is_short = is_kept && self.kernel.parallel.len() == 1;
        items.extend(self.hoist(&found, &mut rooms).map(Statement::Scope));
        for item in found {
            items.push(Statement::Scope(match &item {
                Item::Alone(nest) => self.nest(nest, shared),
                Item::Run(run) => self.run(run, shared, &mut rooms),
            }));
        }
        let mut named: BTreeSet<Local> = BTreeSet::new();
        items.iter().for_each(|item| {
            item.names(&mut |name| {
                named.insert(name);
            })
        });
        for nest in &group.nests {
            let out = self.kernel.nests[nest.nest].out;
            let array = Local::from(Of::Array(out));
            if named.contains(&array) {
                rooms.insert(array, Room::Blocks(self.cells(out)));
            }
        }
        // Where lanes are copied to: made once, outside the loops.
        for name in named {
            if matches!(name.of, Of::Made | Of::Folded | Of::Copies(_)) {
                rooms.entry(name).or_insert(Room::Block);
            }
        }
        let there =
            rooms.keys().cloned().chain(self.kernel.parallel.iter().map(|axis| Of::Running(*axis).into()));
        validate(&items, there);
        let [before, after] = self.around(shared);
        let axes = self.kernel.parallel.clone();
        Blocks { is_short, rooms, shared: shared.to_vec(), axes, before, items, after }
    }

    /// The number of contiguous cells of a buffer in one lane.
    pub(super) fn cells(&self, buffer: BufferId) -> Expression {
        let cells = self.serial_axes(buffer).into_iter().map(|axis| Of::Extent(axis).into());
        Operation::Product.of(cells.collect::<Vec<Expression>>())
    }

    pub(super) fn serial_axes(&self, buffer: BufferId) -> Vec<AxisId> {
        let parallel = |axis: &AxisId| self.group.parallel && self.kernel.parallel.contains(axis);
        self.kernel.buffers[buffer].axes.iter().copied().filter(|axis| !parallel(axis)).collect()
    }

    pub(super) fn varies(&self, value: ValueId) -> bool {
        self.group.parallel && self.schedule.is_varying(value)
    }

    /// Whether a value is a load whose lanes are contiguous or equal: fetched before the loop over lanes.
    pub(super) fn is_fetched(&self, value: ValueId) -> bool {
        self.fetched(value).is_some()
    }

    /// The load of a value that is fetched.
    pub(super) fn fetched(&self, value: ValueId) -> Option<Load<'k>> {
        let Node::Load { buffer, indices, otherwise } = &self.kernel.nodes[value] else { return None };
        let Buffer { role, axes, .. } = &self.kernel.buffers[*buffer];
        let lane = self.kernel.parallel.last();
        let is_lane = |index: &Index| match index {
            Index::Axis(axis) | Index::Turned { axis, .. } => Some(axis) == lane,
            Index::At(_) => false,
        };
        let is_found = indices.iter().any(|index| matches!(index, Index::At(at) if self.varies(*at)));
        // Contiguous, and of the type of the lanes: tables and positions are not.
        let own = self.group.nests.iter().any(|nest| self.kernel.nests[nest.nest].out == *buffer);
        let stand = match indices.iter().position(is_lane) {
            Some(position) => {
                (own || position + 1 == axes.len())
                    && !matches!(role, Role::Table { .. } | Role::Positions(..))
            }
            None => true,
        };
        let load = Load { value, buffer: *buffer, indices, otherwise: *otherwise };
        (self.varies(value) && !is_found && stand).then_some(load)
    }

    fn nest(&mut self, loops: &Loops, shared: &[BufferId]) -> Vec<Statement> {
        let loops = &self.without_hoisted(loops);
        for (depth, level) in loops.levels.iter().enumerate() {
            level.iter().for_each(|value| self.depth[value.position()] = depth);
        }
        self.depth(loops, 0, shared)
    }

    fn depth(&self, loops: &Loops, depth: usize, shared: &[BufferId]) -> Vec<Statement> {
        let nest = &self.kernel.nests[loops.nest];
        let (outer, last) = (loops.outer.len(), loops.outer.len() + loops.inner.len());
        let lanes = self.group.parallel;
        if let (Reduce::Scan { axis, backward, keep, initial }, true) = (&nest.reduce, depth == outer) {
            let mut made = self.level(loops, depth, Vec::new());
            let initial = self.operand(*initial, usize::MAX);
            made.push(if lanes { Statement::StateOfLanes(initial) } else { Statement::State(initial) });
            let (keep, value) = (self.operand(*keep, depth + 1), self.operand(nest.value, depth + 1));
            let state = if lanes { lane(Of::State) } else { Of::State.into() };
            let next = add(multiply(keep, state.clone()), value);
            let mut body = Vec::new();
            match lanes {
                true => {
                    let made = self.made_in(nest.out, shared);
                    body.extend(self.begun(nest.out, shared));
                    let update = vec![Statement::Set(lane(made), state.clone()), Statement::Set(state, next)];
                    body.extend(self.level(loops, depth + 1, update));
                    body.extend(self.kept_lanes(nest.out, shared, made));
                }
                false => {
                    body.extend(self.level(loops, depth + 1, Vec::new()));
                    body.push(Statement::Store(nest.out, self.plane(nest.out), state.clone()));
                    body.push(Statement::Set(state, next));
                }
            }
            made.push(Statement::Scan { axis: *axis, backward: *backward, body });
            return made;
        }
        let (mut made, mut actions, mut after) = (Vec::new(), Vec::new(), Vec::new());
        if let (Some(fold), true) = (nest.reduce.fold(), depth == outer) {
            made.push(if lanes { Statement::BeginLanes(fold) } else { Statement::Begin(fold) });
        }
        if depth == last {
            let value = self.operand(nest.value, depth);
            match (nest.reduce.fold(), lanes) {
                (None, true) => {
                    let own = self.made_in(nest.out, shared);
                    made.extend(self.begun(nest.out, shared));
                    actions.push(Statement::Set(lane(own), value));
                    after = self.kept_lanes(nest.out, shared, own);
                }
                (None, false) => after.push(Statement::Store(nest.out, self.plane(nest.out), value)),
                (Some(fold), true) => {
                    let more = folded(fold, lane(Of::Folded), value);
                    actions.push(Statement::Set(lane(Of::Folded), more));
                }
                (Some(fold), false) => after.push(Statement::Fold(fold, value)),
            }
        }
        made.extend(self.level(loops, depth, actions));
        made.extend(after);
        if depth < last {
            let axis = if depth < outer { loops.outer[depth] } else { loops.inner[depth - outer] };
            made.push(Statement::For(axis, self.depth(loops, depth + 1, shared)));
        }
        if nest.reduce.fold().is_some() && depth == outer {
            match lanes {
                true => made.extend(self.kept_lanes(nest.out, shared, Of::Folded)),
                false => made.push(Statement::Store(nest.out, self.plane(nest.out), Of::Folded.into())),
            }
        }
        made
    }

    /// Where lanes of a buffer are computed: in place, if the pass owns its memory; else on the stack, where nothing
    /// aliases.
    fn made_in(&self, out: BufferId, shared: &[BufferId]) -> Of {
        if shared.contains(&out) { Of::Made } else { Of::Own }
    }

    /// The statements that check and store computed lanes.
    fn kept_lanes(&self, out: BufferId, shared: &[BufferId], lanes: Of) -> Vec<Statement> {
        let looked = self.looked_at(out).map(|look| Statement::Look(look, lanes.into()));
        let target = if shared.contains(&out) { Target::Planes(out) } else { Target::Own(out) };
        let keep = Statement::Keep { target, plane: self.plane(out), lanes: lanes.into() };
        looked.into_iter().chain((lanes != Of::Own).then_some(keep)).collect()
    }

    /// Lanes of a buffer of this pass are computed in place.
    fn begun(&self, out: BufferId, shared: &[BufferId]) -> Option<Statement> {
        (!shared.contains(&out)).then(|| Statement::Own(out, self.plane(out)))
    }

    /// The plane of a buffer that contains the current cell.
    pub(super) fn plane(&self, out: BufferId) -> Expression {
        let running: Vec<Index> =
            self.kernel.buffers[out].axes.iter().map(|axis| Index::Axis(*axis)).collect();
        self.planes(out, &running)
    }

    /// The plane of a buffer that is read at the current indices.
    pub(super) fn planes(&self, buffer: BufferId, indices: &[Index]) -> Expression {
        let serial = self.serial_axes(buffer);
        let mut plane: Vec<Expression> = Vec::new();
        for (index, axis) in indices.iter().zip(&self.kernel.buffers[buffer].axes) {
            let Some(position) = serial.iter().position(|own| own == axis) else { continue };
            let Index::Axis(running) = index else { unreachable!("internal: read at a running value") };
            let after = serial[position + 1..].iter().map(|axis| Of::Extent(*axis));
            let factors = std::iter::once(Of::Running(*running)).chain(after).map(Expression::from);
            plane.push(Operation::Product.of(factors.collect::<Vec<_>>()));
        }
        Operation::Sum.of(plane)
    }

    /// The values of one depth, and their use lane by lane.
    fn level(&self, loops: &Loops, depth: usize, actions: Vec<Statement>) -> Vec<Statement> {
        let values = &loops.levels[depth];
        let kept = self.computed(values).into_iter().filter(|value| self.used_deeper(loops, *value, depth));
        let kept: BTreeSet<ValueId> = kept.collect();
        let mut made = self.fetches(values);
        made.extend(kept.iter().map(|value| Statement::Block(Of::Kept(*value).into())));
        made.extend(self.lanes(values, depth, &kept, actions));
        made
    }

    /// The values that are computed lane by lane, in their order.
    fn computed(&self, values: &[ValueId]) -> Vec<ValueId> {
        let is_computed =
            |value: &&ValueId| self.varies(**value) && (!self.is_fetched(**value) || self.is_merged(**value));
        let mut computed: Vec<ValueId> = values.iter().filter(is_computed).copied().collect();
        computed.sort();
        computed
    }

    /// The values that are the same in all lanes, and the lanes that are fetched.
    pub(super) fn fetches(&self, values: &[ValueId]) -> Vec<Statement> {
        let mut made = Vec::new();
        for value in values.iter().filter(|value| !self.varies(**value)) {
            made.extend(self.settled(*value));
            if self.group.parallel {
                made.push(self.splat(*value));
            }
        }
        for load in values.iter().filter_map(|value| self.fetched(*value)) {
            made.extend(self.fetch(load, &Operation::Count(0).alone(), Grain::Block));
            let lanes = self.lanes_at(load.value, load.buffer);
            made.push(Statement::Let(Of::Fetched(load.value).into(), Type::Lanes, lanes));
        }
        made
    }

    /// The loop over lanes that computes values, keeps some of them, and uses them.
    pub(super) fn lanes(
        &self,
        values: &[ValueId],
        depth: usize,
        kept: &BTreeSet<ValueId>,
        actions: Vec<Statement>,
    ) -> Option<Statement> {
        let mut body = Vec::new();
        for value in self.computed(values) {
            body.push(Statement::Let(Of::Lane(value).into(), Type::Lane, self.lane(value, depth)));
            if kept.contains(&value) {
                body.push(Statement::Set(lane(Of::Kept(value)), Of::Lane(value).into()));
            }
        }
        body.extend(actions);
        // Whole lines, if nothing is read that ends with the block: no lanes remain for scalar code.
        let mut fetched = false;
        let mut look = |name: Local| fetched |= matches!(name.of, Of::Fetched(_));
        body.iter().for_each(|statement| statement.names(&mut look));
        let lanes = if fetched { Lanes::Width } else { Lanes::Filled };
        (!body.is_empty()).then_some(Statement::ForLanes(lanes, body))
    }

    fn used_deeper(&self, loops: &Loops, value: ValueId, depth: usize) -> bool {
        let nest = &self.kernel.nests[loops.nest];
        let last = loops.outer.len() + loops.inner.len();
        let deeper = loops.levels[depth + 1..].iter().flatten();
        deeper.into_iter().any(|other| self.kernel.operands(*other).contains(&value))
            || (depth < last && crate::kernel::schedule::roots(&nest.reduce, nest.value).contains(&value))
            || matches!(&nest.reduce, Reduce::Scan { initial, .. } if *initial == value)
    }

    /// A value as an operand at a depth; `usize::MAX`: after the loop over lanes of its own depth.
    pub(super) fn operand(&self, value: ValueId, depth: usize) -> Expression {
        if !self.varies(value) {
            return if self.group.parallel { Of::Splat(value).into() } else { Of::Once(value).into() };
        }
        if self.is_fetched(value) && !self.is_merged(value) {
            return lane(Of::Fetched(value));
        }
        let is_here = self.depth[value.position()] == depth && !self.hoisted.contains(&value);
        if is_here { Of::Lane(value).into() } else { lane(Of::Kept(value)) }
    }
}

/// One lane of lanes.
pub(super) fn lane(lanes: Of) -> Expression {
    Operation::LaneOf(lanes.into()).alone()
}

fn add(left: Expression, right: Expression) -> Expression {
    Operation::Binary(Kind::Lane, Binary::Add).of([left, right])
}

fn multiply(left: Expression, right: Expression) -> Expression {
    Operation::Binary(Kind::Lane, Binary::Multiply).of([left, right])
}

/// A fold so far, and one value more.
pub(super) fn folded(fold: Fold, folded: Expression, value: Expression) -> Expression {
    let operator = match fold {
        Fold::Sum => Binary::Add,
        Fold::Product => Binary::Multiply,
        Fold::Maximum => Binary::Maximum,
    };
    Operation::Binary(Kind::Lane, operator).of([folded, value])
}
