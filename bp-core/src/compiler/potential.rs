//! Potentials: unnormalised tables over slots, each with the logarithm of its scale.
//!
//! In: the values of a factor for the free slots on which it depends. Out: a [`Potential`], and products of potentials
//! of which slots are summed or maximised out. Invariant: a cell is zero only if a factor is zero. No product
//! underflows: cells are numbers if their range allows it, otherwise logarithms.
//!
//! Strategies exchange potentials, never conditionals: P(X | Y) computed from a joint distribution is undefined if P(Y)
//! = 0, while the factors are defined everywhere.

mod bands;
mod eliminate;
mod sweep;

pub(crate) use eliminate::{MOST_CELLS, Orders, Product, Trace};

use crate::radix;
use bands::Bands;
use std::borrow::Cow;
use std::sync::Arc;

/// Limit of ln(largest / smallest nonzero cell) for cells stored as numbers.
const NARROW: f64 = 200.0;

/// A table over slots; the last slot is the fastest.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Potential {
    /// The slots, in the order of the axes.
    pub(crate) over: Vec<usize>,
    /// Numbers, the largest in [1, 2); or logarithms, the largest 0. All numbers are 0 if nothing is possible.
    cells: Vec<f64>,
    /// Whether the cells are logarithms.
    logarithms: bool,
    /// An upper bound of ln(largest / smallest nonzero cell).
    range: f64,
    /// The logarithm of the common factor of the cells.
    ln_scale: f64,
    /// For a table over two slots that is used many times: its band for sums over the first and over the second slot.
    bands: [Option<Arc<Bands>>; 2],
}

impl Potential {
    /// A potential of non-negative numbers, one for each cell.
    pub(crate) fn of_numbers(over: Vec<usize>, mut cells: Vec<f64>) -> Self {
        let largest = cells.iter().copied().fold(0.0, f64::max);
        if largest == 0.0 {
            return Self { over, cells, logarithms: false, range: 0.0, ln_scale: 0.0, bands: [None, None] };
        }
        let mut ln_scale = 0.0;
        if !(1.0..2.0).contains(&largest) {
            // A power of two: no rounding.
            let exponent = largest.log2().floor().clamp(-1000.0, 1000.0);
            let scale = (-exponent).exp2();
            cells.iter_mut().for_each(|cell| *cell *= scale);
            ln_scale = exponent * std::f64::consts::LN_2;
        }
        let (smallest, largest) = (cells.iter())
            .filter(|cell| **cell > 0.0)
            .fold((f64::INFINITY, 0.0f64), |(least, most), cell| (least.min(*cell), most.max(*cell)));
        let range = largest.ln() - smallest.ln();
        if range <= NARROW {
            return Self { over, cells, logarithms: false, range, ln_scale, bands: [None, None] };
        }
        let logarithms = cells.into_iter().map(f64::ln).collect();
        let mut wide = Self::of_logarithms(over, logarithms);
        wide.ln_scale += ln_scale;
        wide
    }

    /// A potential of logarithms, −∞ for zero.
    pub(crate) fn of_logarithms(over: Vec<usize>, mut cells: Vec<f64>) -> Self {
        let largest = cells.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if largest == f64::NEG_INFINITY {
            cells.fill(0.0);
            return Self { over, cells, logarithms: false, range: 0.0, ln_scale: 0.0, bands: [None, None] };
        }
        cells.iter_mut().for_each(|cell| *cell -= largest);
        let range = -cells.iter().copied().filter(|cell| cell.is_finite()).fold(0.0, f64::min);
        let logarithms = range > NARROW;
        if !logarithms {
            cells.iter_mut().for_each(|cell| *cell = cell.exp());
        }
        Self { over, cells, logarithms, range, ln_scale: largest, bands: [None, None] }
    }

    /// The same over other slots.
    pub(crate) fn renamed(&self, slot: impl Fn(usize) -> usize) -> Self {
        Self { over: self.over.iter().map(|own| slot(*own)).collect(), ..self.clone() }
    }

    /// The same times a factor with this logarithm.
    pub(crate) fn scaled(mut self, ln_factor: f64) -> Self {
        self.ln_scale += ln_factor;
        self
    }

    /// The same up to a factor, and the logarithm of that factor.
    pub(crate) fn unscaled(mut self) -> (Self, f64) {
        let ln_scale = std::mem::take(&mut self.ln_scale);
        (self, ln_scale)
    }

    /// The same with its bands, where it has some: sums over one of its two slots take the time of the band.
    pub(crate) fn with_bands(mut self, counts: &[usize]) -> Self {
        if let ([first, second], false) = (self.over.as_slice(), self.logarithms) {
            let (rows, columns) = (counts[*first], counts[*second]);
            let cells = &self.cells;
            let over_first = Bands::of(|i, j| cells[i * columns + j], rows, columns);
            let over_second = Bands::of(|j, i| cells[i * columns + j], columns, rows);
            self.bands = [over_first, over_second].map(|bands| bands.map(Arc::new));
        }
        self
    }

    /// The number of cells.
    pub(crate) fn len(&self) -> usize {
        self.cells.len()
    }

    /// Whether every cell is zero.
    pub(crate) fn is_zero(&self) -> bool {
        !self.logarithms && self.cells.iter().all(|cell| *cell == 0.0)
    }

    /// The logarithms of the cells, without the scale.
    fn logarithms(&self) -> Cow<'_, [f64]> {
        match self.logarithms {
            true => Cow::Borrowed(&self.cells),
            false => Cow::Owned(self.cells.iter().map(|cell| cell.ln()).collect()),
        }
    }

    /// ln of a potential without slots.
    pub(crate) fn ln_scalar(&self) -> f64 {
        debug_assert!(self.over.is_empty(), "internal: a scalar has no slot");
        match self.logarithms {
            true => self.cells[0] + self.ln_scale,
            false => self.cells[0].ln() + self.ln_scale,
        }
    }

    /// The cells divided by their sum, in an order of the slots that contains all of its own; all 0 if nothing is
    /// possible. Additional slots have no effect.
    pub(crate) fn distribution(&self, slots: &[usize], counts: &[usize]) -> Vec<f64> {
        let numbers: Cow<'_, [f64]> = match self.logarithms {
            true => Cow::Owned(self.cells.iter().map(|cell| cell.exp()).collect()),
            false => Cow::Borrowed(&self.cells),
        };
        let mut ordered = self.ordered(&numbers, slots, counts);
        let total: f64 = ordered.iter().sum();
        if total > 0.0 {
            ordered.iter_mut().for_each(|cell| *cell /= total);
        }
        ordered
    }

    /// The logarithms of the cells with their scale and another, in an order of the slots that contains all of its own.
    fn ln_table(&self, slots: &[usize], counts: &[usize], ln_factor: f64) -> Vec<f64> {
        let mut ordered = self.ordered(&self.logarithms(), slots, counts);
        ordered.iter_mut().for_each(|cell| *cell += self.ln_scale + ln_factor);
        ordered
    }

    /// Cells in an order of the slots that contains all of the potential's own.
    fn ordered(&self, numbers: &[f64], slots: &[usize], counts: &[usize]) -> Vec<f64> {
        let axes = slots.iter().map(|slot| (counts[*slot], self.stride(*slot, counts))).collect();
        radix::offsets(axes).map(|at| numbers[at]).collect()
    }

    /// The stride of a slot; 0 if the potential does not have it.
    fn stride(&self, slot: usize, counts: &[usize]) -> usize {
        radix::stride(&self.over, &slot, |own| counts[*own])
    }
}
