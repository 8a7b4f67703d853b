//! Arithmetic on many rows at a time.
//!
//! In: operators on nodes, each of which has a number in every row. Out: a [`Tape`], and the sum of a node over some rows. Invariant:
//! what depends on no slot is computed when it is recorded, and what is the same in all rows is computed once for all of them.

mod reverse;

pub(crate) use reverse::Cells;
pub(super) use reverse::Seed;

use crate::law::Arithmetic;
use crate::operators::{Binary, Mass, OPERANDS, Unary};
use std::collections::HashMap;

/// A node of a tape: its place.
pub(super) type Node = usize;

/// The rows that are computed together.
const BLOCK: usize = 64;

/// How a node is computed.
#[derive(Clone, Debug)]
enum Step {
    Constant(f64),
    /// A known number in each row.
    Column(Vec<f64>),
    /// The value of a slot, in all rows the same.
    Slot(usize),
    /// The value of a slot in each row.
    Slots(Vec<usize>),
    Unary(Unary, Node),
    Binary(Binary, Node, Node),
    Select([Node; 3]),
    Mass(Mass, [Node; OPERANDS]),
}

/// What distinguishes nodes that are computed again.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
enum Key {
    Constant(u64),
    Slot(usize),
    Unary(Unary, Node),
    Binary(Binary, Node, Node),
    Select([Node; 3]),
}

/// A sequence of operations on rows.
#[derive(Clone, Debug)]
pub(super) struct Tape {
    rows: usize,
    steps: Vec<Step>,
    /// Whether a node may differ from row to row.
    varies: Vec<bool>,
    /// Whether a node depends on a slot with a slope that is not zero everywhere; known once the tape is finished.
    moves: Vec<bool>,
    known: HashMap<Key, Node>,
}

impl Tape {
    pub(super) fn new(rows: usize) -> Self {
        Self { rows, steps: Vec::new(), varies: Vec::new(), moves: Vec::new(), known: HashMap::new() }
    }

    fn push(&mut self, step: Step, varies: bool) -> Node {
        self.steps.push(step);
        self.varies.push(varies);
        self.steps.len() - 1
    }

    fn shared(&mut self, key: Key, step: Step, varies: bool) -> Node {
        if let Some(node) = self.known.get(&key) {
            return *node;
        }
        let node = self.push(step, varies);
        self.known.insert(key, node);
        node
    }

    /// Known numbers, one for each row.
    pub(super) fn column(&mut self, numbers: Vec<f64>) -> Node {
        match numbers.first().copied() {
            Some(first) if numbers.iter().all(|number| number.to_bits() == first.to_bits()) => {
                self.constant(first)
            }
            _ => self.push(Step::Column(numbers), true),
        }
    }

    /// The values of slots, one for each row.
    pub(super) fn slots(&mut self, slots: Vec<usize>) -> Node {
        match slots.first().copied() {
            Some(first) if slots.iter().all(|slot| *slot == first) => {
                self.shared(Key::Slot(first), Step::Slot(first), false)
            }
            _ => self.push(Step::Slots(slots), true),
        }
    }

    /// The number of a node in a row, if it depends on no slot.
    pub(super) fn number(&self, node: Node, row: usize) -> Option<f64> {
        match &self.steps[node] {
            Step::Constant(number) => Some(*number),
            Step::Column(numbers) => Some(numbers[row]),
            _ => None,
        }
    }

    /// The node of a function of others, computed now if these are known.
    fn function(
        &mut self,
        key: Option<Key>,
        step: Step,
        operands: &[Node],
        f: impl Fn(&[f64]) -> f64,
    ) -> Node {
        let at =
            |row: usize| operands.iter().map(|node| self.number(*node, row)).collect::<Option<Vec<f64>>>();
        let varies = operands.iter().any(|node| self.varies[*node]);
        if at(0).is_some() {
            let rows = if varies { self.rows } else { 1 };
            let numbers = (0..rows).filter_map(at).map(|numbers| f(&numbers)).collect();
            return self.column(numbers);
        }
        match key {
            Some(key) => self.shared(key, step, varies),
            None => self.push(step, varies),
        }
    }

    /// Forgets what is needed only to record, and all nodes that the `wanted` ones do not need; returns their new places.
    pub(super) fn finish(&mut self, wanted: &[Node]) -> Vec<Node> {
        let mut is_needed = vec![false; self.steps.len()];
        wanted.iter().for_each(|node| is_needed[*node] = true);
        for node in (0..self.steps.len()).rev() {
            if is_needed[node] {
                self.steps[node].each_operand(|operand| is_needed[operand] = true);
            }
        }
        let mut places = vec![usize::MAX; self.steps.len()];
        let (mut steps, mut varies) = (Vec::new(), Vec::new());
        for (node, mut step) in std::mem::take(&mut self.steps).into_iter().enumerate() {
            if is_needed[node] {
                step.rename(&places);
                places[node] = steps.len();
                steps.push(step);
                varies.push(self.varies[node]);
            }
        }
        (self.steps, self.varies, self.known) = (steps, varies, HashMap::new());
        self.find_moves();
        wanted.iter().map(|node| places[*node]).collect()
    }

    /// The sum of a node over some rows, and whether another is true in all of them, at these values of slots.
    pub(super) fn sum(
        &self,
        [summed, holds]: [Node; 2],
        rows: &[u32],
        values: &[f64],
        cells: &mut Vec<f64>,
    ) -> (f64, bool) {
        let length = self.steps.len() * BLOCK;
        if cells.len() < length {
            cells.resize(length, 0.0);
        }
        let width = rows.len().min(BLOCK);
        for node in (0..self.steps.len()).filter(|node| !self.varies[*node]) {
            self.compute(node, &rows[..width.min(1)], values, cells);
            let number = cells[node * BLOCK];
            cells[node * BLOCK..node * BLOCK + width].fill(number);
        }
        let (mut sum, mut all) = (0.0, true);
        for rows in rows.chunks(BLOCK) {
            for node in (0..self.steps.len()).filter(|node| self.varies[*node]) {
                self.compute(node, rows, values, cells);
            }
            sum += cells[summed * BLOCK..][..rows.len()].iter().sum::<f64>();
            all &= cells[holds * BLOCK..][..rows.len()].iter().all(|holds| *holds != 0.0);
        }
        (sum, all)
    }

    /// The numbers of a node in some rows, at these values of slots.
    pub(super) fn numbers(
        &self,
        wanted: Node,
        rows: &[u32],
        values: &[f64],
        cells: &mut Vec<f64>,
        found: &mut Vec<f64>,
    ) {
        found.clear();
        cells.resize(cells.len().max(self.steps.len() * BLOCK), 0.0);
        for rows in rows.chunks(BLOCK) {
            (0..self.steps.len()).for_each(|node| self.compute(node, rows, values, cells));
            found.extend(&cells[wanted * BLOCK..][..rows.len()]);
        }
    }

    /// Computes a node in at most [`BLOCK`] rows.
    fn compute(&self, node: Node, rows: &[u32], values: &[f64], cells: &mut [f64]) {
        let (before, own) = cells.split_at_mut(node * BLOCK);
        let own = &mut own[..rows.len()];
        let of = |operand: Node| &before[operand * BLOCK..][..rows.len()];
        match &self.steps[node] {
            Step::Constant(number) => own.fill(*number),
            Step::Column(numbers) => {
                own.iter_mut().zip(rows).for_each(|(own, row)| *own = numbers[*row as usize]);
            }
            Step::Slot(slot) => own.fill(values[*slot]),
            Step::Slots(slots) => {
                own.iter_mut().zip(rows).for_each(|(own, row)| *own = values[slots[*row as usize]]);
            }
            Step::Unary(operator, operand) => unary(*operator, own, of(*operand)),
            Step::Binary(operator, left, right) => binary(*operator, own, of(*left), of(*right)),
            Step::Select([condition, then, otherwise]) => {
                let (condition, then, otherwise) = (of(*condition), of(*then), of(*otherwise));
                for (row, own) in own.iter_mut().enumerate() {
                    *own = if condition[row] != 0.0 { then[row] } else { otherwise[row] };
                }
            }
            Step::Mass(law, operands) => {
                for (row, own) in own.iter_mut().enumerate() {
                    *own = law.apply(operands.map(|operand| before[operand * BLOCK + row]));
                }
            }
        }
    }
}

/// An operator on each row. The usual ones are loops of their own.
fn unary(operator: Unary, own: &mut [f64], of: &[f64]) {
    match operator {
        Unary::Negate => own.iter_mut().zip(of).for_each(|(own, x)| *own = -x),
        Unary::Exponential => own.iter_mut().zip(of).for_each(|(own, x)| *own = x.exp()),
        Unary::NaturalLogarithm => own.iter_mut().zip(of).for_each(|(own, x)| *own = x.ln()),
        other => own.iter_mut().zip(of).for_each(|(own, x)| *own = other.apply(*x)),
    }
}

/// As [`unary`], of two operands.
fn binary(operator: Binary, own: &mut [f64], left: &[f64], right: &[f64]) {
    let both = left.iter().zip(right);
    match operator {
        Binary::Add => own.iter_mut().zip(both).for_each(|(own, (x, y))| *own = x + y),
        Binary::Subtract => own.iter_mut().zip(both).for_each(|(own, (x, y))| *own = x - y),
        Binary::Multiply => own.iter_mut().zip(both).for_each(|(own, (x, y))| *own = x * y),
        Binary::Divide => own.iter_mut().zip(both).for_each(|(own, (x, y))| *own = x / y),
        other => own.iter_mut().zip(both).for_each(|(own, (x, y))| *own = other.apply(*x, *y)),
    }
}

impl Step {
    fn each_operand(&self, mut visit: impl FnMut(Node)) {
        match self {
            Step::Unary(_, operand) => visit(*operand),
            Step::Binary(_, left, right) => [*left, *right].into_iter().for_each(visit),
            Step::Select(operands) => operands.iter().copied().for_each(visit),
            Step::Mass(_, operands) => operands.iter().copied().for_each(visit),
            Step::Constant(_) | Step::Column(_) | Step::Slot(_) | Step::Slots(_) => {}
        }
    }

    fn rename(&mut self, places: &[Node]) {
        match self {
            Step::Unary(_, operand) => *operand = places[*operand],
            Step::Binary(_, left, right) => (*left, *right) = (places[*left], places[*right]),
            Step::Select(operands) => operands.iter_mut().for_each(|operand| *operand = places[*operand]),
            Step::Mass(_, operands) => operands.iter_mut().for_each(|operand| *operand = places[*operand]),
            Step::Constant(_) | Step::Column(_) | Step::Slot(_) | Step::Slots(_) => {}
        }
    }
}

impl Arithmetic for Tape {
    type Number = Node;

    fn constant(&mut self, number: f64) -> Node {
        self.shared(Key::Constant(number.to_bits()), Step::Constant(number), false)
    }

    fn known(&self, x: Node) -> Option<f64> {
        match &self.steps[x] {
            Step::Constant(number) => Some(*number),
            _ => None,
        }
    }

    fn unary(&mut self, operator: Unary, x: Node) -> Node {
        let key = Some(Key::Unary(operator, x));
        self.function(key, Step::Unary(operator, x), &[x], |numbers| operator.apply(numbers[0]))
    }

    fn binary(&mut self, operator: Binary, x: Node, y: Node) -> Node {
        let key = Some(Key::Binary(operator, x, y));
        let apply = |numbers: &[f64]| operator.apply(numbers[0], numbers[1]);
        self.function(key, Step::Binary(operator, x, y), &[x, y], apply)
    }

    fn select(&mut self, condition: Node, then: Node, otherwise: Node) -> Node {
        if let Some(known) = self.known(condition) {
            return if known != 0.0 { then } else { otherwise };
        }
        let all = [condition, then, otherwise];
        let choose = |numbers: &[f64]| if numbers[0] != 0.0 { numbers[1] } else { numbers[2] };
        self.function(Some(Key::Select(all)), Step::Select(all), &all, choose)
    }

    fn mass(&mut self, law: Mass, operands: [Node; OPERANDS]) -> Node {
        let apply =
            |numbers: &[f64]| law.apply(numbers.try_into().expect("internal: a mass has its operands"));
        self.function(None, Step::Mass(law, operands), &operands, apply)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x + 2 c over rows with c = 1, 2, 3, where x is slot 0: at x = 10 the rows 0 and 2 have the sum 12 + 16.
    #[test]
    fn only_the_named_rows_are_summed() {
        let mut tape = Tape::new(3);
        let (x, c, two) = (tape.slots(vec![0; 3]), tape.column(vec![1.0, 2.0, 3.0]), tape.constant(2.0));
        let twice = tape.multiply(two, c);
        assert_eq!(tape.number(twice, 1), Some(4.0));
        let (sum, positive) = (tape.add(x, twice), tape.greater(x, c));
        let wanted = tape.finish(&[sum, positive]);
        let mut cells = Vec::new();
        assert_eq!(tape.sum([wanted[0], wanted[1]], &[0, 2], &[10.0], &mut cells), (28.0, true));
        // At x = 2 the last row has x ≤ c.
        assert_eq!(tape.sum([wanted[0], wanted[1]], &[0, 2], &[2.0], &mut cells), (12.0, false));
    }

    /// More rows than one block, of which each reads its own slot.
    #[test]
    fn rows_read_their_own_slots() {
        let mut tape = Tape::new(200);
        let own = tape.slots((0..200).collect());
        let (square, one) = (tape.multiply(own, own), tape.constant(1.0));
        let wanted = tape.finish(&[square, one]);
        let (rows, values): (Vec<u32>, Vec<f64>) = ((0..200).collect(), (0..200).map(f64::from).collect());
        // Σ n² of n below 200.
        assert_eq!(tape.sum([wanted[0], wanted[1]], &rows, &values, &mut Vec::new()), (2_646_700.0, true));
    }
}
