//! Execution of a pass by one thread: rows, blocks of lanes, instructions.
//!
//! In: a [`Pass`], its inputs, a [`Piece`] of its results. Out: that piece. Invariant: a lane's arithmetic does not
//! depend on its block, so that pieces may be cut anywhere.

use super::arithmetic;
use super::code::{Code, Instruction, Numeric, Operand, Pass, Planes, Stage, Term, Work};
use super::reads::{Arrays, Found, Slot};
use crate::exec::scalar::{Number, Scalar};
use crate::radix;
use pulp::{Arch, NullaryFnOnce};

/// Consecutive rows (or lanes, if there is one row), and their part of each result plane.
pub(super) struct Piece<'p, T> {
    pub(super) first: usize,
    pub(super) count: usize,
    /// Whether it has all of them: then the planes of a buffer are one part.
    pub(super) whole: bool,
    pub(super) parts: Vec<Vec<&'p mut [T]>>,
}

impl<T> Piece<'_, T> {
    /// A part of a plane.
    #[inline(always)]
    fn plane(&mut self, pass: &Pass, part: usize, plane: usize, offset: usize, width: usize) -> &mut [T] {
        let planes = &mut self.parts[part];
        match self.whole {
            true => &mut planes[0][plane * pass.plane() + offset..][..width],
            false => &mut planes[plane][offset..][..width],
        }
    }
}

/// Some instructions, compiled for each instruction set.
struct Walk<'w, 'a, 'p, T: Scalar> {
    machine: &'w mut Machine<T>,
    pass: &'w Pass,
    arrays: &'w Arrays<'a, T>,
    instructions: &'w [Instruction],
    piece: &'w mut Piece<'p, T>,
}

impl<T: Scalar> NullaryFnOnce for Walk<'_, '_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for instruction in self.instructions {
            self.machine.instruction(self.pass, self.arrays, instruction, self.piece);
        }
    }
}

/// The memory of one thread.
#[derive(Debug)]
pub(super) struct Machine<T: Scalar> {
    pub(super) numbers: Vec<T::Number>,
    pub(super) narrow: Vec<T>,
    pub(super) counters: Vec<usize>,
    pub(super) slots: Vec<Slot<T>>,
    pub(super) found: Vec<Found>,
    pub(super) copies: Vec<Slot<T>>,
    pub(super) blocks: Vec<Vec<T>>,
    pub(super) start: usize,
    pub(super) width: usize,
    /// The start of the block in a plane of this piece.
    pub(super) offset: usize,
    pub(super) set_of_instructions: Arch,
}

impl<T: Scalar> Machine<T> {
    pub(super) fn new(pass: &Pass, axes: usize) -> Self {
        let mut machine = Self {
            numbers: vec![T::Number::default(); pass.numbers],
            narrow: vec![T::ZERO; pass.numbers],
            counters: vec![0; axes],
            slots: (0..pass.slots).map(|_| Slot::new(pass.block)).collect(),
            found: vec![Found::Copied; pass.places.len()],
            copies: vec![Slot::default(); pass.places.len()],
            blocks: pass.of_block.iter().map(|planes| vec![T::ZERO; planes * pass.block]).collect(),
            start: 0,
            width: 0,
            offset: 0,
            set_of_instructions: Arch::new(),
        };
        pass.constants.iter().for_each(|(number, value)| machine.set(*number, T::Number::known(*value)));
        machine
    }

    /// Computes a piece.
    pub(super) fn piece(&mut self, pass: &Pass, arrays: &Arrays<'_, T>, piece: &mut Piece<'_, T>) {
        let by_rows = pass.has_rows();
        let (rows, lanes) = match by_rows {
            true => (piece.first..piece.first + piece.count, 0..pass.lanes),
            false => (0..1, piece.first..piece.first + piece.count),
        };
        // Work done once reads whole blocks, if the lanes are one block.
        (self.start, self.width) = (lanes.start, pass.block.min(lanes.len()));
        for once in pass.levels.iter().take(1) {
            self.code(pass, arrays, once, piece);
        }
        for row in rows.clone() {
            let changed = self.turn(pass, row, row == rows.start);
            for level in pass.levels.iter().skip(1 + changed) {
                self.code(pass, arrays, level, piece);
            }
            for start in lanes.clone().step_by(pass.block) {
                (self.start, self.width) = (start, pass.block.min(lanes.end - start));
                self.offset = match (by_rows, pass.folded) {
                    (true, true) => row - piece.first,
                    (true, false) => (row - piece.first) * pass.lanes + start,
                    (false, _) => start - piece.first,
                };
                for stage in &pass.stages {
                    self.stage(pass, stage, 0, arrays, piece);
                }
            }
        }
    }

    /// Sets the counters of a row; returns the first axis of the rows that has changed.
    fn turn(&mut self, pass: &Pass, row: usize, first: bool) -> usize {
        let mut changed = pass.rows.len();
        let values = radix::ordinals(row, pass.rows.iter().rev().map(|(_, extent)| *extent));
        for ((number, (axis, _)), value) in pass.rows.iter().enumerate().rev().zip(values) {
            if first || self.counters[*axis] != value {
                changed = number;
            }
            self.counters[*axis] = value;
        }
        changed
    }

    fn stage(
        &mut self,
        pass: &Pass,
        stage: &Stage,
        depth: usize,
        arrays: &Arrays<'_, T>,
        piece: &mut Piece<'_, T>,
    ) {
        self.code(pass, arrays, &stage.levels[depth], piece);
        if depth == stage.outer {
            self.instructions(pass, arrays, &stage.begin, piece);
        }
        match stage.loops.get(depth) {
            None => self.instructions(pass, arrays, &stage.each, piece),
            Some(around) => {
                for step in 0..around.extent {
                    self.counters[around.axis] =
                        if around.backward { around.extent - 1 - step } else { step };
                    self.stage(pass, stage, depth + 1, arrays, piece);
                }
            }
        }
        if depth == stage.outer {
            self.instructions(pass, arrays, &stage.end, piece);
        }
    }

    fn code(&mut self, pass: &Pass, arrays: &Arrays<'_, T>, code: &Code, piece: &mut Piece<'_, T>) {
        for (number, how) in &code.numbers {
            let value = self.number(arrays, how);
            self.set(*number, value);
        }
        for place in &code.places {
            self.found[*place] = self.settle(pass, arrays, *place);
        }
        self.instructions(pass, arrays, &code.instructions, piece);
    }

    fn set(&mut self, number: usize, value: T::Number) {
        self.numbers[number] = value;
        self.narrow[number] = T::from_number(value);
    }

    fn number(&self, arrays: &Arrays<'_, T>, how: &Numeric) -> T::Number {
        let number = |number: &usize| self.numbers[*number];
        match how {
            Numeric::Constant(bits) => T::Number::known(f64::from_bits(*bits)),
            Numeric::Counter(axis) => T::Number::known(self.counters[*axis] as f64),
            Numeric::Unary(operator, a) => T::Number::unary(*operator, number(a)),
            Numeric::Binary(operator, a, b) => T::Number::binary(*operator, number(a), number(b)),
            Numeric::Select(a, b, c) => number(if number(a).is_zero() { c } else { b }),
            Numeric::Mass(law, operands) => T::Number::mass(*law, operands.map(|operand| number(&operand))),
            Numeric::Stored(a) => self.narrow[*a].to_number(),
            Numeric::Load(address, otherwise) => match self.find(&address.terms, address.base) {
                Some(at) => arrays.cell(address.source, at),
                None => otherwise.as_ref().map_or_else(T::Number::default, number),
            },
        }
    }

    fn instructions(
        &mut self,
        pass: &Pass,
        arrays: &Arrays<'_, T>,
        instructions: &[Instruction],
        piece: &mut Piece<'_, T>,
    ) {
        if !instructions.is_empty() {
            self.set_of_instructions.dispatch(Walk { machine: self, pass, arrays, instructions, piece });
        }
    }

    #[inline(always)]
    fn instruction(
        &mut self,
        pass: &Pass,
        arrays: &Arrays<'_, T>,
        instruction: &Instruction,
        piece: &mut Piece<'_, T>,
    ) {
        match instruction {
            Instruction::Set(slot, work) => {
                // No instruction reads its own result, so that its lanes can be taken out.
                let mut out = std::mem::take(&mut self.slots[*slot]);
                self.work(pass, arrays, work, out.lanes_mut(self.width));
                self.slots[*slot] = out;
            }
            Instruction::Write(target, work) => {
                let plane = self.plane(&target.terms, target.base);
                let out = piece.plane(pass, target.planes, plane, self.offset, self.width);
                self.work(pass, arrays, work, out);
            }
            Instruction::Store(target, operand) => {
                let plane = self.plane(&target.terms, target.base);
                let width = if pass.folded { 1 } else { self.width };
                match target.planes {
                    Planes::Made(part) => {
                        let out = piece.plane(pass, part, plane, self.offset, width);
                        self.lanes(pass, arrays, operand).copy(0, out);
                    }
                    Planes::Block(number) => {
                        let mut block = std::mem::take(&mut self.blocks[number]);
                        let out = &mut block[plane * pass.block..][..width];
                        self.lanes(pass, arrays, operand).copy(0, out);
                        self.blocks[number] = block;
                    }
                }
            }
            Instruction::Keep(slot, operand) => {
                let mut out = std::mem::take(&mut self.slots[*slot]);
                self.lanes(pass, arrays, operand).copy(0, out.lanes_mut(self.width));
                self.slots[*slot] = out;
            }
            Instruction::Fold(slot, fold, operand) => {
                let folded = self.slots[*slot].lanes(1)[0];
                let lanes = self.lanes(pass, arrays, operand);
                self.slots[*slot].lanes_mut(1)[0] = arithmetic::folded(*fold, folded, lanes, self.width);
            }
        }
    }

    fn plane(&self, terms: &[Term], base: usize) -> usize {
        self.find(terms, base).expect("internal: a made cell is inside")
    }

    #[inline(always)]
    fn work(&self, pass: &Pass, arrays: &Arrays<'_, T>, work: &Work<Operand>, out: &mut [T]) {
        match work {
            Work::Read(read) => self.read(pass, arrays, read, out),
            Work::Computed(computed) => {
                arithmetic::run(out, computed, |operand| self.lanes(pass, arrays, operand));
            }
        }
    }
}
