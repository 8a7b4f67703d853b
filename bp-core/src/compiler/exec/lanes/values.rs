//! Values of instructions: equal ones are merged, and constants are evaluated.
//!
//! In: operators and operands. Out: a [`Value`]. Invariant: a value comes after its operands, on the outermost level on
//! which all of them are known.

use super::code::{Along, Computed, Numeric, Place, Read, Source, Work};
use crate::ids::BufferId;
use crate::operators::{Binary, Mass, OPERANDS, Unary};
use std::collections::{BTreeSet, HashMap};
use std::hash::Hash;

/// A value under construction, by its position among its kind.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(super) enum Value {
    Number(usize),
    Place(usize),
    Lanes(usize),
    /// The state of a reduction.
    Kept(usize),
}

/// Distinct items in order of insertion, each on its level.
#[derive(Debug)]
pub(super) struct Distinct<K> {
    pub(super) all: Vec<(K, usize)>,
    known: HashMap<K, usize>,
}

impl<K> Default for Distinct<K> {
    fn default() -> Self {
        Self { all: Vec::new(), known: HashMap::new() }
    }
}

impl<K: Clone + Eq + Hash> Distinct<K> {
    pub(super) fn add(&mut self, key: K, level: impl FnOnce(&K) -> usize) -> usize {
        if let Some(known) = self.known.get(&key) {
            return *known;
        }
        let level = level(&key);
        self.known.insert(key.clone(), self.all.len());
        self.all.push((key, level));
        self.all.len() - 1
    }

    fn level(&self, position: usize) -> usize {
        self.all[position].1
    }
}

/// All values of a pass.
#[derive(Debug, Default)]
pub(super) struct Values {
    pub(super) numbers: Distinct<Numeric>,
    pub(super) places: Distinct<Place>,
    pub(super) lanes: Distinct<Work<Value>>,
    pub(super) patterns: Distinct<Vec<u32>>,
    /// The level of each axis that counts.
    pub(super) level_of: Vec<usize>,
    /// The level of values that differ among blocks.
    pub(super) lane_level: usize,
    /// The level on which a state changes.
    pub(super) innermost: usize,
}

impl Values {
    /// Removes the values of a stage's blocks: the next one computes them again.
    pub(super) fn next_stage(&mut self, block: usize) {
        let Self { numbers, places, lanes, .. } = self;
        numbers.known.retain(|_, at| numbers.all[*at].1 < block);
        places.known.retain(|_, at| places.all[*at].1 < block);
        lanes.known.retain(|_, at| lanes.all[*at].1 < block);
    }

    pub(super) fn level(&self, value: Value) -> usize {
        match value {
            Value::Number(number) => self.numbers.level(number),
            Value::Place(place) => self.places.level(place),
            Value::Lanes(lanes) => self.lanes.level(lanes),
            Value::Kept(_) => self.innermost,
        }
    }

    /// The buffers that are read, of those that are whole in memory.
    pub(super) fn reads(&self) -> BTreeSet<BufferId> {
        let numbers = self.numbers.all.iter().filter_map(|(how, _)| match how {
            Numeric::Load(address, _) => Some(Source::Whole(address.source)),
            _ => None,
        });
        let places = self.places.all.iter().map(|(place, _)| place.address.source);
        let gathers = self.lanes.all.iter().filter_map(|(work, _)| match work {
            Work::Read(Read::Gather(source, ..)) => Some(*source),
            _ => None,
        });
        let whole = |source| match source {
            Source::Whole(buffer) => Some(buffer),
            Source::Block(_) => None,
        };
        numbers.chain(places).chain(gathers).filter_map(whole).collect()
    }

    pub(super) fn constant(&mut self, number: f64) -> Value {
        Value::Number(self.numbers.add(Numeric::Constant(number.to_bits()), |_| 0))
    }

    pub(super) fn known(&self, value: Value) -> Option<f64> {
        match value {
            Value::Number(number) => match self.numbers.all[number].0 {
                Numeric::Constant(bits) => Some(f64::from_bits(bits)),
                _ => None,
            },
            _ => None,
        }
    }

    pub(super) fn number(&mut self, how: Numeric) -> Value {
        Value::Number(self.number_of(how))
    }

    /// The place of a number among all.
    pub(super) fn number_of(&mut self, how: Numeric) -> usize {
        let level = match &how {
            Numeric::Constant(_) => 0,
            Numeric::Counter(axis) => self.level_of[*axis],
            Numeric::Unary(_, a) | Numeric::Stored(a) => self.numbers.level(*a),
            Numeric::Binary(_, a, b) => self.numbers.level(*a).max(self.numbers.level(*b)),
            Numeric::Select(a, b, c) => {
                [a, b, c].map(|of| self.numbers.level(*of)).into_iter().max().unwrap_or(0)
            }
            Numeric::Mass(_, operands) => {
                operands.iter().map(|of| self.numbers.level(*of)).max().unwrap_or(0)
            }
            Numeric::Load(address, other) => {
                let terms = address.terms.iter().map(|term| term.number).chain(*other);
                terms.map(|number| self.numbers.level(number)).max().unwrap_or(0)
            }
        };
        self.numbers.add(how, |_| level)
    }

    pub(super) fn place(&mut self, place: Place) -> usize {
        let turned = match &place.along {
            Along::Turned { by, wraps, .. } => vec![*by, *wraps],
            _ => Vec::new(),
        };
        let terms = place.address.terms.iter().map(|term| term.number);
        let mut level = (terms.chain(turned).chain(place.otherwise))
            .fold(self.lane_level, |level, number| level.max(self.numbers.level(number)));
        if matches!(place.address.source, Source::Block(_)) {
            // A block's arrays are computed within it.
            level = self.innermost;
        }
        self.places.add(place, |_| level)
    }

    fn computed(&mut self, computed: Computed<Value>) -> Value {
        self.lanes(Work::Computed(computed))
    }

    pub(super) fn read(&mut self, read: Read<Value>) -> Value {
        self.lanes(Work::Read(read))
    }

    fn lanes(&mut self, work: Work<Value>) -> Value {
        let mut level = self.lane_level;
        work.each(|operand| level = level.max(self.level(operand)));
        match &work {
            Work::Read(Read::Fetch(place, _)) => level = level.max(self.places.level(*place)),
            Work::Read(Read::Gather(Source::Block(_), ..)) => level = self.innermost,
            _ => {}
        }
        Value::Lanes(self.lanes.add(work, |_| level))
    }

    pub(super) fn unary(&mut self, operator: Unary, a: Value) -> Value {
        match (a, self.known(a).and_then(|x| operator.folded(x))) {
            (_, Some(value)) => self.constant(value),
            (Value::Number(a), _) => self.number(Numeric::Unary(operator, a)),
            _ => self.computed(Computed::Unary(operator, a)),
        }
    }

    pub(super) fn binary(&mut self, operator: Binary, a: Value, b: Value) -> Value {
        let (x, y) = (self.known(a), self.known(b));
        if let Some(value) = x.zip(y).and_then(|(x, y)| operator.folded(x, y)) {
            return self.constant(value);
        }
        match (operator, x, y) {
            (Binary::Add, Some(0.0), _) | (Binary::Multiply, Some(1.0), _) => return b,
            (Binary::Add | Binary::Subtract, _, Some(0.0))
            | (Binary::Multiply | Binary::Divide, _, Some(1.0)) => return a,
            (Binary::And, Some(0.0), _) | (Binary::And, _, Some(0.0)) => return self.constant(0.0),
            _ => {}
        }
        match (a, b) {
            (Value::Number(a), Value::Number(b)) => self.number(Numeric::Binary(operator, a, b)),
            // The uniform operand comes second, if the order does not matter.
            (Value::Number(_), _) if matches!(operator, Binary::Add | Binary::Multiply) => {
                self.computed(Computed::Binary(operator, b, a))
            }
            _ => self.computed(Computed::Binary(operator, a, b)),
        }
    }

    pub(super) fn select(&mut self, condition: Value, then: Value, otherwise: Value) -> Value {
        match (condition, then, otherwise) {
            _ if then == otherwise => then,
            (known, ..) if self.known(known).is_some() => {
                if self.known(known) == Some(0.0) {
                    otherwise
                } else {
                    then
                }
            }
            (Value::Number(a), Value::Number(b), Value::Number(c)) => self.number(Numeric::Select(a, b, c)),
            _ => self.computed(Computed::Select(condition, then, otherwise)),
        }
    }

    pub(super) fn mass(&mut self, law: Mass, operands: [Value; OPERANDS]) -> Value {
        let numbers = operands.map(|operand| match operand {
            Value::Number(number) => Some(number),
            _ => None,
        });
        match numbers.iter().all(Option::is_some) {
            true => self.number(Numeric::Mass(law, numbers.map(Option::unwrap_or_default))),
            false => self.computed(Computed::Mass(law, operands)),
        }
    }
}
