//! The E step: expected statistics, with missing values summed out.
//!
//! In: distinct cases. Out: ln P of all cases by the whole program, and the statistics of each distribution, hidden
//! values weighted by their probabilities given the case. Invariant: sums are computed in logarithms and in the order of
//! the cases, so that nothing underflows and the result does not depend on the number of threads.
//!
//! E: n(x, u) = Σ_cases P(X = x, U = u | case).
//!
//! Densities are computed once for all cases that read them ([`Terms`]); fully observed families are counted once for all
//! iterations.

use super::cliques::Beliefs;
use super::distinct::{DistinctCases, MISSING};
use super::distribution::Learnable;
use super::pattern::Pattern;
use super::program::Program;
use super::statistics::Statistic;
use super::terms::{Index, Terms};
use crate::error::Error;
use crate::ids::VariableId;
use crate::radix;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// Number of cases whose probabilities one thread computes at a time.
const CHUNK: usize = 256;

/// Limit of the probabilities that are computed before they are counted.
const MOST_SHARES: usize = 1 << 22;

/// A case with hidden values.
#[derive(Clone, Debug)]
struct Asked {
    pattern: usize,
    /// The position of its blocks in [`Cases::blocks`].
    blocks: usize,
    case: usize,
    weight: f64,
}

/// Prepared cases.
pub(super) struct Cases {
    distinct: DistinctCases,
    patterns: Vec<Pattern>,
    /// The cases with hidden values.
    asked: Vec<Asked>,
    /// For each of them, the block of each family with hidden values.
    blocks: Vec<u32>,
    terms: Terms,
    /// Whether a term is an observation of a learned distribution.
    observed: Vec<bool>,
    /// The weight of the cases in which a term is fully observed.
    complete: Vec<f64>,
}

/// The result of the E step: ln P of the cases, and statistics.
pub(super) struct Expected {
    pub(super) ln_likelihood: f64,
    pub(super) statistics: Vec<Statistic>,
}

/// Data for EM: cases or sequences.
pub(super) trait Expectation {
    /// The E step for the current numbers of the program.
    fn expect(&self, learnable: &Learnable) -> Result<Expected, Error>;
}

impl Cases {
    /// Groups cases by their missing slots, and finds the terms of their families.
    pub(super) fn new(learnable: &mut Learnable, cases: &DistinctCases) -> Result<Self, Error> {
        let mut distinct = cases.clone();
        distinct.merge();
        let mut known: BTreeMap<Vec<bool>, usize> = BTreeMap::new();
        let mut finder = learnable.finder()?;
        let program = finder.program;
        let whole = program.families.iter().map(|family| Index::of(program, family.slots.clone()));
        let mut whole: Vec<Index> = whole.collect();
        let (mut patterns, mut asked, mut blocks) = (Vec::<Pattern>::new(), Vec::new(), Vec::new());
        let (mut terms, mut complete) = (Terms::default(), Vec::new());
        let mut shape = Vec::with_capacity(program.slots.len());
        for case in 0..distinct.len() {
            let (mut values, mut numbers) = values(program, distinct.bits(case));
            shape.clear();
            shape.extend(numbers.iter().map(|number| !number.is_nan()));
            let number = match known.get(&shape) {
                Some(number) => *number,
                None => {
                    patterns.push(Pattern::of(program, &shape)?);
                    known.insert(shape.clone(), patterns.len() - 1);
                    patterns.len() - 1
                }
            };
            let (pattern, weight) = (&mut patterns[number], distinct.weight(case));
            for family in &pattern.seen {
                let index = (&mut finder, &mut whole[*family]);
                let block = terms.block(index, (*family, &[]), case, (&mut values, &mut numbers))?;
                complete.resize(terms.count, 0.0);
                complete[terms.blocks[block].first] += weight;
            }
            if !pattern.hidden.is_empty() {
                asked.push(Asked { pattern: number, blocks: blocks.len(), case, weight });
            }
            for hidden in &mut pattern.hidden {
                let (index, family) = ((&mut finder, &mut hidden.index), (hidden.family, &hidden.slots[..]));
                blocks.push(terms.block(index, family, case, (&mut values, &mut numbers))? as u32);
            }
        }
        terms.finish();
        complete.resize(terms.count, 0.0);
        let observed = terms.observed();
        Ok(Self { distinct, patterns, asked, blocks, terms, observed, complete })
    }

    /// The terms of each hidden family of a case: the first, and the number of cells.
    fn hidden(&self, asked: &Asked) -> impl Iterator<Item = (usize, usize)> {
        let hidden = &self.patterns[asked.pattern].hidden;
        let blocks = &self.blocks[asked.blocks..asked.blocks + hidden.len()];
        hidden.iter().zip(blocks).map(|(own, block)| (self.terms.blocks[*block as usize].first, own.cells))
    }

    /// Whether a learned distribution depends on hidden values.
    pub(super) fn is_incomplete(&self) -> bool {
        let mut terms = self.asked.iter().flat_map(|asked| self.hidden(asked));
        terms.any(|(first, cells)| self.observed[first..first + cells].contains(&true))
    }

    /// The observed statistics, and each hidden value with a weight from `weight` instead of its probability.
    pub(super) fn weighted(&self, learnable: &Learnable, weight: &mut dyn FnMut() -> f64) -> Vec<Statistic> {
        let mut weights = self.complete.clone();
        for asked in &self.asked {
            for term in self.hidden(asked).flat_map(|(first, cells)| first..first + cells) {
                if self.observed[term] {
                    weights[term] += asked.weight * weight();
                }
            }
        }
        self.terms.statistics(learnable, &weights)
    }

    /// ln P of the fully observed families of all cases.
    fn ln_observed(&self, program: &Program, ln: &[f64]) -> Result<f64, Error> {
        let mut sum = 0.0;
        for block in &self.terms.blocks {
            let (weight, ln) = (self.complete[block.first], ln[block.first]);
            if weight > 0.0 && ln == f64::NEG_INFINITY {
                return Err(self.impossible(program, block.case, Some(block.family)));
            }
            sum += if weight > 0.0 { weight * ln } else { 0.0 };
        }
        Ok(sum)
    }

    /// ln P of the hidden families of each of these cases, with the probabilities of their cells one after the other.
    fn probabilities(&self, cases: &[Asked], ln: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let (mut sums, mut shares) = (Vec::with_capacity(cases.len()), Vec::new());
        let mut beliefs: Option<(usize, Beliefs)> = None;
        for asked in cases {
            let Some(cliques) = &self.patterns[asked.pattern].cliques else { continue };
            let of_pattern = beliefs.take().filter(|(pattern, _)| *pattern == asked.pattern);
            let (_, own) = beliefs.insert(of_pattern.unwrap_or_else(|| (asked.pattern, cliques.beliefs())));
            let tables = self.hidden(asked).map(|(first, cells)| &ln[first..first + cells]);
            sums.push(cliques.sum(tables, own));
            cliques.shares(own, &mut shares);
        }
        (sums, shares)
    }

    /// The number of cases whose probabilities are computed before they are counted.
    fn batch(&self) -> usize {
        let width = |pattern: &Pattern| pattern.hidden.iter().map(|hidden| hidden.cells).sum::<usize>();
        let widest = self.patterns.iter().map(width).max().unwrap_or(0);
        (MOST_SHARES / widest.max(1)).next_multiple_of(CHUNK).max(CHUNK)
    }

    fn impossible(&self, program: &Program, case: usize, family: Option<usize>) -> Error {
        impossible(program, &values(program, self.distinct.bits(case)).0, family)
    }
}

impl Expectation for Cases {
    fn expect(&self, learnable: &Learnable) -> Result<Expected, Error> {
        let program = &learnable.program;
        let ln = self.terms.ln(program, self.distinct.len())?;
        let mut ln_likelihood = self.ln_observed(program, &ln)?;
        let mut weights = self.complete.clone();
        for batch in self.asked.chunks(self.batch()) {
            let found: Vec<(Vec<f64>, Vec<f64>)> =
                batch.par_chunks(CHUNK).map(|cases| self.probabilities(cases, &ln)).collect();
            for (cases, (sums, shares)) in batch.chunks(CHUNK).zip(&found) {
                let mut shares = shares.as_slice();
                for (asked, sum) in cases.iter().zip(sums) {
                    if *sum == f64::NEG_INFINITY {
                        let nothing = |(first, cells): (usize, usize)| {
                            ln[first..first + cells].iter().all(|ln| *ln == f64::NEG_INFINITY)
                        };
                        let by = self.hidden(asked).position(nothing);
                        let by = by.map(|position| self.patterns[asked.pattern].hidden[position].family);
                        return Err(self.impossible(program, asked.case, by));
                    }
                    ln_likelihood += asked.weight * sum;
                    for (first, cells) in self.hidden(asked) {
                        let (own, rest) = shares.split_at(cells);
                        shares = rest;
                        let counts = weights[first..first + cells].iter_mut();
                        counts.zip(own).for_each(|(count, share)| *count += asked.weight * share);
                    }
                }
            }
        }
        Ok(Expected { ln_likelihood, statistics: self.terms.statistics(learnable, &weights) })
    }
}

/// The values of all slots, and the numbers in the data; NaN if missing.
fn values(program: &Program, bits: impl Iterator<Item = u64>) -> (Vec<f64>, Vec<f64>) {
    let number = |bits| if bits == MISSING { f64::NAN } else { f64::from_bits(bits) };
    let numbers: Vec<f64> = bits.map(number).collect();
    let value = |(slot, number): (usize, &f64)| program.value(slot, *number).unwrap_or(f64::NAN);
    (numbers.iter().enumerate().map(value).collect(), numbers)
}

/// The number of joint values of some slots.
pub(super) fn cells(program: &Program, slots: &[usize]) -> usize {
    slots.iter().map(|slot| program.slots[*slot].count.unwrap_or(1)).product()
}

/// Sets slots to the values of a joint ordinal, the last slot fastest.
pub(super) fn put(program: &Program, slots: &[usize], cell: usize, values: &mut [f64]) {
    radix::assign(cell, slots, |slot| program.slots[slot].count.unwrap_or(1), values);
}

/// An impossible case.
fn impossible(program: &Program, case: &[f64], family: Option<usize>) -> Error {
    let known = case.iter().enumerate().filter(|(_, value)| !value.is_nan());
    let mut shown: Vec<String> = known
        .map(|(slot, value)| format!("{} = {}", program.slots[slot].name, program.spelled(slot, *value)))
        .collect();
    const MOST: usize = 12;
    if shown.len() > MOST {
        let more = shown.len() - MOST;
        shown.truncate(MOST);
        shown.push(format!("and {more} more"));
    }
    let by = family.map_or_else(String::new, |family| {
        format!(" by `{}`", program.head(program.families[family].instance.factor))
    });
    let message = format!("the case `{}` has probability zero{by}", shown.join(", "));
    Error::input(&program.model.name, message)
}

/// The variables observed in no case.
pub(super) fn never_seen(program: &Program, seen: &[usize]) -> Vec<String> {
    let shown: BTreeSet<VariableId> = program
        .slots
        .iter()
        .zip(seen)
        .filter(|(_, seen)| **seen > 0)
        .map(|(slot, _)| slot.variable)
        .collect();
    let hidden = program.model.variables.ids().filter(|id| !shown.contains(id));
    hidden.map(|id| program.model.variable_name(id)).collect()
}
