//! Fused nests in the loop language: the locations of lanes are computed once for a block; then each tile passes
//! through all nests.
//!
//! In: items of consecutive nests. Out: their statements. Invariant: names have copies by the indices of unrolled axes.
//! A tile is an array of known length, so that it stays in registers and each number is stored once.

use super::blocks::Room;
use super::fused::{Fused, Run, choices, values};
use super::nest::{Nests, folded};
use crate::ids::{AxisId, BufferId, Id, ValueId};
use crate::kernel::Check;
use crate::kernel::schedule::Loops;
use crate::loops::{Expression, Grain, Kind, Lanes, Local, Of, Operation, Statement, Target, Type};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Upper limit on the tiles that are kept in registers.
const MOST_TILES: usize = 16;

type Choice = HashMap<AxisId, usize>;

/// A copy of a value.
type Instance = (ValueId, Vec<usize>);

/// The source of the lanes of a tile.
enum Origin {
    /// A tile kept by another item of the run.
    Kept(Expression),
    /// An array.
    Array(Expression),
}

/// One item, in parts.
#[derive(Default)]
struct Parts {
    /// Statements executed once for a block: outside the item's loop, and inside it.
    outside: Vec<Statement>,
    inside: Vec<Statement>,
    /// One lane.
    lanes: Vec<Statement>,
    named: BTreeSet<Instance>,
    /// Fetched lanes: whether inside the item's loop, and their source.
    fetched: Vec<(Instance, bool, Origin)>,
    /// Fetched lanes that no earlier item of the run has fetched, outside the item's loop.
    rows: Vec<Statement>,
    /// Numbers that change inside the item's loop.
    numbers: Vec<Instance>,
    /// Computed tiles: name of the copy, buffer, and plane.
    made: Vec<(Vec<usize>, BufferId, Expression)>,
}

impl Origin {
    fn is_array(&self) -> bool {
        matches!(self, Self::Array(_))
    }
}

fn local(of: impl Fn(ValueId) -> Of, (value, copy): &Instance) -> Local {
    Local::new(of(*value), copy)
}

/// The order of copies in the text, by their names.
fn in_order(one: &Instance, other: &Instance) -> std::cmp::Ordering {
    let name = |copy: &Instance| super::print::name(&local(Of::Lane, copy));
    name(one).cmp(&name(other))
}

impl Nests<'_> {
    /// A run of items; allocations for all blocks are added to `rooms`.
    pub(super) fn run(
        &mut self,
        run: &Run<'_>,
        shared: &[BufferId],
        rooms: &mut BTreeMap<Local, Room>,
    ) -> Vec<Statement> {
        let mut known: BTreeSet<Instance> = BTreeSet::new();
        let parts: Vec<Parts> = run.items.iter().map(|fused| self.parts(run, fused, &mut known)).collect();
        let mut made = Vec::new();
        for (fused, parts) in run.items.iter().zip(&parts) {
            made.extend(self.settle(fused, parts, rooms));
        }
        // After all lanes have been copied, because a row borrows the copies.
        made.extend(parts.iter().flat_map(|parts| parts.rows.iter().cloned()));
        // Of known length, so that no index is checked in the loop over tiles.
        for (fused, parts) in run.items.iter().zip(&parts) {
            let Some(axis) = fused.axis else { continue };
            let settled = parts.fetched.iter().filter(|(_, inside, origin)| *inside && origin.is_array());
            let places = settled.map(|(copy, ..)| local(Of::Places, copy));
            let numbers = parts.numbers.iter().map(|copy| local(Of::Splats, copy));
            made.extend(places.chain(numbers).map(|name| Statement::Shorten(name, axis)));
        }
        let mut tiles = Vec::new();
        for kept in self.kept(run) {
            let name = Local::from(Of::Tiles(kept));
            match self.kernel.known_cells(&self.serial_axes(kept)) {
                // Few enough for registers.
                Some(cells) if cells <= MOST_TILES => tiles.push(Statement::Tiles(name, cells)),
                _ => {
                    let count = self.cells(kept);
                    rooms.insert(name, Room::Array { of: "Aligned([T::ZERO; TILE])", count });
                }
            }
        }
        for (fused, parts) in run.items.iter().zip(&parts) {
            tiles.push(Statement::Scope(self.tile(run, fused, parts, shared)));
        }
        made.push(Statement::ForTiles(tiles));
        made
    }

    /// The parts of an item. `known` are the values that the block has before its tiles.
    fn parts(&mut self, run: &Run<'_>, fused: &Fused<'_>, known: &mut BTreeSet<Instance>) -> Parts {
        let mut parts = Parts::default();
        for loops in &fused.nests {
            let short = self.written_out(loops);
            let nest = &self.kernel.nests[loops.nest];
            let needed = values(self.kernel, loops);
            needed.iter().for_each(|value| self.depth[value.position()] = 0);
            let mut made: Vec<Vec<usize>> = Vec::new();
            for choice in choices(self.kernel, &short) {
                needed.iter().for_each(|value| self.put(run, fused, (*value, &choice), known, &mut parts));
                let root = self.lane_in(&self.operand(nest.value, 0), &choice);
                let copy = self.copy(self.kernel.buffers[nest.out].axes.iter().copied(), &choice);
                let cell = Local::new(Of::Cell(nest.out), &copy);
                let value = match (nest.reduce.fold(), made.contains(&copy)) {
                    (Some(fold), true) => folded(fold, cell.clone().into(), root),
                    _ => {
                        let plane = self.instance(&self.plane(nest.out), &choice);
                        parts.made.push((copy.clone(), nest.out, plane));
                        made.push(copy);
                        root
                    }
                };
                parts.lanes.push(Statement::Let(cell, Type::Lane, value));
            }
        }
        let mut used: BTreeSet<Local> = BTreeSet::new();
        parts.lanes.iter().for_each(|lane| {
            lane.names(&mut |name| {
                used.insert(name);
            })
        });
        parts.numbers.retain(|copy| used.contains(&local(Of::Splat, copy)));
        parts.numbers.sort_by(in_order);
        parts.fetched.sort_by(|one, other| in_order(&one.0, &other.0));
        parts
    }

    /// The indices of those of these axes that are unrolled.
    fn copy(&self, axes: impl Iterator<Item = AxisId>, choice: &Choice) -> Vec<usize> {
        let chosen: BTreeSet<AxisId> = axes.filter(|axis| choice.contains_key(axis)).collect();
        chosen.iter().map(|axis| choice[axis]).collect()
    }

    fn copy_of(&self, value: ValueId, choice: &Choice) -> Instance {
        (value, self.copy(self.schedule.axes_of(value).iter().copied(), choice))
    }

    /// Adds a value to the part in which it is computed.
    fn put(
        &self,
        run: &Run<'_>,
        fused: &Fused<'_>,
        (value, choice): (ValueId, &Choice),
        known: &mut BTreeSet<Instance>,
        parts: &mut Parts,
    ) {
        let copy = self.copy_of(value, choice);
        if !parts.named.insert(copy.clone()) {
            return;
        }
        let inside = fused.axis.is_some_and(|axis| self.schedule.axes_of(value).contains(&axis));
        let lane = |of: Expression| Statement::Let(local(Of::Lane, &copy), Type::Lane, of);
        let mut made: Vec<Statement> = Vec::new();
        if !self.varies(value) {
            made.extend(self.settled(value));
            made.push(self.splat(value));
            if inside {
                parts.numbers.push(copy.clone());
            }
        } else if let Some(load) = self.fetched(value) {
            let buffer = load.buffer;
            if fused.nests.iter().any(|nest| self.kernel.nests[nest.nest].out == buffer) {
                let axes = self.kernel.buffers[buffer].axes.iter().copied();
                let cell = Local::new(Of::Cell(buffer), &self.copy(axes, choice));
                parts.lanes.push(lane(cell.into()));
                return;
            }
            parts.lanes.push(lane(Operation::LaneOf(local(Of::Fetched, &copy)).alone()));
            if self.is_made_in(run, buffer) {
                let plane = self.instance(&self.planes(buffer, load.indices), choice);
                let kept = Operation::Kept.of([Operation::At(Of::Tiles(buffer).into()).of([plane])]);
                parts.fetched.push((copy, inside, Origin::Kept(kept)));
                return;
            }
            let grain = if inside { Grain::Tile } else { Grain::Block };
            made = self.fetch(load, &slot(fused.axis.filter(|_| inside)), grain);
            let source = self.source(buffer);
            parts.fetched.push((copy.clone(), inside, Origin::Array(source.clone())));
            if !inside && !known.contains(&copy) {
                let [place, copies] =
                    [local(Of::Place, &copy), local(Of::Copies, &copy)].map(Expression::from);
                let row = Operation::Row.of([place, source, copies]);
                parts.rows.push(Statement::Let(local(Of::Fetched, &copy), Type::Lanes, row));
            }
        } else {
            parts.lanes.push(lane(self.lane_in(&self.lane(value, 0), choice)));
            return;
        }
        let made = made.into_iter().map(|statement| match statement {
            Statement::Let(name, of, made) => {
                let name = self.copied(&name, choice).unwrap_or(name);
                Statement::Let(name, of, self.instance(&made, choice))
            }
            other => other,
        });
        match inside {
            true => parts.inside.extend(made),
            false if known.insert(copy) => parts.outside.extend(made),
            false => {}
        }
    }

    /// An expression of one lane; fetched lanes are named already.
    fn lane_in(&self, of: &Expression, choice: &Choice) -> Expression {
        self.instance(of, choice).renamed(&|operation| match operation {
            Operation::LaneOf(Local { of: Of::Fetched(value), copy }) => {
                Some(Operation::Local(Local::new(Of::Lane(*value), copy)))
            }
            _ => None,
        })
    }

    /// The name in one copy, if each copy has its own.
    fn copied(&self, name: &Local, choice: &Choice) -> Option<Local> {
        let value = name.copied_value()?;
        Some(Local::new(name.of, &self.copy_of(value, choice).1))
    }

    /// An expression with the names of one copy.
    fn instance(&self, of: &Expression, choice: &Choice) -> Expression {
        of.renamed(&|operation| match operation {
            Operation::Local(Local { of: Of::Running(axis), .. }) => {
                choice.get(axis).map(|value| Operation::Chosen(*value))
            }
            Operation::Local(name) => self.copied(name, choice).map(Operation::Local),
            Operation::LaneOf(name) => self.copied(name, choice).map(Operation::LaneOf),
            _ => None,
        })
    }

    /// The statements of a block before its tiles: numbers, and the locations of lanes.
    fn settle(&self, fused: &Fused<'_>, parts: &Parts, rooms: &mut BTreeMap<Local, Room>) -> Vec<Statement> {
        let mut made = parts.outside.clone();
        let Some(axis) = fused.axis.filter(|_| !parts.inside.is_empty()) else { return made };
        let extent = Expression::from(Of::Extent(axis));
        let mut body = parts.inside.clone();
        let mut keep = |name: Local, value: Local| {
            let at = Operation::At(name).of([Of::Running(axis).into()]);
            body.push(Statement::Set(at, value.into()));
        };
        for copy in &parts.numbers {
            let numbers = Room::Array { of: "T::ZERO", count: extent.clone() };
            rooms.insert(local(Of::Splats, copy), numbers);
            keep(local(Of::Splats, copy), local(Of::Splat, copy));
        }
        for (copy, inside, origin) in &parts.fetched {
            if *inside && origin.is_array() {
                let places = Room::Array { of: "Place::default()", count: extent.clone() };
                rooms.insert(local(Of::Places, copy), places);
                rooms.insert(local(Of::Copies, copy), Room::Blocks(extent.clone()));
                keep(local(Of::Places, copy), local(Of::Place, copy));
            }
        }
        made.push(Statement::For(axis, body));
        made
    }

    /// One tile of an item.
    fn tile(&self, run: &Run<'_>, fused: &Fused<'_>, parts: &Parts, shared: &[BufferId]) -> Vec<Statement> {
        // A fold over the item's loop is initialised before the loop and stored after it.
        let (mut begun, mut given, mut steps) =
            ([Vec::new(), Vec::new()], [Vec::new(), Vec::new()], Vec::new());
        for (copy, out, plane) in &parts.made {
            let maker = fused.nests.iter().find(|nest| self.kernel.nests[nest.nest].out == *out);
            let maker = maker.expect("internal: it is made here");
            let over = fused.axis.is_some_and(|axis| maker.inner.contains(&axis));
            let fold = self.kernel.nests[maker.nest].reduce.fold().filter(|_| over);
            let (cell, tile) = (Local::new(Of::Cell(*out), copy), Local::new(Of::Tile(*out), copy));
            let targets = self.targets(run, fused, (*out, plane, &tile), shared);
            if targets.is_empty() {
                continue;
            }
            let start = match fold {
                Some(fold) => Expression::constant(Kind::Lane, fold.start()),
                None => Operation::Zero.alone(),
            };
            begun[usize::from(!over)].push(Statement::Tile(tile.clone(), start));
            let lane = Operation::LaneOf(tile).alone();
            let value = match fold {
                Some(fold) => folded(fold, lane.clone(), cell.into()),
                None => cell.into(),
            };
            steps.push(Statement::Set(lane, value));
            given[usize::from(!over)].extend(targets);
        }
        let [mut made, begun_inside] = begun;
        let [given_after, given_inside] = given;
        self.read(fused, parts, false, &mut made);
        let mut body = Vec::new();
        if let Some(axis) = fused.axis {
            for copy in &parts.numbers {
                let number = Operation::At(local(Of::Splats, copy)).of([Of::Running(axis).into()]);
                body.push(Statement::Let(local(Of::Splat, copy), Type::Lane, number));
            }
            self.read(fused, parts, true, &mut body);
        }
        body.extend(begun_inside);
        body.push(Statement::ForLanes(Lanes::Tile, parts.lanes.iter().cloned().chain(steps).collect()));
        body.extend(given_inside);
        match fused.axis {
            Some(axis) => made.push(Statement::For(axis, body)),
            None => made.extend(body),
        }
        made.extend(given_after);
        made
    }

    /// Reads the tiles that were fetched outside an item's loop, or inside it.
    fn read(&self, fused: &Fused<'_>, parts: &Parts, inside: bool, made: &mut Vec<Statement>) {
        for (copy, _, origin) in parts.fetched.iter().filter(|(_, own, _)| *own == inside) {
            let axis = fused.axis.filter(|_| inside);
            let place = match axis {
                Some(axis) => Operation::At(local(Of::Places, copy)).of([Of::Running(axis).into()]),
                None => local(Of::Place, copy).into(),
            };
            let tile = match origin {
                Origin::Kept(tile) => tile.clone(),
                Origin::Array(_) if !inside => Operation::TileOf.of([local(Of::Fetched, copy).into()]),
                Origin::Array(source) => {
                    let copies = local(Of::Copies, copy).into();
                    Operation::ReadTile.of([place, source.clone(), copies, slot(axis)])
                }
            };
            made.push(Statement::Let(local(Of::Fetched, copy), Type::Tile, tile));
        }
    }

    /// The destinations of a tile: result buffers, lanes kept for other items, tiles for items of this run.
    fn targets(
        &self,
        run: &Run<'_>,
        fused: &Fused<'_>,
        (out, plane, tile): (BufferId, &Expression, &Local),
        shared: &[BufferId],
    ) -> Vec<Statement> {
        let mut targets = Vec::new();
        let check = self.checked(out);
        if check == Some(Check::Total) {
            targets.push(Statement::LookAtTile(self.totals(), tile.clone()));
        }
        let mut keep = |target: Target, doubt: bool| {
            let (plane, tile) = (plane.clone(), tile.clone());
            targets.push(Statement::KeepTile { target, plane, tile, doubt });
        };
        if shared.contains(&out) {
            keep(Target::Planes(out), check == Some(Check::Number));
        }
        let reads = |nest: &&Loops| self.reads(nest, out);
        let inside = |nest: &&Loops| run.items.iter().any(|item| item.has(nest));
        if self.group.nests.iter().filter(reads).any(|nest| !inside(&nest)) {
            keep(Target::Own(out), false);
        }
        if self.group.nests.iter().filter(reads).any(|nest| inside(&nest) && !fused.has(nest)) {
            let kept = Operation::At(Of::Tiles(out).into()).of([plane.clone()]);
            targets.push(Statement::Set(kept, tile.clone().into()));
        }
        targets
    }

    /// The buffers whose tiles are kept for other items of a run.
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

/// The offset of the copies of an iteration of an item's loop.
fn slot(axis: Option<AxisId>) -> Expression {
    match axis {
        Some(axis) => Operation::Slot.of([Of::Running(axis).into()]),
        None => Operation::Count(0).alone(),
    }
}
