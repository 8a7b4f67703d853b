//! Whole sequences of a chain: the most likely ones in order, and sequences drawn at random.
//!
//! In: forward messages. Out: for each sequence the values of the searched slots, instant by instant. Invariant: all
//! carried variables are searched, so that a sequence is one history; the state before the first instant is summed out
//! unless it is searched itself.
//!
//! Best: for each value of X the k best histories that end in it, from the k best of each X⁻¹ (Seshadri and Sundberg
//! 1994, "list Viterbi"). Drawn: X_T from α_T, then backward (X⁻¹, …) from αₜ₋₁(X⁻¹) φₜ given X (Frühwirth-Schnatter
//! 1994).

use super::{Chain, Forward};
use crate::error::Error;
use crate::posterior::rank;
use crate::radix;
use crate::random::seeded;
use rand::RngExt;

/// Values of the searched slots, instant by instant.
pub(crate) type Sequence = Vec<Vec<usize>>;

/// Upper limit on the entries that the search for the best sequences stores.
const MOST_ENTRIES: f64 = 1e8;

/// A history that ends in a value of the carried variables.
#[derive(Clone, Copy)]
struct Entry {
    /// ln of its probability with the observations so far.
    ln: f64,
    /// The cell of the instant's table.
    cell: usize,
    /// The rank of the history that it continues, among those that end in the previous value.
    rank: usize,
}

/// The slots of an instant's table: those of X⁻¹, those of X, and the other searched ones.
struct Axes {
    slots: Vec<usize>,
    /// The number of combinations of values of X; each is followed by `rest` values of the other searched slots.
    now: usize,
    rest: usize,
}

impl Axes {
    /// The ordinals of the values of X⁻¹ and of X in a cell.
    fn ends(&self, cell: usize) -> [usize; 2] {
        [cell / (self.now * self.rest), cell / self.rest % self.now]
    }
}

impl Chain<'_> {
    fn axes(&self, number: usize) -> Axes {
        let (now, before) = (&self.factors.now, &self.factors.before);
        let entered = if number == 0 { &[][..] } else { before };
        let rest = self.searched.iter().filter(|slot| !now.contains(slot) && !entered.contains(slot));
        let rest: Vec<usize> = rest.copied().collect();
        let size = |slots: &[usize]| slots.iter().map(|slot| self.count(*slot)).product();
        Axes { slots: [entered, now, &rest].concat(), now: size(now), rest: size(&rest) }
    }

    /// The values that the searched slots have in a cell of an instant's table.
    fn values(&self, axes: &Axes, cell: usize) -> Vec<usize> {
        let mut values = vec![0; self.factors.counts.len()];
        let counts = axes.slots.iter().map(|slot| self.count(*slot));
        for (slot, ordinal) in axes.slots.iter().zip(radix::in_order(cell, counts)) {
            values[*slot] = ordinal;
        }
        self.searched.iter().map(|slot| values[*slot]).collect()
    }

    /// The most likely sequences, the best first, with the logarithm of the probability of each given all observations.
    ///
    /// # Errors
    /// Tables that are too large.
    pub(crate) fn best(&mut self, forward: &Forward, count: usize) -> Result<Vec<(f64, Sequence)>, Error> {
        let mut kept: Vec<Vec<Vec<Entry>>> = Vec::with_capacity(forward.products.len());
        let mut entries = 0.0;
        for (number, product) in forward.products.iter().enumerate() {
            let axes = self.axes(number);
            let (counts, orders) = (&self.factors.counts, &mut self.factors.orders);
            let table = product.clone().ln_table(&axes.slots, counts, orders);
            let table = self.small(table)?;
            let mut ending: Vec<Vec<Entry>> = vec![Vec::new(); axes.now];
            for (cell, ln) in table.into_iter().enumerate().filter(|(_, ln)| *ln > f64::NEG_INFINITY) {
                let [before, now] = axes.ends(cell);
                match kept.last() {
                    None => ending[now].push(Entry { ln, cell, rank: 0 }),
                    Some(last) => {
                        ending[now].extend((last[before].iter().enumerate()).map(|(rank, entry)| Entry {
                            ln: entry.ln + ln,
                            cell,
                            rank,
                        }))
                    }
                }
            }
            for ending in &mut ending {
                keep_best(ending, count);
                entries += ending.len() as f64;
            }
            if entries > MOST_ENTRIES {
                return Err(self.factors.too_large(entries));
            }
            kept.push(ending);
        }
        let last = kept.len() - 1;
        let mut ends: Vec<Entry> = Vec::new();
        for (now, ending) in kept[last].iter().enumerate() {
            ends.extend((0..ending.len()).map(|rank| Entry { ln: ending[rank].ln, cell: now, rank }));
        }
        keep_best(&mut ends, count);
        let mut sequences = Vec::with_capacity(ends.len());
        for end in ends {
            let (mut now, mut rank) = (end.cell, end.rank);
            let mut sequence = Vec::with_capacity(kept.len());
            for number in (0..kept.len()).rev() {
                let (axes, entry) = (self.axes(number), kept[number][now][rank]);
                sequence.push(self.values(&axes, entry.cell));
                (now, rank) = (axes.ends(entry.cell)[0], entry.rank);
            }
            sequence.reverse();
            sequences.push((end.ln - forward.ln_evidence, sequence));
        }
        Ok(sequences)
    }

    /// Sequences drawn from their distribution given all observations.
    ///
    /// # Errors
    /// Tables that are too large.
    pub(crate) fn drawn(
        &mut self,
        forward: &Forward,
        count: usize,
        seed: u64,
    ) -> Result<Vec<Sequence>, Error> {
        let mut random = seeded(seed, &self.asked);
        let mut ends: Vec<Option<usize>> = vec![None; count];
        let mut sequences: Vec<Sequence> = vec![Vec::with_capacity(forward.products.len()); count];
        for number in (0..forward.products.len()).rev() {
            let axes = self.axes(number);
            let table = self.at(forward, number, |joint| joint.distribution(&axes.slots))?;
            // For each value of X, the cells with that value and their cumulative sums.
            let mut cells: Vec<(Vec<usize>, Vec<f64>)> = vec![Default::default(); axes.now + 1];
            for (cell, p) in table.iter().enumerate().filter(|(_, p)| **p > 0.0) {
                for group in [axes.ends(cell)[1], axes.now] {
                    let (own, sums) = &mut cells[group];
                    sums.push(sums.last().copied().unwrap_or(0.0) + p);
                    own.push(cell);
                }
            }
            for (end, sequence) in ends.iter_mut().zip(&mut sequences) {
                let (own, sums) = &cells[end.unwrap_or(axes.now)];
                let at = random.random::<f64>() * sums.last().expect("internal: the drawn value is possible");
                let cell = own[sums.partition_point(|sum| *sum <= at).min(own.len() - 1)];
                sequence.push(self.values(&axes, cell));
                *end = Some(axes.ends(cell)[0]);
            }
        }
        sequences.iter_mut().for_each(|sequence| sequence.reverse());
        Ok(sequences)
    }
}

/// Keeps the entries with the largest logarithms, in order; among ties (up to rounding) the earlier entry first.
fn keep_best(entries: &mut Vec<Entry>, count: usize) {
    const ROUNDING: f64 = 1e-9;
    rank(entries, |entry| entry.ln, |ln| ln - ROUNDING, |entry| [entry.cell, entry.rank]);
    entries.truncate(count);
}
