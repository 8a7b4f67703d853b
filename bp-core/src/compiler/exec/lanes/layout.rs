//! From values to instructions: unused values are removed, patterns are fused, and lanes get slots.
//!
//! In: a [`Built`] pass. Out: a [`Pass`]. Invariant: a slot of the innermost level is reused after the last read of its
//! lanes; other slots are not. Fused arithmetic has the order of its parts.

use super::code::{
    Code, Comparison, Computed, Instruction, Numeric, Operand, Pass, Planes, Read, Stage, Target, Work,
};
use super::shape::{Action, Built, Doing, Shape};
use super::values::Value;
use crate::ids::{AxisId, Id};
use crate::operators::Binary;

/// Limit of the bytes of slots of a block, which stay in the nearest caches.
const MOST_BYTES: usize = 64 << 10;

/// The used values, and their numbers of uses.
struct Needs {
    lanes: Vec<usize>,
    numbers: Vec<bool>,
    places: Vec<bool>,
    /// Whether lanes must keep their slot: those read on another level, or around the inner loops.
    lasting: Vec<bool>,
}

pub(super) struct Layout {
    built: Built,
    needs: Needs,
    slot: Vec<usize>,
    slots: usize,
    free: Vec<usize>,
}

impl Layout {
    /// Lays out a pass for rows of this number of lanes, of `bytes` each.
    pub(super) fn of(built: Built, shape: &Shape, extents: &[usize], bytes: usize) -> Pass {
        let needs = Needs {
            lanes: vec![0; built.values.lanes.all.len()],
            numbers: vec![false; built.values.numbers.all.len()],
            places: vec![false; built.values.places.all.len()],
            lasting: vec![false; built.values.lanes.all.len()],
        };
        let (slot, slots) = (vec![usize::MAX; built.values.lanes.all.len()], built.kept);
        let mut layout = Self { built, needs, slot, slots, free: Vec::new() };
        layout.fuse();
        layout.find_needs();
        let block = shape.block_level();
        let levels = (0..block).map(|level| layout.shared(level)).collect();
        let stages: Vec<Doing> = std::mem::take(&mut layout.built.stages);
        // Numbers and slots of outer levels first: those of the innermost are reused.
        let stages = stages.into_iter().map(|doing| layout.stage(doing, block)).collect();
        let Built { values, made, of_block, .. } = layout.built;
        let constants = values.numbers.all.iter().enumerate().filter_map(|(at, (how, _))| match how {
            Numeric::Constant(bits) => Some((at, f64::from_bits(*bits))),
            _ => None,
        });
        let constants = constants.collect();
        let extent = |axis: &AxisId| extents[axis.position()];
        let lanes: usize = shape.lanes.iter().map(extent).product();
        let most = MOST_BYTES / (bytes * layout.slots.max(1));
        Pass {
            rows: shape.rows.iter().map(|axis| (axis.position(), extent(axis))).collect(),
            lanes,
            block: if shape.one_block { lanes } else { lanes.min((most / 64 * 64).clamp(64, 512)) },
            folded: shape.folded,
            reads: values.reads(),
            made,
            of_block,
            constants,
            numbers: values.numbers.all.len(),
            slots: layout.slots,
            places: values.places.all.into_iter().map(|(place, _)| place).collect(),
            patterns: values.patterns.all.into_iter().map(|(pattern, _)| pattern).collect(),
            levels,
            stages,
        }
    }

    /// Products of three, sums of two products, sums with a product, choices by a comparison: if the intermediate value is
    /// not used elsewhere.
    fn fuse(&mut self) {
        let count = self.uses();
        let all = &mut self.built.values.lanes.all;
        for at in 0..all.len() {
            if let (Work::Computed(Computed::Select(Value::Lanes(condition), then, otherwise)), level) =
                all[at]
                && count[condition] == 1
                && all[condition].1 == level
                && let Work::Computed(Computed::Binary(operator, x, y)) = all[condition].0
                && let Some(comparison) = Comparison::of(operator)
                && ![x, then, otherwise].iter().any(|operand| matches!(operand, Value::Number(_)))
            {
                all[at].0 = Work::Computed(Computed::Choose(comparison, x, y, then, otherwise));
                continue;
            }
            let (Work::Computed(Computed::Binary(operator, a, b)), level) = &all[at] else { continue };
            let product = |value: &Value| match value {
                Value::Lanes(of) if count[*of] == 1 && all[*of].1 == *level => match all[*of].0 {
                    Work::Computed(Computed::Binary(Binary::Multiply, x, y)) => Some((x, y)),
                    _ => None,
                },
                _ => None,
            };
            let fused = match (operator, product(a), product(b)) {
                (Binary::Add, Some((a, b)), Some((c, d))) => Computed::Mixture(a, b, c, d),
                (Binary::Add, None, Some((c, d))) => Computed::AddProduct(*a, c, d),
                (Binary::Add, Some((c, d)), None) => Computed::AddProduct(*b, c, d),
                (Binary::Multiply, Some((x, y)), _) => Computed::Product(x, y, *b),
                (Binary::Multiply, None, Some((x, y))) => Computed::Product(x, y, *a),
                _ => continue,
            };
            all[at].0 = Work::Computed(fused);
        }
    }

    fn actions(&self) -> impl Iterator<Item = &Action> {
        self.built.stages.iter().flat_map(|doing| {
            let inside = doing.inside.iter().map(|(_, action)| action);
            inside.chain(&doing.begin).chain(&doing.each).chain(&doing.end)
        })
    }

    /// The number of reads of the lanes of each value by used values.
    fn uses(&self) -> Vec<usize> {
        let all = &self.built.values.lanes.all;
        let mut count = vec![0; all.len()];
        for action in self.actions() {
            if let Value::Lanes(at) = action.value() {
                count[at] += 1;
            }
        }
        for at in (0..all.len()).rev() {
            if count[at] > 0 {
                all[at].0.each(|operand| {
                    if let Value::Lanes(of) = operand {
                        count[of] += 1;
                    }
                });
            }
        }
        count
    }

    fn find_needs(&mut self) {
        self.needs.lanes = self.uses();
        let values = &self.built.values;
        let (lanes, needs) = (&values.lanes.all, &mut self.needs);
        let need = |needs: &mut Needs, value: Value| match value {
            Value::Number(number) => needs.numbers[number] = true,
            Value::Place(place) => needs.places[place] = true,
            Value::Lanes(_) | Value::Kept(_) => {}
        };
        let mut targets = Vec::new();
        for doing in &self.built.stages {
            for (inside, action) in (doing.inside.iter().map(|(_, action)| (true, action)))
                .chain(doing.begin.iter().chain(&doing.each).chain(&doing.end).map(|action| (false, action)))
            {
                need(needs, action.value());
                if let (Value::Lanes(at), false) = (action.value(), inside) {
                    needs.lasting[at] = true;
                }
                if let Action::Store(target, _) = action {
                    targets.extend(target.terms.iter().map(|term| term.number));
                }
            }
        }
        targets.into_iter().for_each(|number| needs.numbers[number] = true);
        for at in (0..lanes.len()).rev().filter(|at| needs.lanes[*at] > 0).collect::<Vec<_>>() {
            let (work, level) = &lanes[at];
            work.each(|operand| {
                need(needs, operand);
                if let Value::Lanes(of) = operand {
                    needs.lasting[of] |= lanes[of].1 != *level;
                }
            });
            if let Work::Read(Read::Fetch(place, _)) = work {
                let place = &values.places.all[*place].0;
                place.numbers(|number| needs.numbers[number] = true);
            }
        }
        for (needed, (place, _)) in needs.places.iter().zip(&values.places.all) {
            if *needed {
                place.numbers(|number| needs.numbers[number] = true);
            }
        }
        for at in (0..needs.numbers.len()).rev() {
            if needs.numbers[at] {
                values.numbers.all[at].0.each(|number| needs.numbers[number] = true);
            }
        }
    }

    fn operand(&self, value: Value) -> Operand {
        match value {
            Value::Number(number) => Operand::Number(number),
            Value::Place(place) => Operand::Place(place),
            Value::Lanes(at) => Operand::Slot(self.slot[at]),
            Value::Kept(kept) => Operand::Slot(kept),
        }
    }

    fn take_slot(&mut self) -> usize {
        self.free.pop().unwrap_or_else(|| {
            self.slots += 1;
            self.slots - 1
        })
    }

    /// The work outside the blocks.
    fn shared(&mut self, level: usize) -> Code {
        let values = &self.built.values;
        let all = [values.numbers.all.len(), values.places.all.len(), values.lanes.all.len()];
        self.code(level, all.map(|end| 0..end))
    }

    fn code(&mut self, level: usize, [numbers, places, lanes]: [std::ops::Range<usize>; 3]) -> Code {
        let values = &self.built.values;
        let is_made = |at: &usize| {
            let (how, own) = &values.numbers.all[*at];
            self.needs.numbers[*at] && *own == level && !matches!(how, Numeric::Constant(_))
        };
        let numbers = numbers.filter(is_made).map(|at| (at, values.numbers.all[at].0.clone())).collect();
        let is_settled = |at: &usize| self.needs.places[*at] && values.places.all[*at].1 == level;
        let places = places.filter(is_settled).collect();
        let mut instructions = Vec::new();
        for at in lanes {
            let (work, own) = &self.built.values.lanes.all[at];
            if self.needs.lanes[at] > 0 && *own == level {
                let work = work.map(|value| self.operand(value));
                self.slots += 1;
                self.slot[at] = self.slots - 1;
                instructions.push(Instruction::Set(self.slot[at], work));
            }
        }
        Code { numbers, places, instructions }
    }

    fn stage(&mut self, doing: Doing, block: usize) -> Stage {
        let depth = doing.loops.len();
        let parts = || [doing.numbers.clone(), doing.places.clone(), doing.lanes.clone()];
        let mut levels: Vec<Code> = (0..depth).map(|level| self.code(block + level, parts())).collect();
        let none = doing.lanes.end..doing.lanes.end;
        let mut innermost = self.code(block + depth, [doing.numbers.clone(), doing.places.clone(), none]);
        innermost.instructions = self.innermost(&doing, block + depth);
        levels.push(innermost);
        let done = |actions: &[Action]| actions.iter().map(|action| self.done(action)).collect();
        Stage {
            begin: done(&doing.begin),
            each: done(&doing.each),
            end: done(&doing.end),
            loops: doing.loops,
            outer: doing.outer,
            levels,
        }
    }

    fn done(&self, action: &Action) -> Instruction {
        match action {
            Action::Store(target, value) => Instruction::Store(target.clone(), self.operand(*value)),
            Action::Keep(kept, value) => Instruction::Keep(*kept, self.operand(*value)),
            Action::Fold(kept, fold, value) => Instruction::Fold(*kept, *fold, self.operand(*value)),
        }
    }

    /// The instructions of the innermost level, whose slots are reused.
    fn innermost(&mut self, doing: &Doing, level: usize) -> Vec<Instruction> {
        let is_own = |layout: &Self, at: usize| {
            let (_, own) = &layout.built.values.lanes.all[at];
            layout.needs.lanes[at] > 0 && *own == level
        };
        // A value that is only stored is computed in its target.
        let mut stored = std::collections::HashMap::new();
        let mut stores = doing.inside.iter().peekable();
        for (_, action) in &doing.inside {
            if let Action::Store(target, Value::Lanes(at)) = action {
                let alone = self.needs.lanes[*at] == 1 && doing.lanes.contains(at) && is_own(self, *at);
                if let (true, Planes::Made(planes)) = (alone, target.planes) {
                    let Target { base, terms, .. } = target.clone();
                    stored.insert(*at, Target { planes, base, terms });
                }
            }
        }
        let mut rest: Vec<usize> = self.needs.lanes.clone();
        let mut instructions = Vec::new();
        self.free.clear();
        let read = |layout: &mut Self, rest: &mut Vec<usize>, value: Value| {
            if let Value::Lanes(at) = value {
                rest[at] -= 1;
                if rest[at] == 0
                    && is_own(layout, at)
                    && !layout.needs.lasting[at]
                    && doing.lanes.contains(&at)
                {
                    layout.free.push(layout.slot[at]);
                }
            }
        };
        for at in doing.lanes.start..=doing.lanes.end {
            while let Some((_, action)) = stores.next_if(|(position, _)| *position <= at) {
                if !matches!(action.value(), Value::Lanes(of) if stored.contains_key(&of)) {
                    instructions.push(self.done(action));
                    read(self, &mut rest, action.value());
                }
            }
            if at == doing.lanes.end || !is_own(self, at) {
                continue;
            }
            let source = self.built.values.lanes.all[at].0.clone();
            let work = source.map(|value| self.operand(value));
            match stored.get(&at) {
                Some(target) => instructions.push(Instruction::Write(target.clone(), work)),
                None => {
                    let slot = match self.needs.lasting[at] {
                        true => {
                            self.slots += 1;
                            self.slots - 1
                        }
                        false => self.take_slot(),
                    };
                    self.slot[at] = slot;
                    instructions.push(Instruction::Set(slot, work));
                }
            }
            source.each(|operand| read(self, &mut rest, operand));
        }
        instructions
    }
}
