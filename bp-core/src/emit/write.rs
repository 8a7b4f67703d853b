//! Fused nests as text: where their lanes stand is settled for a block; then tile after tile runs through all of them.
//!
//! In: items of nests that follow each other. Out: their text. Invariant: `u`, `t` and `x` mean what they mean in
//! [`super::nest`], with the values of the axes that are written out after them; `p` is where fetched lanes stand, `r` a
//! tile of them, `v` one lane of what is made, `k` tiles that are kept for the nests after it. A tile is an array of known
//! length: so it lives in registers, and each number goes to memory once.

use super::fused::{Fused, Run, choices, values, written_out};
use super::names::local;
use super::nest::Nests;
use super::text::{LocalName, Room, Text, words};
use crate::ids::{AxisId, BufferId, Id, ValueId};
use crate::kernel::schedule::Loops;
use crate::kernel::{Check, Fold, Node};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Tiles that are kept in registers, at most.
const MOST_TILES: usize = 16;

type Choice = HashMap<AxisId, usize>;

/// Where the lanes of a tile come from.
enum Origin {
    /// A tile that another item of the run has kept.
    Kept(String),
    /// An array.
    Array(String),
}

/// The text of one item, in parts.
#[derive(Default)]
struct Parts {
    /// What is the same for the block: outside the item's loop, and inside it.
    outside: Vec<String>,
    inside: Vec<String>,
    /// One lane.
    lanes: Vec<String>,
    named: BTreeSet<String>,
    /// Lanes that are fetched, by name: whether inside the item's loop, and from where.
    fetched: BTreeMap<String, (bool, Origin)>,
    /// Numbers that change inside the item's loop.
    numbers: BTreeSet<String>,
    /// Tiles that are made: name of the copy, buffer, and plane.
    made: Vec<(String, BufferId, String)>,
}

impl Origin {
    fn is_array(&self) -> bool {
        matches!(self, Self::Array(_))
    }
}

impl Nests<'_> {
    /// Writes a run of items; `outside` gets what is made once for all blocks.
    pub(super) fn run(
        &mut self,
        run: &Run<'_>,
        shared: &[BufferId],
        outside: &mut BTreeMap<String, Room>,
        text: &mut Text,
    ) {
        let parts: Vec<Parts> = run.items.iter().map(|fused| self.parts(run, fused)).collect();
        for (fused, parts) in run.items.iter().zip(&parts) {
            self.settle(fused, parts, outside, text);
        }
        // Of known length, so that no index is checked in the loop over tiles.
        for (fused, parts) in run.items.iter().zip(&parts) {
            let Some(axis) = fused.axis else { continue };
            let settled = parts.fetched.iter().filter(|(_, (inside, origin))| *inside && origin.is_array());
            let names = settled.map(|(name, _)| format!("all_p{name}"));
            for name in names.chain(parts.numbers.iter().map(|name| format!("all_{name}"))) {
                text.line(format!("let {name} = &{name}[..{}];", local("e", axis)));
            }
        }
        text.line("let mut tile: usize = 0;");
        text.open("while tile < width");
        text.line("let count = TILE.min(width);");
        text.line("let at = if tile + TILE <= width { tile } else { width - count };");
        text.line("let start = start + at;");
        for kept in self.kept(run) {
            let name = local("k", kept);
            match self.kernel.known_cells(&self.serial_axes(kept)) {
                // Few enough for registers.
                Some(cells) if cells <= MOST_TILES => {
                    text.line(format!("let mut {name} = [Aligned([T::ZERO; TILE]); {cells}];"))
                }
                _ => {
                    let cells = self.cells(kept);
                    outside.insert(name, Room::Array { of: "Aligned([T::ZERO; TILE])", count: cells });
                }
            }
        }
        for (fused, parts) in run.items.iter().zip(&parts) {
            text.open("");
            self.tile(run, fused, parts, shared, text);
            text.close();
        }
        text.line("tile += TILE;");
        text.close();
    }

    fn parts(&mut self, run: &Run<'_>, fused: &Fused<'_>) -> Parts {
        let mut parts = Parts::default();
        for loops in &fused.nests {
            let short = written_out(self.kernel, loops);
            let nest = &self.kernel.nests[loops.nest];
            let needed = values(self.kernel, loops);
            needed.iter().for_each(|value| self.depth[value.position()] = 0);
            let mut made: Vec<String> = Vec::new();
            for choice in choices(self.kernel, &short) {
                needed.iter().for_each(|value| self.put(run, fused, *value, &choice, &mut parts));
                let root = self.lane_text(&self.operand(nest.value, 0), &choice);
                let suffix = self.suffix(self.kernel.buffers[nest.out].axes.iter().copied(), &choice);
                let name = format!("{}{suffix}", local("v", nest.out));
                match (nest.reduce.fold(), made.contains(&suffix)) {
                    (Some(fold), true) => {
                        parts.lanes.push(format!("let {name}: T = {};", folded(fold, &name, &root)))
                    }
                    _ => {
                        parts.lanes.push(format!("let {name}: T = {root};"));
                        let plane = self.instance(&self.plane(nest.out), &choice);
                        parts.made.push((suffix.clone(), nest.out, plane));
                        made.push(suffix);
                    }
                }
            }
        }
        let used: BTreeSet<&str> = parts.lanes.iter().flat_map(|line| words(line)).collect();
        parts.numbers.retain(|name| used.contains(name.as_str()));
        parts
    }

    /// The values of axes that are written out, of those among `axes`.
    fn suffix(&self, axes: impl Iterator<Item = AxisId>, choice: &Choice) -> String {
        let chosen: BTreeSet<AxisId> = axes.filter(|axis| choice.contains_key(axis)).collect();
        chosen.iter().map(|axis| format!("_{}", choice[axis])).collect()
    }

    fn value_suffix(&self, value: usize, choice: &Choice) -> String {
        let value = self.kernel.nodes.ids().nth(value).expect("internal: a name of a value");
        self.suffix(self.axes_of(value).into_iter(), choice)
    }

    /// Puts one value where it is computed.
    fn put(&self, run: &Run<'_>, fused: &Fused<'_>, value: ValueId, choice: &Choice, parts: &mut Parts) {
        let id = value.position();
        let suffix = self.value_suffix(id, choice);
        if !parts.named.insert(format!("{id}{suffix}")) {
            return;
        }
        let inside = fused.axis.is_some_and(|axis| self.axes_of(value).contains(&axis));
        let mut lines: Vec<String> = Vec::new();
        if !self.varies(value) {
            lines.extend(self.settled(value));
            lines.push(format!("let t{id}: T = T::from_f64(u{id});"));
            if inside {
                parts.numbers.insert(format!("t{id}{suffix}"));
            }
        } else if let (Node::Load { buffer, indices, .. }, true) =
            (&self.kernel.nodes[value], self.is_fetched(value))
        {
            if fused.nests.iter().any(|nest| self.kernel.nests[nest.nest].out == *buffer) {
                let axes = self.kernel.buffers[*buffer].axes.iter().copied();
                let made = format!("{}{}", local("v", *buffer), self.suffix(axes, choice));
                parts.lanes.push(format!("let x{id}{suffix}: T = {made};"));
                return;
            }
            parts.lanes.push(format!("let x{id}{suffix}: T = r{id}{suffix}[l];"));
            if self.is_made_in(run, *buffer) {
                let plane = self.instance(&self.planes(*buffer, indices), choice);
                let kept = format!("{}[{plane}]", local("k", *buffer));
                parts.fetched.insert(format!("{id}{suffix}"), (inside, Origin::Kept(kept)));
                return;
            }
            let slot = match (inside, fused.axis) {
                (true, Some(axis)) => format!("{} * LANES", local("i", axis)),
                _ => "0".to_owned(),
            };
            let mut fetched = Text::default();
            self.fetch(value, &slot, "TILE", &mut fetched);
            lines.extend(fetched.finish().lines().map(str::to_owned));
            let source = self.source(*buffer);
            parts.fetched.insert(format!("{id}{suffix}"), (inside, Origin::Array(source)));
        } else {
            let line = format!("let x{id}: T = {};", self.lane(value, 0));
            parts.lanes.push(self.lane_text(&line, choice));
            return;
        }
        let lines = lines.iter().map(|line| self.instance(line, choice));
        if inside { parts.inside.extend(lines) } else { parts.outside.extend(lines) }
    }

    /// The text of one lane: what was fetched has been read already.
    fn lane_text(&self, text: &str, choice: &Choice) -> String {
        let text = self.instance(text, choice);
        let mut read = String::new();
        let mut rest = text.as_str();
        while let Some(end) = rest.find("[l]") {
            let start =
                rest[..end].rfind(|c: char| !(c.is_alphanumeric() || c == '_')).map_or(0, |at| at + 1);
            read.push_str(&rest[..start]);
            read.push_str(&format!("x{}", &rest[start + 1..end]));
            rest = &rest[end + 3..];
        }
        read + rest
    }

    /// Text with the names of values and axes made those of one copy.
    fn instance(&self, text: &str, choice: &Choice) -> String {
        let mut out = String::new();
        let mut rest = text;
        while !rest.is_empty() {
            let is_word = |c: char| c.is_alphanumeric() || c == '_';
            let end = rest.find(|c| !is_word(c)).unwrap_or(rest.len());
            if end == 0 {
                let first = rest.chars().next().map_or(1, char::len_utf8);
                out.push_str(&rest[..first]);
                rest = &rest[first..];
                continue;
            }
            let word = &rest[..end];
            rest = &rest[end..];
            let name = LocalName::of(word).filter(|name| name.rest.is_empty());
            match name.map_or((word, None), |name| (name.kind, Some(name.position))) {
                ("u" | "z" | "t" | "r" | "x" | "b" | "p" | "from" | "inside", Some(number)) => {
                    out.push_str(&format!("{word}{}", self.value_suffix(number, choice)));
                }
                ("i", Some(number)) => match choice.iter().find(|(axis, _)| axis.position() == number) {
                    Some((_, value)) => out.push_str(&format!("{value}usize")),
                    None => out.push_str(word),
                },
                _ => out.push_str(word),
            }
        }
        out
    }

    /// What is the same for a block: numbers, and where lanes stand.
    fn settle(
        &self,
        fused: &Fused<'_>,
        parts: &Parts,
        outside: &mut BTreeMap<String, Room>,
        text: &mut Text,
    ) {
        parts.outside.iter().for_each(|line| text.line(line));
        let Some(axis) = fused.axis.filter(|_| !parts.inside.is_empty()) else { return };
        let (extent, running) = (local("e", axis), local("i", axis));
        text.open(format!("for {running} in 0..{extent}"));
        parts.inside.iter().for_each(|line| text.line(line));
        for name in &parts.numbers {
            outside.insert(format!("all_{name}"), Room::Array { of: "T::ZERO", count: extent.clone() });
            text.line(format!("all_{name}[{running}] = {name};"));
        }
        for (name, (inside, origin)) in &parts.fetched {
            if *inside && origin.is_array() {
                let places = Room::Array { of: "Place::default()", count: extent.clone() };
                outside.insert(format!("all_p{name}"), places);
                outside.insert(format!("b{name}"), Room::Blocks(extent.clone()));
                text.line(format!("all_p{name}[{running}] = p{name};"));
            }
        }
        text.close();
    }

    /// One tile of an item.
    fn tile(&self, run: &Run<'_>, fused: &Fused<'_>, parts: &Parts, shared: &[BufferId], text: &mut Text) {
        // What is folded over the item's loop is begun before it and given away after it.
        let (mut begun, mut given, mut steps) =
            ([Vec::new(), Vec::new()], [Vec::new(), Vec::new()], Vec::new());
        for (suffix, out, plane) in &parts.made {
            let maker = fused.nests.iter().find(|nest| self.kernel.nests[nest.nest].out == *out);
            let maker = maker.expect("internal: it is made here");
            let over = fused.axis.is_some_and(|axis| maker.inner.contains(&axis));
            let fold = self.kernel.nests[maker.nest].reduce.fold().filter(|_| over);
            let targets = self.targets(run, fused, *out, plane, shared);
            if targets.is_empty() {
                continue;
            }
            let (lane, tile) =
                (format!("{}{suffix}", local("v", *out)), format!("{}{suffix}", local("w", *out)));
            let start = fold.map_or("T::ZERO".to_owned(), |fold| {
                format!("T::from_f64({})", super::value::constant(fold.start()))
            });
            begun[usize::from(!over)].push(format!("let mut {tile} = Aligned([{start}; TILE]);"));
            let value = fold.map_or(lane.clone(), |fold| folded(fold, &format!("{tile}[l]"), &lane));
            steps.push(format!("{tile}[l] = {value};"));
            given[usize::from(!over)].extend(targets.iter().map(|target| target.replace("TILE_MADE", &tile)));
        }
        begun[0].iter().for_each(|line| text.line(line));
        self.read(fused, parts, false, text);
        if let Some(axis) = fused.axis {
            let running = local("i", axis);
            text.open(format!("for {running} in 0..{}", local("e", axis)));
            for name in &parts.numbers {
                text.line(format!("let {name}: T = all_{name}[{running}];"));
            }
            self.read(fused, parts, true, text);
        }
        begun[1].iter().for_each(|line| text.line(line));
        text.open("for l in 0..TILE");
        parts.lanes.iter().chain(&steps).for_each(|line| text.line(line));
        text.close();
        given[1].iter().for_each(|line| text.line(line));
        if fused.axis.is_some() {
            text.close();
        }
        given[0].iter().for_each(|line| text.line(line));
    }

    /// Reads the tiles that were fetched outside an item's loop, or inside it.
    fn read(&self, fused: &Fused<'_>, parts: &Parts, inside: bool, text: &mut Text) {
        for (name, (_, origin)) in parts.fetched.iter().filter(|(_, (own, _))| *own == inside) {
            let (place, slot) = match fused.axis.filter(|_| inside) {
                Some(axis) => {
                    let running = local("i", axis);
                    (format!("all_p{name}[{running}]"), format!("{running} * LANES"))
                }
                None => (format!("p{name}"), "0".to_owned()),
            };
            text.line(match origin {
                Origin::Kept(tile) => format!("let r{name}: Tile<T> = {tile};"),
                Origin::Array(source) => {
                    format!("let r{name}: Tile<T> = read_tile({place}, {source}, &b{name}[..], {slot}, at);")
                }
            });
        }
    }

    /// Where a tile goes: to the host's buffers, to lanes that are kept for other items, to tiles for those of this run.
    fn targets(
        &self,
        run: &Run<'_>,
        fused: &Fused<'_>,
        out: BufferId,
        plane: &str,
        shared: &[BufferId],
    ) -> Vec<String> {
        let mut targets = Vec::new();
        let check = self.checked(out);
        if check == Some(Check::Total) {
            // The last tile of a row begins with lanes that the one before it has counted.
            targets
                .push(format!("suspects += suspect_tile(&TILE_MADE, tile - at, count, {});", self.least()));
        }
        if shared.contains(&out) {
            let place = format!("&mut {}[{plane}][..], place + at, count, TILE_MADE", local("y", out));
            targets.push(match check {
                Some(Check::Number) => format!("write_numbers({place}, &mut doubt);"),
                _ => format!("write_tile({place});"),
            });
        }
        let reads = |nest: &&Loops| self.reads(nest, out);
        let inside = |nest: &&Loops| run.items.iter().any(|item| item.has(nest));
        if self.group.nests.iter().filter(reads).any(|nest| !inside(&nest)) {
            let lanes = local("m", out);
            targets.push(format!("write_tile(&mut {lanes}[..], ({plane}) * LANES + at, count, TILE_MADE);"));
        }
        if self.group.nests.iter().filter(reads).any(|nest| inside(&nest) && !fused.has(nest)) {
            targets.push(format!("{}[{plane}] = TILE_MADE;", local("k", out)));
        }
        targets
    }

    /// The buffers of which tiles are kept for other items of a run.
    fn kept(&self, run: &Run<'_>) -> Vec<BufferId> {
        let made = run.items.iter().flat_map(|item| item.nests.iter().map(move |nest| (item, nest)));
        made.map(|(item, nest)| (item, self.kernel.nests[nest.nest].out))
            .filter(|(item, out)| {
                let mut others = run.items.iter().flat_map(|other| &other.nests);
                others.any(|nest| !item.has(nest) && self.reads(nest, *out))
            })
            .map(|(_, out)| out)
            .collect()
    }
}

fn folded(fold: Fold, folded: &str, value: &str) -> String {
    match fold {
        Fold::Sum => format!("{folded} + {value}"),
        Fold::Product => format!("{folded} * {value}"),
        Fold::Maximum => format!("Scalar::maximum({folded}, {value})"),
    }
}
