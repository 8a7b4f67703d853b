//! One sweep over the cells of a product, which sums or maximises over one slot.
//!
//! In: potentials, and at most one slot to eliminate. Out: the product, folded over that slot. Invariant: products of
//! numbers are formed only if their ranges together cannot underflow; otherwise logarithms are added, and the largest
//! is subtracted before the exponential.

use super::Potential;
use super::bands::Ln;
use std::borrow::Cow;

/// The range up to which a product of numbers is certain to be a normal number: e^−650 > 10^−283.
const SURELY_NORMAL: f64 = 650.0;

/// Limit of the potentials whose numbers are multiplied: each is less than 2.
const MOST_NUMBERS: usize = 128;

/// The fold over the eliminated slot.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Fold {
    /// Σ
    Sum,
    /// max
    Maximum,
}

/// A product of potentials, folded over a slot; and for a maximum the value of that slot for each cell.
pub(super) fn folded(
    parts: &[&Potential],
    away: Option<usize>,
    fold: Fold,
    counts: &[usize],
) -> (Potential, Vec<u32>) {
    if let Some(banded) = away.and_then(|slot| banded(parts, slot, fold, counts)) {
        return banded;
    }
    let nest = Nest::new(parts, away, counts);
    let range: f64 = parts.iter().map(|part| part.range).sum();
    let ln_scale: f64 = parts.iter().map(|part| part.ln_scale).sum();
    let narrow =
        parts.len() <= MOST_NUMBERS && range <= SURELY_NORMAL && parts.iter().all(|part| !part.logarithms);
    let mut choice = Vec::new();
    let mut made = if narrow {
        let arrays: Vec<&[f64]> = parts.iter().map(|part| part.cells.as_slice()).collect();
        let cells = match fold {
            Fold::Sum => nest.sum_of_products(&arrays),
            Fold::Maximum => nest.largest(&arrays, 0.0, 1.0, |one, other| one * other, &mut choice),
        };
        Potential::of_numbers(nest.out.clone(), cells)
    } else {
        let owned: Vec<Cow<'_, [f64]>> = parts.iter().map(|part| part.logarithms()).collect();
        let arrays: Vec<&[f64]> = owned.iter().map(|array| array.as_ref()).collect();
        let add = |one: f64, other: f64| one + other;
        let largest = nest.largest(&arrays, f64::NEG_INFINITY, 0.0, add, &mut choice);
        let cells = match fold {
            Fold::Sum => nest.ln_sum(&arrays, largest),
            Fold::Maximum => largest,
        };
        Potential::of_logarithms(nest.out.clone(), cells)
    };
    made.ln_scale += ln_scale;
    (made, choice)
}

/// The same where one of several potentials has a band, and the others do not have its other slot.
fn banded(parts: &[&Potential], slot: usize, fold: Fold, counts: &[usize]) -> Option<(Potential, Vec<u32>)> {
    let with_bands = |part: &&&Potential| part.bands[usize::from(part.over.last() == Some(&slot))].is_some();
    let table: &Potential = parts.iter().find(with_bands)?;
    let bands = table.bands[usize::from(table.over[1] == slot)].as_ref()?;
    let other = table.over[usize::from(table.over[0] == slot)];
    let others: Vec<&Potential> = parts.iter().copied().filter(|part| !std::ptr::eq(*part, table)).collect();
    if others.is_empty() || others.iter().any(|part| part.over.contains(&other)) {
        return None;
    }
    let weights = folded(&others, None, Fold::Sum, counts).0;
    let mut over: Vec<usize> = weights.over.iter().copied().filter(|own| *own != slot).collect();
    let rows = weights.ordered(&weights.cells, &[over.as_slice(), &[slot]].concat(), counts);
    over.push(other);
    let rows = rows.chunks_exact(counts[slot].max(1));
    let mut choice = Vec::new();
    let narrow = !weights.logarithms && weights.range + table.range <= SURELY_NORMAL;
    let mut made = if narrow {
        let mut cells = Vec::new();
        rows.for_each(|row| match fold {
            Fold::Sum => bands.sums(row, &mut cells),
            Fold::Maximum => bands.largest(row, &mut cells, &mut choice),
        });
        Potential::of_numbers(over, cells)
    } else {
        let mut cells: Vec<Ln> = Vec::new();
        let ln = |cell: &f64| Ln(if weights.logarithms { *cell } else { cell.ln() });
        rows.for_each(|row| {
            let row: Vec<Ln> = row.iter().map(ln).collect();
            match fold {
                Fold::Sum => bands.sums(&row, &mut cells),
                Fold::Maximum => bands.largest(&row, &mut cells, &mut choice),
            }
        });
        Potential::of_logarithms(over, cells.into_iter().map(|cell| cell.0).collect())
    };
    made.ln_scale += weights.ln_scale + table.ln_scale;
    Some((made, choice))
}

/// The loops: over the eliminated slot, then over the axes of the result, of which the last is a run.
struct Nest {
    out: Vec<usize>,
    cells: usize,
    /// The number of values of the eliminated slot; 1 if there is none.
    away: usize,
    /// For each potential: its stride along the eliminated slot.
    away_strides: Vec<usize>,
    /// Lengths of the outer axes of the result.
    lengths: Vec<usize>,
    /// For each outer axis, a stride for each potential.
    strides: Vec<Vec<usize>>,
    /// Length of the last axis.
    run: usize,
    /// Its strides.
    run_strides: Vec<usize>,
}

impl Nest {
    fn new(parts: &[&Potential], away: Option<usize>, counts: &[usize]) -> Self {
        // The order of the largest table, so that it is read contiguously.
        let mut order: Vec<&Potential> = parts.to_vec();
        order.sort_by_key(|part| std::cmp::Reverse(part.cells.len()));
        let mut out: Vec<usize> = Vec::new();
        for slot in order.iter().flat_map(|part| &part.over) {
            if Some(*slot) != away && !out.contains(slot) {
                out.push(*slot);
            }
        }
        let strides_of =
            |slot: usize| parts.iter().map(|part| part.stride(slot, counts)).collect::<Vec<usize>>();
        let (outer, run, run_strides) = match out.split_last() {
            Some((last, outer)) => (outer, counts[*last], strides_of(*last)),
            None => (&out[..], 1, vec![0; parts.len()]),
        };
        Self {
            cells: out.iter().map(|slot| counts[*slot]).product(),
            away: away.map_or(1, |slot| counts[slot]),
            away_strides: away.map_or_else(|| vec![0; parts.len()], strides_of),
            lengths: outer.iter().map(|slot| counts[*slot]).collect(),
            strides: outer.iter().map(|slot| strides_of(*slot)).collect(),
            run,
            run_strides,
            out,
        }
    }

    /// Calls `visit(value of the eliminated slot, first cell of the run, position of each potential there)`.
    fn each_run(&self, mut visit: impl FnMut(usize, usize, &[usize])) {
        let mut digits = vec![0; self.lengths.len()];
        let mut at = vec![0; self.away_strides.len()];
        for value in 0..self.away {
            at.iter_mut().zip(&self.away_strides).for_each(|(at, stride)| *at = value * stride);
            for start in (0..self.cells).step_by(self.run.max(1)) {
                visit(value, start, &at);
                for axis in (0..digits.len()).rev() {
                    digits[axis] += 1;
                    at.iter_mut().zip(&self.strides[axis]).for_each(|(at, stride)| *at += stride);
                    if digits[axis] < self.lengths[axis] {
                        break;
                    }
                    let length = self.lengths[axis];
                    at.iter_mut().zip(&self.strides[axis]).for_each(|(at, stride)| *at -= stride * length);
                    digits[axis] = 0;
                }
            }
        }
    }

    /// Σ of the products over the eliminated slot.
    fn sum_of_products(&self, arrays: &[&[f64]]) -> Vec<f64> {
        let mut out = vec![0.0; self.cells];
        let varying: Vec<usize> = (0..arrays.len()).filter(|part| self.run_strides[*part] > 0).collect();
        let fixed: Vec<usize> = (0..arrays.len()).filter(|part| self.run_strides[*part] == 0).collect();
        self.each_run(|_, start, at| {
            let factor: f64 = fixed.iter().map(|part| arrays[*part][at[*part]]).product();
            if factor == 0.0 {
                return;
            }
            let cells = &mut out[start..start + self.run];
            match varying.as_slice() {
                [] => cells.iter_mut().for_each(|cell| *cell += factor),
                [one] if self.run_strides[*one] == 1 => {
                    let row = &arrays[*one][at[*one]..at[*one] + self.run];
                    cells.iter_mut().zip(row).for_each(|(cell, value)| *cell += factor * value);
                }
                several => {
                    for (position, cell) in cells.iter_mut().enumerate() {
                        let value =
                            |part: &usize| arrays[*part][at[*part] + position * self.run_strides[*part]];
                        *cell += several.iter().map(value).fold(factor, |product, value| product * value);
                    }
                }
            }
        });
        out
    }

    /// The largest product (or sum of logarithms) over the eliminated slot, and its value there: the first in case of
    /// ties.
    fn largest(
        &self,
        arrays: &[&[f64]],
        nothing: f64,
        neutral: f64,
        times: impl Fn(f64, f64) -> f64,
        choice: &mut Vec<u32>,
    ) -> Vec<f64> {
        let mut out = vec![nothing; self.cells];
        *choice = vec![0; self.cells];
        self.each_run(|value, start, at| {
            for position in 0..self.run {
                let mut product = neutral;
                for (part, array) in arrays.iter().enumerate() {
                    product = times(product, array[at[part] + position * self.run_strides[part]]);
                }
                if product > out[start + position] {
                    out[start + position] = product;
                    choice[start + position] = value as u32;
                }
            }
        });
        out
    }

    /// ln Σ of the exponentials over the eliminated slot, given the largest of each cell.
    fn ln_sum(&self, arrays: &[&[f64]], largest: Vec<f64>) -> Vec<f64> {
        let mut sums = vec![0.0; self.cells];
        self.each_run(|_, start, at| {
            for position in 0..self.run {
                let most = largest[start + position];
                if most > f64::NEG_INFINITY {
                    let term =
                        |(part, array): (usize, &&[f64])| array[at[part] + position * self.run_strides[part]];
                    let ln: f64 = arrays.iter().enumerate().map(term).sum();
                    sums[start + position] += (ln - most).exp();
                }
            }
        });
        largest.iter().zip(sums).map(|(most, sum)| if sum > 0.0 { most + sum.ln() } else { *most }).collect()
    }
}
