//! From loops to a flat program: short loops are unrolled, so that indices, conditions and sums become constants.
//!
//! In: the nests of a pass, the kinds of its axes, all extents. Out: values and actions ([`Built`]). Invariant: each
//! cell's arithmetic has the order of the schedule's loops.

use super::code::{Loop, Numeric, Planes, Target, Term};
use super::shape::{Action, Built, Doing, Known, Shape};
use super::values::{Value, Values};
use crate::ids::{AxisId, BufferId, Id, ValueId};
use crate::kernel::schedule::Loops;
use crate::kernel::{Fold, Node, Reduce};
use crate::operators::Binary;
use std::collections::{HashMap, HashSet};

/// The kind of an axis.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Running {
    At(usize),
    Counts,
    Lane,
}

pub(super) struct Builder<'k> {
    pub(super) known: &'k Known<'k>,
    pub(super) shape: &'k Shape,
    pub(super) values: Values,
    pub(super) running: Vec<Running>,
    pub(super) at: Vec<Value>,
    /// The results of the pass, by buffer and plane.
    pub(super) forward: HashMap<(BufferId, usize), Value>,
    /// Its results: planes that live for a block, and planes in memory.
    pub(super) of_block: HashMap<BufferId, usize>,
    into_memory: HashMap<BufferId, usize>,
    here: HashSet<BufferId>,
    doing: Doing,
    kept: usize,
    /// Whether an unrolled value can be selected only at run time.
    pub(super) lost: bool,
}

impl<'k> Builder<'k> {
    /// Builds a pass; `None` if it cannot be unrolled as required.
    pub(super) fn build(
        known: &'k Known<'k>,
        shape: &'k Shape,
        nests: &[&Loops],
        local: impl Fn(BufferId) -> bool,
    ) -> Option<Built> {
        let axes = known.kernel.axes.len();
        let mut values = Values { level_of: vec![0; axes], ..Values::default() };
        let block = shape.block_level();
        values.lane_level = if shape.one_block { 0 } else { block };
        for (number, axis) in shape.rows.iter().enumerate() {
            values.level_of[axis.position()] = 1 + number;
        }
        let zero = values.constant(0.0);
        let mut builder = Self {
            known,
            shape,
            values,
            running: vec![Running::Counts; axes],
            at: vec![zero; known.kernel.nodes.len()],
            forward: HashMap::new(),
            of_block: HashMap::new(),
            into_memory: HashMap::new(),
            here: HashSet::new(),
            doing: Doing::default(),
            kept: 0,
            lost: false,
        };
        let (mut made, mut of_block) = (Vec::new(), Vec::new());
        for loops in nests {
            let out = known.kernel.nests[loops.nest].out;
            builder.here.insert(out);
            let planes = builder.serial(out).map(|axis| known.extents[axis.position()]).product();
            if shape.unroll.is_some() && nests.len() > 1 {
                builder.of_block.insert(out, of_block.len());
                of_block.push(planes);
            }
            if !local(out) {
                builder.into_memory.insert(out, made.len());
                made.push((out, planes));
            }
        }
        let mut stages = Vec::new();
        for loops in nests {
            builder.begin_nest(loops, block);
            builder.outside(loops, 0);
            if shape.unroll.is_some() {
                stages.push(builder.finish_stage(block));
            }
        }
        if shape.unroll.is_none() {
            stages.push(builder.finish_stage(block));
        }
        (!builder.lost).then_some(Built {
            values: builder.values,
            stages,
            made,
            of_block,
            kept: builder.kept,
        })
    }

    /// The axes of a buffer that are neither rows nor lanes.
    pub(super) fn serial(&self, buffer: BufferId) -> impl Iterator<Item = AxisId> + use<'k> {
        let (kernel, shape) = (self.known.kernel, self.shape);
        let axes = kernel.buffers[buffer].axes.iter().copied();
        axes.filter(move |axis| !shape.rows.contains(axis) && !shape.lanes.contains(axis))
    }

    pub(super) fn extent(&self, axis: AxisId) -> usize {
        self.known.extents[axis.position()]
    }

    /// Whether the pass has computed a buffer that it reads.
    pub(super) fn makes(&self, buffer: BufferId) -> bool {
        self.here.contains(&buffer)
    }

    /// Assigns each axis of a nest: the innermost loops are unrolled, as far as possible.
    fn begin_nest(&mut self, loops: &Loops, block: usize) {
        for axis in &self.shape.rows {
            self.running[axis.position()] = Running::Counts;
        }
        for axis in &self.shape.lanes {
            self.running[axis.position()] = Running::Lane;
        }
        let inside = |axis: &&AxisId| !self.shape.rows.contains(axis) && !self.shape.lanes.contains(axis);
        let order: Vec<AxisId> = loops.outer.iter().chain(&loops.inner).filter(inside).copied().collect();
        let mut values = loops.levels.iter().map(Vec::len).sum::<usize>();
        let mut first = order.len();
        while first > 0 {
            values *= self.extent(order[first - 1]);
            if self.shape.unroll.is_some_and(|most| values > most) {
                break;
            }
            first -= 1;
        }
        let backward = |axis: AxisId| match &self.known.kernel.nests[loops.nest].reduce {
            Reduce::Scan { axis: scanned, backward, .. } => *backward && *scanned == axis,
            _ => false,
        };
        for (number, axis) in order[..first].iter().enumerate() {
            self.running[axis.position()] = Running::Counts;
            self.values.level_of[axis.position()] = block + 1 + number;
            let around =
                Loop { axis: axis.position(), extent: self.extent(*axis), backward: backward(*axis) };
            self.doing.loops.push(around);
        }
        self.doing.outer = order[..first].iter().filter(|axis| loops.outer.contains(axis)).count();
        order[first..].iter().for_each(|axis| self.running[axis.position()] = Running::At(0));
        self.values.innermost = block + first;
    }

    fn finish_stage(&mut self, block: usize) -> Doing {
        let mut doing = std::mem::take(&mut self.doing);
        let Values { lanes, numbers, places, .. } = &self.values;
        doing.lanes.end = lanes.all.len();
        doing.numbers.end = numbers.all.len();
        doing.places.end = places.all.len();
        let next = Doing {
            lanes: doing.lanes.end..0,
            numbers: doing.numbers.end..0,
            places: doing.places.end..0,
            ..Doing::default()
        };
        self.doing = next;
        self.values.next_stage(block);
        doing
    }

    /// Iterates over an axis: value by value where it is unrolled.
    fn through(&mut self, axis: AxisId, backward: bool, body: &mut dyn FnMut(&mut Self)) {
        match self.running[axis.position()] {
            Running::Counts | Running::Lane => body(self),
            Running::At(_) => {
                let extent = self.extent(axis);
                for step in 0..extent {
                    self.running[axis.position()] =
                        Running::At(if backward { extent - 1 - step } else { step });
                    body(self);
                }
            }
        }
    }

    fn compute(&mut self, values: &[ValueId]) {
        for value in values {
            self.at[value.position()] = self.value(*value);
        }
    }

    fn outside(&mut self, loops: &Loops, depth: usize) {
        self.compute(&loops.levels[depth]);
        if let Some(axis) = loops.outer.get(depth) {
            self.through(*axis, false, &mut |builder| builder.outside(loops, depth + 1));
            return;
        }
        let nest = &self.known.kernel.nests[loops.nest];
        match &nest.reduce {
            Reduce::None => {
                let made = self.at[nest.value.position()];
                self.store(nest.out, made, false);
            }
            Reduce::Fold(fold, _) => self.fold(loops, depth, *fold),
            Reduce::Scan { axis, backward, keep, initial } => {
                let looped = self.running[axis.position()] == Running::Counts;
                let mut state = self.at[initial.position()];
                if looped {
                    self.doing.begin.push(Action::Keep(self.kept, state));
                    state = Value::Kept(self.kept);
                    self.kept += 1;
                }
                self.through(*axis, *backward, &mut |builder| {
                    builder.compute(&loops.levels[depth + 1]);
                    builder.store(nest.out, state, false);
                    let keep = builder.at[keep.position()];
                    let kept = builder.values.binary(Binary::Multiply, keep, state);
                    let next = builder.at[nest.value.position()];
                    state = builder.values.binary(Binary::Add, kept, next);
                });
                if looped {
                    self.keep(self.kept - 1, state);
                }
            }
        }
    }

    /// Stores a state for the next step of the loops, unless it is unchanged (a sum of zeros).
    fn keep(&mut self, kept: usize, state: Value) {
        if state != Value::Kept(kept) {
            self.doing.each.push(Action::Keep(kept, state));
        }
    }

    fn fold(&mut self, loops: &Loops, depth: usize, fold: Fold) {
        let out = self.known.kernel.nests[loops.nest].out;
        let looped = loops.inner.iter().any(|axis| self.running[axis.position()] == Running::Counts);
        let start = self.values.constant(fold.start());
        let mut folded = start;
        let kept = self.kept;
        if looped || self.shape.folded {
            self.kept += 1;
            self.doing.begin.push(Action::Keep(kept, start));
            folded = Value::Kept(kept);
        }
        let whole = folded;
        self.inside(loops, depth, fold, kept, &mut folded);
        if looped && !self.shape.folded {
            self.keep(kept, folded);
        }
        match looped || self.shape.folded {
            true => self.store(out, whole, true),
            false => self.store(out, folded, false),
        }
    }

    fn inside(&mut self, loops: &Loops, depth: usize, fold: Fold, kept: usize, folded: &mut Value) {
        if let Some(axis) = loops.inner.get(depth - loops.outer.len()) {
            self.through(*axis, false, &mut |builder| {
                builder.compute(&loops.levels[depth + 1]);
                builder.inside(loops, depth + 1, fold, kept, folded);
            });
            return;
        }
        let value = self.at[self.known.kernel.nests[loops.nest].value.position()];
        if self.shape.folded {
            self.doing.each.push(Action::Fold(kept, fold, value));
            return;
        }
        *folded = match fold {
            Fold::Sum => self.values.binary(Binary::Add, *folded, value),
            Fold::Product => self.values.binary(Binary::Multiply, *folded, value),
            Fold::Maximum => match self.values.known(*folded) == Some(f64::NEG_INFINITY) {
                true => value,
                false => self.values.binary(Binary::Maximum, *folded, value),
            },
        };
    }

    /// The value after storing.
    fn stored(&mut self, value: Value) -> Value {
        match value {
            Value::Number(number) if self.known.narrow => match self.values.known(value) {
                Some(exact) if f64::from(exact as f32) == exact => value,
                _ => self.values.number(Numeric::Stored(number)),
            },
            _ => value,
        }
    }

    fn store(&mut self, out: BufferId, value: Value, at_end: bool) {
        let (mut base, mut terms) = (0, Vec::new());
        let mut stride = 1;
        let serial: Vec<AxisId> = self.serial(out).collect();
        for axis in serial.into_iter().rev() {
            let extent = self.extent(axis);
            match self.running[axis.position()] {
                Running::At(at) => base += at * stride,
                _ => {
                    let number = self.values.number_of(Numeric::Counter(axis.position()));
                    terms.push(Term { number, stride, extent });
                }
            }
            stride *= extent;
        }
        if self.shape.unroll.is_none() {
            let stored = self.stored(value);
            self.forward.insert((out, base), stored);
        }
        let planes = [
            self.of_block.get(&out).map(|number| Planes::Block(*number)),
            self.into_memory.get(&out).map(|number| Planes::Made(*number)),
        ];
        for planes in planes.into_iter().flatten() {
            let target = Target { planes, base, terms: terms.clone() };
            let action = Action::Store(target, value);
            match at_end {
                true => self.doing.end.push(action),
                false => self.doing.inside.push((self.values.lanes.all.len(), action)),
            }
        }
    }

    fn value(&mut self, id: ValueId) -> Value {
        let at = |value: &ValueId| self.at[value.position()];
        match &self.known.kernel.nodes[id] {
            Node::Constant(bits) => self.values.constant(f64::from_bits(*bits)),
            Node::Axis(axis) => self.axis(*axis),
            Node::Unary(operator, a) => {
                let a = at(a);
                self.values.unary(*operator, a)
            }
            Node::Binary(operator, a, b) => {
                let (a, b) = (at(a), at(b));
                self.values.binary(*operator, a, b)
            }
            Node::Select(a, b, c) => {
                let (a, b, c) = (at(a), at(b), at(c));
                self.values.select(a, b, c)
            }
            Node::Mass(law, operands) => {
                let operands = operands.map(|operand| at(&operand));
                self.values.mass(*law, operands)
            }
            Node::Load { buffer, indices, otherwise } => {
                let otherwise = otherwise.as_ref().map(at);
                self.load(*buffer, indices, otherwise)
            }
        }
    }
}
