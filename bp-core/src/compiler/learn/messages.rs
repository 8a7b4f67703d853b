//! Messages along sequences, on flat arrays: the E step if an instant has few hidden values.
//!
//! In: the prepared hidden and observed values of each instant. Out: ln P of a sequence, and the probabilities of all
//! hidden values. Invariant: only logarithms are added, so that a probability is zero only if a factor is zero; the
//! work is linear in the number of instants.
//!
//! An instant's *cells* are the values that its hidden slots have together, X^-1 among them; w(cell) is the product of its
//! factors. α(x) = Σ of α(x⁻¹) w over the cells with x,  β(x⁻¹) = Σ of w β(x) over those with x⁻¹,
//! P(cell | z) ∝ α(x⁻¹) w β(x).

use super::cliques::{add, places, summed};
use super::density::Densities;
use super::expect::put;
use super::program::Program;
use crate::distribution::ln_sum;
use crate::error::Error;
use crate::radix;
use rayon::prelude::*;
use std::collections::HashMap;

/// Limit of the cells of an instant.
const MOST_CELLS: usize = 1 << 10;

/// Limit of the cells of all distinct instants.
const MOST_TOGETHER: usize = 1 << 25;

/// A family with partly observed slots.
pub(super) struct Part {
    pub(super) family: usize,
    /// The values of the family's slots, NaN if hidden.
    pub(super) values: Box<[f64]>,
    /// The hidden ones.
    pub(super) slots: Vec<usize>,
    /// Their number of joint values.
    pub(super) cells: usize,
}

/// The structure of instants with the same hidden slots.
struct Shape {
    cells: usize,
    /// The value of X^-1 in each cell; empty in the first instant, which uses the initial distribution.
    before: Vec<u32>,
    /// The value of X in each cell; empty if nothing observed depends on it.
    now: Vec<u32>,
    /// For each part the position among its own cells.
    places: Vec<Vec<u32>>,
}

/// An instant.
struct Slice {
    shape: usize,
    parts: Vec<usize>,
    /// The parts that are counted, by their position among `parts`.
    counted: Vec<usize>,
}

/// Whether it is the first, the hidden slots, the families, the observed part of X.
type Kind = (bool, Vec<usize>, Vec<usize>, usize);

/// The instants of all sequences.
pub(super) struct Messages {
    now: Vec<usize>,
    before: Vec<usize>,
    /// The number of values of X.
    states: usize,
    shapes: Vec<Shape>,
    slices: Vec<Slice>,
    kinds: HashMap<Kind, usize>,
    known: HashMap<(usize, Vec<usize>), usize>,
    together: usize,
}

/// w of all distinct instants, for the current numbers of the program.
pub(super) struct Weights<'m> {
    messages: &'m Messages,
    of: Vec<Vec<f64>>,
}

impl Messages {
    /// Over the slots of X and of X^-1, in the same order; nothing if they have too many values.
    pub(super) fn new(program: &Program, now: Vec<usize>, before: Vec<usize>) -> Option<Self> {
        let states = joint(program, &now).filter(|states| *states <= MOST_CELLS)?;
        let (shapes, slices, kinds, known) = Default::default();
        Some(Self { now, before, states, shapes, slices, kinds, known, together: 0 })
    }

    /// Adds an instant with these parts, of which some are counted; nothing if it has too many cells.
    pub(super) fn instant(
        &mut self,
        program: &Program,
        first: bool,
        values: &[f64],
        (all, parts): (&[Part], Vec<usize>),
        counted: impl Fn(usize) -> bool,
    ) -> Option<usize> {
        let mut hidden: Vec<usize> = if first { Vec::new() } else { self.before.clone() };
        hidden.extend(parts.iter().flat_map(|part| &all[*part].slots));
        hidden.sort_unstable();
        hidden.dedup();
        let seen = |slot: &usize| if values[*slot].is_nan() { 0 } else { values[*slot] as usize };
        let count = |slot: usize| program.slots[slot].count.unwrap_or(1);
        let now = radix::position(self.now.iter().map(|slot| (seen(slot), count(*slot))));
        let kind = (first, hidden, parts.iter().map(|part| all[*part].family).collect(), now);
        let shape = match self.kinds.get(&kind) {
            Some(shape) => *shape,
            None => {
                let hidden = &kind.1;
                let cells = joint(program, hidden).filter(|cells| *cells <= MOST_CELLS)?;
                let has = |slot: &usize| hidden.contains(slot) || !values[*slot].is_nan();
                let mut places_now = Vec::new();
                if self.now.iter().all(has) {
                    places_now = places(hidden, &self.now, &count);
                    places_now.iter_mut().for_each(|place| *place += now as u32);
                }
                let before = if first { Vec::new() } else { places(hidden, &self.before, &count) };
                let own = parts.iter().map(|part| places(hidden, &all[*part].slots, &count)).collect();
                self.shapes.push(Shape { cells, before, now: places_now, places: own });
                self.kinds.insert(kind, self.shapes.len() - 1);
                self.shapes.len() - 1
            }
        };
        let key = (shape, parts.clone());
        if let Some(known) = self.known.get(&key) {
            return Some(*known);
        }
        self.together += self.shapes[shape].cells;
        if self.together > MOST_TOGETHER {
            return None;
        }
        let counted = (0..parts.len()).filter(|position| counted(parts[*position])).collect();
        self.slices.push(Slice { shape, parts, counted });
        self.known.insert(key, self.slices.len() - 1);
        Some(self.slices.len() - 1)
    }

    /// w for the current numbers of the program.
    pub(super) fn weights(&self, program: &Program, parts: &[Part]) -> Result<Weights<'_>, Error> {
        let densities = Densities::new(program, parts.len())?;
        let table = |part: &Part| -> Result<Vec<f64>, Error> {
            let family = &program.families[part.family];
            let mut values = vec![f64::NAN; program.slots.len()];
            family.slots.iter().zip(&part.values).for_each(|(slot, value)| values[*slot] = *value);
            (0..part.cells)
                .map(|cell| {
                    put(program, &part.slots, cell, &mut values);
                    densities.ln(part.family, &values)
                })
                .collect()
        };
        let tables: Vec<Vec<f64>> =
            parts.par_iter().with_min_len(256).map(table).collect::<Result<_, Error>>()?;
        let weights = |slice: &Slice| -> Vec<f64> {
            let shape = &self.shapes[slice.shape];
            let mut weights = vec![0.0; shape.cells];
            for (part, places) in slice.parts.iter().zip(&shape.places) {
                let table = &tables[*part];
                weights.iter_mut().zip(places).for_each(|(weight, place)| *weight += table[*place as usize]);
            }
            weights
        };
        Ok(Weights { messages: self, of: self.slices.par_iter().with_min_len(256).map(weights).collect() })
    }
}

impl Weights<'_> {
    /// ln P of a sequence of instants, and the probabilities of the cells of all counted parts, one after the other;
    /// nothing if it is impossible.
    pub(super) fn answer(&self, sequence: &[usize]) -> Option<(f64, Vec<f64>)> {
        let Messages { states, shapes, slices, .. } = self.messages;
        let at = |instant: usize| {
            let slice = &slices[sequence[instant]];
            (slice, &shapes[slice.shape], self.of[sequence[instant]].as_slice())
        };
        let (mut forward, mut ln): (Vec<f64>, f64) = (Vec::with_capacity(sequence.len() * states), 0.0);
        let mut cells: Vec<f64> = Vec::new();
        for instant in 0..sequence.len() {
            let (_, shape, weights) = at(instant);
            cells.clear();
            cells.extend_from_slice(weights);
            if instant > 0 {
                add(&mut cells, &forward[(instant - 1) * states..], &shape.before);
            }
            let total = ln_sum(&cells);
            if total == f64::NEG_INFINITY {
                return None;
            }
            ln += total;
            if instant + 1 < sequence.len() {
                let message = summed(&cells, &shape.now, *states);
                forward.extend(message.iter().map(|cell| cell - total));
            }
        }
        let counted = |slice: &Slice, shape: &Shape| -> usize {
            slice.counted.iter().map(|part| places_of(&shape.places[*part])).sum()
        };
        let mut end: usize = (0..sequence.len()).map(|instant| counted(at(instant).0, at(instant).1)).sum();
        let mut probabilities = vec![0.0; end];
        let mut back = vec![0.0; *states];
        for instant in (0..sequence.len()).rev() {
            let (slice, shape, weights) = at(instant);
            cells.clear();
            cells.extend_from_slice(weights);
            if instant + 1 < sequence.len() {
                add(&mut cells, &back, &shape.now);
            }
            if instant > 0 {
                back = summed(&cells, &shape.before, *states);
                let most = back.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                back.iter_mut().for_each(|cell| *cell -= most);
                add(&mut cells, &forward[(instant - 1) * states..], &shape.before);
            }
            let total = ln_sum(&cells);
            cells.iter_mut().for_each(|cell| *cell = (*cell - total).exp());
            end -= counted(slice, shape);
            let mut from = end;
            for places in slice.counted.iter().map(|part| &shape.places[*part]) {
                let own = &mut probabilities[from..];
                cells.iter().zip(places).for_each(|(cell, place)| own[*place as usize] += cell);
                from += places_of(places);
            }
        }
        Some((ln, probabilities))
    }
}

/// The number of cells of a part: the last position is that of the last cell.
fn places_of(places: &[u32]) -> usize {
    places.last().map_or(1, |last| *last as usize + 1)
}

/// The number of joint values of some slots; nothing if one of them is a real, or there are too many.
fn joint(program: &Program, slots: &[usize]) -> Option<usize> {
    slots.iter().try_fold(1usize, |cells, slot| cells.checked_mul(program.slots[*slot].count?))
}
