//! Reads of a pass: numbers, lanes in place, copied lanes, and single lanes.
//!
//! In: addresses, places, indices. Out: numbers and lanes; values out of range. Invariant: a place is a view of an
//! array if its lanes are contiguous.

use super::arithmetic::Lane;
use super::code::{Address, Along, Operand, Pass, Place, Read, Source, Term};
use super::machine::Machine;
use crate::exec::scalar::{Number, Scalar};
use crate::ids::{BufferId, Id};

/// The arrays that a pass may read, by buffer; not its own results.
pub(super) struct Arrays<'a, T> {
    pub(super) numbers: Vec<&'a [T]>,
    pub(super) positions: Vec<&'a [i32]>,
}

impl<T: Scalar> Arrays<'_, T> {
    pub(super) fn cell(&self, buffer: BufferId, at: usize) -> T::Number {
        let positions = self.positions[buffer.position()];
        match positions.is_empty() {
            true => self.numbers[buffer.position()][at].to_number(),
            false => T::Number::known(f64::from(positions[at])),
        }
    }
}

/// The location of the lanes of a place.
#[derive(Clone, Copy, Debug)]
pub(super) enum Found {
    There(usize),
    Copied,
}

/// Lanes aligned to a cache line: instructions of 64 bytes then read one line, not two.
#[derive(Clone, Debug, Default)]
pub(super) struct Slot<T> {
    cells: Vec<T>,
    first: usize,
}

impl<T: Scalar> Slot<T> {
    pub(super) fn new(lanes: usize) -> Self {
        let line = 64 / size_of::<T>();
        let cells = vec![T::ZERO; lanes + line];
        let first = cells.as_ptr().align_offset(64).min(line);
        Self { cells, first }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    #[inline(always)]
    pub(super) fn lanes(&self, width: usize) -> &[T] {
        &self.cells[self.first..][..width]
    }

    #[inline(always)]
    pub(super) fn lanes_mut(&mut self, width: usize) -> &mut [T] {
        &mut self.cells[self.first..][..width]
    }
}

impl<T: Scalar> Machine<T> {
    /// The base and the terms; `None` out of range.
    pub(super) fn find(&self, terms: &[Term], base: usize) -> Option<usize> {
        terms.iter().try_fold(base, |at, term| {
            let index = self.numbers[term.number].rounded() as i64;
            (0..term.extent as i64).contains(&index).then(|| at + index as usize * term.stride)
        })
    }

    /// All numbers of a source.
    #[inline(always)]
    fn source<'s>(&'s self, arrays: &'s Arrays<'_, T>, source: Source) -> &'s [T] {
        match source {
            Source::Whole(buffer) => arrays.numbers[buffer.position()],
            Source::Block(number) => &self.blocks[number],
        }
    }

    /// The start of a place in its source, for this block.
    fn begin(&self, pass: &Pass, address: &Address<Source>) -> Option<usize> {
        let at = self.find(&address.terms, address.base)?;
        Some(match address.source {
            Source::Whole(_) => at,
            Source::Block(_) => at * pass.block,
        })
    }

    pub(super) fn settle(&mut self, pass: &Pass, arrays: &Arrays<'_, T>, number: usize) -> Found {
        let place = &pass.places[number];
        if let Some(at) = self.begin(pass, &place.address) {
            match &place.along {
                Along::Straight if matches!(place.address.source, Source::Block(_)) => {
                    return Found::There(at);
                }
                Along::Straight => return Found::There(at + self.start),
                Along::Turned { by, wraps, extent } => {
                    let from = self.turned(*by, *wraps, *extent);
                    if from >= 0 && from as usize + self.width <= *extent {
                        return Found::There(at + from as usize);
                    }
                }
                Along::Pattern(_) => {}
            }
        }
        let mut copy = std::mem::take(&mut self.copies[number]);
        if copy.is_empty() {
            copy = Slot::new(pass.block);
        }
        let otherwise = place.otherwise.map_or(Lane::One(T::ZERO), |other| Lane::One(self.narrow[other]));
        self.fetch(pass, arrays, place, otherwise, copy.lanes_mut(self.width));
        self.copies[number] = copy;
        Found::Copied
    }

    fn turned(&self, by: usize, wraps: usize, extent: usize) -> i64 {
        let from = self.start as i64 + self.numbers[by].rounded() as i64;
        if self.numbers[wraps].is_zero() { from } else { from.rem_euclid(extent as i64) }
    }

    /// Copies a place, range by range; the other lanes if it is out of range.
    fn fetch(&self, pass: &Pass, arrays: &Arrays<'_, T>, place: &Place, other: Lane<'_, T>, out: &mut [T]) {
        let source = self.source(arrays, place.address.source);
        let Some(at) = self.begin(pass, &place.address) else { return other.copy(0, out) };
        match &place.along {
            Along::Straight => {
                let start = if matches!(place.address.source, Source::Block(_)) { 0 } else { self.start };
                out.copy_from_slice(&source[at + start..][..out.len()]);
            }
            Along::Pattern(pattern) => {
                let pattern = &pass.patterns[*pattern][self.start..];
                for (out, offset) in out.iter_mut().zip(pattern) {
                    *out = source[at + *offset as usize];
                }
            }
            Along::Turned { by, wraps, extent } => {
                let row = &source[at..at + extent];
                let (mut from, mut lane) = (self.turned(*by, *wraps, *extent), 0);
                while lane < out.len() {
                    let rest = out.len() - lane;
                    let inside = (0..*extent as i64).contains(&from);
                    let until = if inside {
                        *extent as i64
                    } else if from < 0 {
                        0
                    } else {
                        i64::MAX
                    };
                    let count = rest.min((until - from) as usize);
                    let stretch = &mut out[lane..lane + count];
                    match inside {
                        true => stretch.copy_from_slice(&row[from as usize..][..count]),
                        false => other.copy(lane, stretch),
                    }
                    (from, lane) = (from + count as i64, lane + count);
                    if !self.numbers[*wraps].is_zero() {
                        from = from.rem_euclid(*extent as i64);
                    }
                }
            }
        }
    }

    #[inline(always)]
    pub(super) fn lanes<'s>(
        &'s self,
        pass: &Pass,
        arrays: &'s Arrays<'_, T>,
        operand: &Operand,
    ) -> Lane<'s, T> {
        match *operand {
            Operand::Number(number) => Lane::One(self.narrow[number]),
            Operand::Slot(slot) => Lane::Many(self.slots[slot].lanes(self.width)),
            Operand::Place(place) => Lane::Many(match self.found[place] {
                Found::There(at) => {
                    &self.source(arrays, pass.places[place].address.source)[at..][..self.width]
                }
                Found::Copied => self.copies[place].lanes(self.width),
            }),
        }
    }

    /// Lanes that are read, rather than computed.
    #[inline(never)]
    pub(super) fn read(&self, pass: &Pass, arrays: &Arrays<'_, T>, read: &Read<Operand>, out: &mut [T]) {
        let lanes = |operand: &Operand| self.lanes(pass, arrays, operand);
        match read {
            Read::Pattern(pattern) => {
                for (out, index) in out.iter_mut().zip(&pass.patterns[*pattern][self.start..]) {
                    *out = T::from_f64(f64::from(*index));
                }
            }
            Read::Fetch(place, otherwise) => {
                let other = otherwise.as_ref().map_or(Lane::One(T::ZERO), lanes);
                self.fetch(pass, arrays, &pass.places[*place], other, out);
            }
            Read::Gather(source, terms, otherwise) => {
                let other = otherwise.as_ref().map_or(Lane::One(T::ZERO), lanes);
                let terms: Vec<(Lane<'_, T>, usize, usize)> =
                    terms.iter().map(|(index, stride, extent)| (lanes(index), *stride, *extent)).collect();
                for (lane, out) in out.iter_mut().enumerate() {
                    let at = terms.iter().try_fold(0, |at, (index, stride, extent)| {
                        let index = index.at(lane).to_f64() as i64;
                        (0..*extent as i64).contains(&index).then(|| at + index as usize * stride)
                    });
                    *out = match (at, *source) {
                        (None, _) => other.at(lane),
                        (Some(at), Source::Whole(buffer))
                            if !arrays.positions[buffer.position()].is_empty() =>
                        {
                            T::from_number(arrays.cell(buffer, at))
                        }
                        (Some(at), Source::Whole(buffer)) => arrays.numbers[buffer.position()][at],
                        (Some(at), Source::Block(number)) => self.blocks[number][at * pass.block + lane],
                    };
                }
            }
        }
    }
}
