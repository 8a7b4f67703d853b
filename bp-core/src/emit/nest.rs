//! The loops of one group of nests: blocks of lanes, all nests fused in one pass.
//!
//! In: a schedule's group. Out: its loops as text. Invariant: `u` are uniform numbers (f64), `z` uniform integers
//! (isize), `t` uniform numbers in the type of the lanes, `r` fetched lanes, `a` lanes computed at an outer depth, `x`
//! one lane.

use super::fused::Item;
use super::names::local;
use super::question::room;
use super::text::{LocalName, Room, Text, words};
use crate::ids::{AxisId, BufferId, Id, ValueId};
use crate::kernel::schedule::{Group, Loops, Schedule};
use crate::kernel::{Buffer, Fold, Index, Kernel, Node, Reduce, Role};
use std::collections::{BTreeMap, BTreeSet};

/// Lanes in a block of a plate without rows, where nests leave arrays for each other.
const SHORT_BLOCK: usize = 128;

pub(super) struct Nests<'k> {
    pub(super) kernel: &'k Kernel,
    pub(super) schedule: &'k Schedule,
    pub(super) group: &'k Group,
    /// Depth at which each value of the nest at hand is computed.
    pub(super) depth: Vec<usize>,
    /// Whether products are plain multiplications ([`crate::equation::Mark::Linear`]).
    pub(super) is_linear: bool,
}

impl<'k> Nests<'k> {
    pub(super) fn new(kernel: &'k Kernel, schedule: &'k Schedule, group: &'k Group, is_linear: bool) -> Self {
        Self { kernel, schedule, group, depth: vec![0; kernel.nodes.len()], is_linear }
    }

    /// A group that is executed once.
    pub(super) fn serial(&mut self, text: &mut Text) {
        let group = self.group;
        for nest in &group.nests {
            room(self.kernel, self.kernel.nests[nest.nest].out, text);
            text.open("");
            self.nest(nest, &[], text);
            text.close();
            let name = local("m", self.kernel.nests[nest.nest].out);
            text.line(format!("let {name}: &[T] = &{name}[..];"));
            self.looked_at_once(self.kernel.nests[nest.nest].out, &name)
                .iter()
                .for_each(|line| text.line(line));
        }
    }

    /// A group that runs over blocks of the plate.
    pub(super) fn blocks(&mut self, shared: &[BufferId], text: &mut Text) {
        let group = self.group;
        let mut items = Text::default();
        let mut outside: BTreeMap<String, Room> = BTreeMap::new();
        let found = self.items();
        // Arrays passed between nests block by block must stay in the first cache.
        let is_kept = found.iter().any(|item| matches!(item, Item::Alone(_)));
        if is_kept && self.kernel.parallel.len() == 1 {
            text.line(format!("const LANES: usize = {SHORT_BLOCK};"));
        }
        for item in found {
            items.open("");
            match &item {
                Item::Alone(nest) => self.nest(nest, shared, &mut items),
                Item::Run(run) => self.run(run, shared, &mut outside, &mut items),
            }
            items.close();
        }
        let items = items.finish();
        let named: BTreeSet<&str> = words(&items).collect();
        for nest in &group.nests {
            let out = self.kernel.nests[nest.nest].out;
            if named.contains(local("m", out).as_str()) {
                outside.insert(local("m", out), Room::Blocks(self.cells(out)));
            }
        }
        // Where lanes are copied to: made once, outside the loops.
        let is_copy = |name: &&&str| {
            matches!(**name, "made" | "folded") || LocalName::of(name).is_some_and(|name| name.kind == "b")
        };
        for copy in named.iter().filter(is_copy) {
            outside.entry((*copy).to_owned()).or_insert(Room::Block);
        }
        outside.iter().for_each(|(name, room)| room.write(name, text));
        let names: Vec<String> = shared.iter().map(|out| local("y", *out)).collect();
        text.line(format!(
            "let [{}] = planes else {{ ::core::unreachable!(\"internal: a part of each\") }};",
            names.join(", ")
        ));
        let (lane, rows) = self.kernel.parallel.split_last().expect("internal: a parallel group has axes");
        let (row_range, span) = match rows.is_empty() {
            true => ("0..1", ("first".to_owned(), "first + count".to_owned())),
            false => ("first..first + count", ("0".to_owned(), local("e", *lane))),
        };
        let [before, after] = self.around(shared);
        text.line(before);
        text.open(format!("for row in {row_range}"));
        text.line("let mut rest = row;");
        for axis in rows.iter().rev() {
            text.line(format!("let i{0} = rest % e{0}; rest /= e{0};", axis.position()));
        }
        text.line(format!("let mut start: usize = {};", span.0));
        text.open(format!("while start < {}", span.1));
        text.line(format!("let width = LANES.min({} - start);", span.1));
        text.line("let filled = LANES.min(width.next_multiple_of(LINE));");
        text.line(match rows.is_empty() {
            true => "let place = start - first;".to_owned(),
            false => format!("let place = (row - first) * {} + start;", local("e", *lane)),
        });
        text.line(items);
        text.line("start += LANES;");
        text.close();
        text.close();
        text.line(after);
        text.line("suspects");
    }

    /// The number of contiguous cells of a buffer in one lane.
    pub(super) fn cells(&self, buffer: BufferId) -> String {
        let cells: Vec<String> = self.serial_axes(buffer).iter().map(|axis| local("e", *axis)).collect();
        if cells.is_empty() { "1".to_owned() } else { cells.join(" * ") }
    }

    pub(super) fn serial_axes(&self, buffer: BufferId) -> Vec<AxisId> {
        let parallel = |axis: &AxisId| self.group.parallel && self.kernel.parallel.contains(axis);
        self.kernel.buffers[buffer].axes.iter().copied().filter(|axis| !parallel(axis)).collect()
    }

    pub(super) fn varies(&self, value: ValueId) -> bool {
        self.group.parallel && self.schedule.is_varying(value)
    }

    /// Loads whose lanes are contiguous or equal: fetched before the loop over lanes.
    pub(super) fn is_fetched(&self, value: ValueId) -> bool {
        let Node::Load { buffer, indices, .. } = &self.kernel.nodes[value] else { return false };
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
        self.varies(value) && !is_found && stand
    }

    fn nest(&mut self, loops: &Loops, shared: &[BufferId], text: &mut Text) {
        for (depth, level) in loops.levels.iter().enumerate() {
            level.iter().for_each(|value| self.depth[value.position()] = depth);
        }
        self.depth(loops, 0, shared, text);
    }

    fn depth(&mut self, loops: &Loops, depth: usize, shared: &[BufferId], text: &mut Text) {
        let nest = &self.kernel.nests[loops.nest];
        let (outer, last) = (loops.outer.len(), loops.outer.len() + loops.inner.len());
        let lanes = self.group.parallel;
        if let (Reduce::Scan { axis, backward, keep, initial }, true) = (&nest.reduce, depth == outer) {
            self.level(loops, depth, &[], text);
            match lanes {
                true => {
                    text.line("let mut state = Aligned([T::ZERO; LANES]);");
                    text.line(format!(
                        "for l in 0..width {{ state[l] = {}; }}",
                        self.operand(*initial, usize::MAX)
                    ));
                }
                false => text.line(format!("let mut state = {};", self.operand(*initial, usize::MAX))),
            }
            text.open(format!("for step in 0..{}", local("e", *axis)));
            let running =
                if *backward { format!("{} - 1 - step", local("e", *axis)) } else { "step".to_owned() };
            text.line(format!("let i{} = {running};", axis.position()));
            let (target, copy) = self.target(nest.out, shared);
            let (keep, value) = (self.operand(*keep, depth + 1), self.operand(nest.value, depth + 1));
            match lanes {
                true => {
                    let update = [
                        format!("{target}[l] = state[l];"),
                        format!("state[l] = {keep} * state[l] + {value};"),
                    ];
                    self.begun(nest.out, shared).iter().for_each(|line| text.line(line));
                    self.level(loops, depth + 1, &update, text);
                    copy.iter().for_each(|copy| text.line(copy));
                }
                false => {
                    self.level(loops, depth + 1, &[], text);
                    text.line(format!("{target} = T::from_f64(state);"));
                    text.line(format!("state = {keep} * state + {value};"));
                }
            }
            text.close();
            return;
        }
        let mut actions = Vec::new();
        let (mut before, mut after) = (None, Vec::new());
        if let (Some(fold), true) = (nest.reduce.fold(), depth == outer) {
            let start = match fold {
                Fold::Sum => "0.0f64",
                Fold::Product => "1.0f64",
                Fold::Maximum => "f64::NEG_INFINITY",
            };
            text.line(match lanes {
                true => format!("folded[..filled].fill(T::from_f64({start}));"),
                false => format!("let mut folded = {start};"),
            });
        }
        if depth == last {
            let value = self.operand(nest.value, depth);
            match (nest.reduce.fold(), lanes) {
                (None, true) => {
                    let (target, copy) = self.target(nest.out, shared);
                    before = self.begun(nest.out, shared);
                    actions.push(format!("{target}[l] = {value};"));
                    after = copy;
                }
                (None, false) => {
                    let (target, _) = self.target(nest.out, shared);
                    after.push(format!("{target} = T::from_f64({value});"));
                }
                (Some(fold), true) => {
                    actions.push(match fold {
                        Fold::Sum => format!("folded[l] = folded[l] + {value};"),
                        Fold::Product => format!("folded[l] = folded[l] * {value};"),
                        Fold::Maximum => format!("folded[l] = Scalar::maximum(folded[l], {value});"),
                    });
                }
                (Some(fold), false) => after.push(match fold {
                    Fold::Sum => format!("folded += {value};"),
                    Fold::Product => format!("folded *= {value};"),
                    Fold::Maximum => format!("folded = f64::max(folded, {value});"),
                }),
            }
        }
        before.iter().for_each(|line| text.line(line));
        self.level(loops, depth, &actions, text);
        after.iter().for_each(|line| text.line(line));
        if depth < last {
            let axis = if depth < outer { loops.outer[depth] } else { loops.inner[depth - outer] };
            text.open(format!("for i{0} in 0..e{0}", axis.position()));
            self.depth(loops, depth + 1, shared, text);
            text.close();
        }
        if nest.reduce.fold().is_some() && depth == outer {
            match lanes {
                true => self.kept_lanes(nest.out, shared, "folded").iter().for_each(|line| text.line(line)),
                false => {
                    let (target, _) = self.target(nest.out, shared);
                    text.line(format!("{target} = T::from_f64(folded);"));
                }
            }
        }
    }

    /// The target of the current cell of a buffer, and the statements after it.
    fn target(&self, out: BufferId, shared: &[BufferId]) -> (String, Vec<String>) {
        if !self.group.parallel {
            return (format!("{}[{}]", local("m", out), self.plane(out)), Vec::new());
        }
        match shared.contains(&out) {
            false => ("own".to_owned(), self.looked_at(out, "&own[..width]").into_iter().collect()),
            true => ("made".to_owned(), self.kept_lanes(out, shared, "made")),
        }
    }

    /// Stores lanes computed on the stack, where nothing aliases.
    fn kept_lanes(&self, out: BufferId, shared: &[BufferId], made: &str) -> Vec<String> {
        let (plane, made) = (self.plane(out), format!("&{made}[..width]"));
        let mut kept: Vec<String> = self.looked_at(out, &made).into_iter().collect();
        let to = match shared.contains(&out) {
            false => format!("{}[({plane}) * LANES..][..width]", local("m", out)),
            true => format!("{}[{plane}][place..place + width]", local("y", out)),
        };
        kept.push(format!("{to}.copy_from_slice({made});"));
        kept
    }

    /// Lanes of a buffer of this pass are computed in place: it has its own memory.
    fn begun(&self, out: BufferId, shared: &[BufferId]) -> Option<String> {
        let (array, plane) = (local("m", out), self.plane(out));
        (!shared.contains(&out))
            .then(|| format!("let own: &mut [T] = &mut {array}[({plane}) * LANES..][..LANES];"))
    }

    /// The plane of a buffer that contains the current cell.
    pub(super) fn plane(&self, out: BufferId) -> String {
        let running: Vec<Index> =
            self.kernel.buffers[out].axes.iter().map(|axis| Index::Axis(*axis)).collect();
        self.planes(out, &running)
    }

    /// The plane of a buffer that is read at the current indices.
    pub(super) fn planes(&self, buffer: BufferId, indices: &[Index]) -> String {
        let serial = self.serial_axes(buffer);
        let mut plane: Vec<String> = Vec::new();
        for (index, axis) in indices.iter().zip(&self.kernel.buffers[buffer].axes) {
            let Some(position) = serial.iter().position(|own| own == axis) else { continue };
            let Index::Axis(running) = index else { unreachable!("internal: read at a running value") };
            let after: Vec<String> = serial[position + 1..].iter().map(|axis| local("e", *axis)).collect();
            let factor = if after.is_empty() { String::new() } else { format!(" * {}", after.join(" * ")) };
            plane.push(format!("i{}{factor}", running.position()));
        }
        if plane.is_empty() { "0".to_owned() } else { plane.join(" + ") }
    }

    /// The values of one depth, and their use lane by lane.
    fn level(&self, loops: &Loops, depth: usize, actions: &[String], text: &mut Text) {
        let values = &loops.levels[depth];
        for value in values.iter().filter(|value| !self.varies(**value)) {
            self.settled(*value).iter().for_each(|line| text.line(line));
            if self.group.parallel {
                text.line(format!("let t{0}: T = T::from_f64(u{0});", value.position()));
            }
        }
        for value in values.iter().filter(|value| self.is_fetched(**value)) {
            self.fetch(*value, "0", "LANES", text);
            let (id, Node::Load { buffer, .. }) = (value.position(), &self.kernel.nodes[*value]) else {
                unreachable!("internal: only loads are fetched")
            };
            text.line(format!("let r{id}: &[T] = &p{id}.of({}, &b{id}[..])[..width];", self.source(*buffer)));
        }
        let computed: Vec<ValueId> =
            values.iter().copied().filter(|value| self.varies(*value) && !self.is_fetched(*value)).collect();
        let merged: Vec<ValueId> = values
            .iter()
            .copied()
            .filter(|value| self.is_fetched(*value) && self.is_merged(*value))
            .collect();
        if computed.is_empty() && actions.is_empty() && merged.is_empty() {
            return;
        }
        let kept: Vec<ValueId> = computed
            .iter()
            .chain(&merged)
            .copied()
            .filter(|value| self.used_deeper(loops, *value, depth))
            .collect();
        for value in &kept {
            text.line(format!("let mut a{} = Aligned([T::ZERO; LANES]);", value.position()));
        }
        let mut here: Vec<ValueId> = computed.iter().chain(&merged).copied().collect();
        here.sort();
        let mut lines = Vec::new();
        for value in here {
            lines.push(format!("let x{}: T = {};", value.position(), self.lane(value, depth)));
            if kept.contains(&value) {
                lines.push(format!("a{0}[l] = x{0};", value.position()));
            }
        }
        lines.extend_from_slice(actions);
        // Whole lines, if nothing is read that ends with the block: no lanes remain for scalar code.
        let is_fetched =
            |word: &str| LocalName::of(word).is_some_and(|name| name.kind == "r" && name.rest.is_empty());
        let fetched = lines.iter().any(|line| words(line).any(is_fetched));
        text.open(if fetched { "for l in 0..width" } else { "for l in 0..filled" });
        lines.iter().for_each(|line| text.line(line));
        text.close();
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
    pub(super) fn operand(&self, value: ValueId, depth: usize) -> String {
        let position = value.position();
        if !self.varies(value) {
            return if self.group.parallel { format!("t{position}") } else { format!("u{position}") };
        }
        if self.is_fetched(value) && !self.is_merged(value) {
            return format!("r{position}[l]");
        }
        if self.depth[position] == depth { format!("x{position}") } else { format!("a{position}[l]") }
    }
}
