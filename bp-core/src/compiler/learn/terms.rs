//! The densities that cases share, each once.
//!
//! In: families, and the values that cases give to their slots. Out: [`Terms`]: a *block* for each family and each
//! combination of its observed values, with a *term* for each combination of its hidden values. Invariant: equal
//! combinations of one family are one block, so that an E step computes each density once, and the observations of the
//! learned distributions are known before it.

use super::density::Densities;
use super::distribution::{Finder, Learnable, Seen};
use super::expect::{cells, put};
use super::program::Program;
use super::statistics::{Statistic, grow};
use crate::error::Error;
use crate::model::Domain;
use crate::radix;
use rayon::prelude::*;
use std::collections::HashMap;

/// Limit of the combinations of observed values whose blocks are found by their position in an array.
const MOST_POSITIONS: usize = 4096;

/// Number of blocks whose densities one thread computes at a time.
const BLOCKS: usize = 512;

/// A family at a combination of its observed values.
#[derive(Clone, Debug)]
pub(super) struct Block {
    pub(super) family: usize,
    /// The first of its terms.
    pub(super) first: usize,
    /// The first case that has it.
    pub(super) case: usize,
    /// The position of its values in [`Terms::values`].
    values: usize,
    /// The hidden slots.
    hidden: Vec<usize>,
}

/// An observation of a distribution.
#[derive(Clone, Debug)]
struct Observation {
    term: usize,
    distribution: usize,
    seen: Seen,
}

/// All terms.
#[derive(Clone, Debug, Default)]
pub(super) struct Terms {
    pub(super) blocks: Vec<Block>,
    /// Number of terms.
    pub(super) count: usize,
    /// The values of the slots of the family of each block; NaN if hidden.
    values: Vec<f64>,
    /// In the order of the distributions, and of the numbers that are seen.
    observations: Vec<Observation>,
}

/// Finds the block of a combination of observed values.
#[derive(Clone, Debug)]
pub(super) enum Index {
    /// By the position of the combination among all.
    Positions { slots: Vec<(usize, usize)>, blocks: Vec<Option<u32>> },
    /// By the numbers.
    Numbers { slots: Vec<usize>, blocks: HashMap<Box<[u64]>, u32> },
}

impl Index {
    /// For the observed slots of a family.
    pub(super) fn of(program: &Program, observed: Vec<usize>) -> Self {
        let count = |slot: &usize| {
            let domain = &program.model.variables[program.slots[*slot].variable].domain;
            Some((*slot, program.slots[*slot].count.filter(|_| !matches!(domain, Domain::Bins(_)))?))
        };
        let counts: Option<Vec<(usize, usize)>> = observed.iter().map(count).collect();
        let positions = |slots: &Vec<(usize, usize)>| {
            slots.iter().try_fold(1usize, |product, (_, count)| product.checked_mul(*count))
        };
        match counts.and_then(|slots| Some((positions(&slots)?, slots))) {
            Some((most, slots)) if most <= MOST_POSITIONS => {
                Self::Positions { slots, blocks: vec![None; most] }
            }
            _ => Self::Numbers { slots: observed, blocks: HashMap::new() },
        }
    }

    /// The block of the observed values, if it is known; else `next` is.
    fn block(&mut self, values: &[f64], numbers: &[f64], next: usize) -> usize {
        let next = next as u32;
        let block = match self {
            Self::Positions { slots, blocks } => {
                let digits = slots.iter().map(|(slot, count)| (values[*slot] as usize, *count));
                *blocks[radix::position(digits)].get_or_insert(next)
            }
            Self::Numbers { slots, blocks } => {
                let bits: Box<[u64]> = slots.iter().map(|slot| numbers[*slot].to_bits()).collect();
                *blocks.entry(bits).or_insert(next)
            }
        };
        block as usize
    }
}

impl Terms {
    /// The block of a family in a case, of which some slots are hidden; `values` and `numbers` are those of the case.
    pub(super) fn block(
        &mut self,
        (finder, index): (&mut Finder<'_>, &mut Index),
        (family, hidden): (usize, &[usize]),
        case: usize,
        (values, numbers): (&mut [f64], &mut [f64]),
    ) -> Result<usize, Error> {
        let found = index.block(values, numbers, self.blocks.len());
        if found < self.blocks.len() {
            return Ok(found);
        }
        let program = finder.program;
        let own = &program.families[family];
        let (first, at) = (self.count, self.values.len());
        self.values.extend(own.slots.iter().map(|slot| values[*slot]));
        for cell in 0..cells(program, hidden) {
            put(program, hidden, cell, values);
            hidden.iter().for_each(|slot| numbers[*slot] = program.number(*slot, values[*slot]));
            if own.learned
                && let Some((distribution, seen)) = finder.locate(own, values, numbers)?
            {
                self.observations.push(Observation { term: self.count, distribution, seen });
            }
            self.count += 1;
        }
        hidden.iter().for_each(|slot| (values[*slot], numbers[*slot]) = (f64::NAN, f64::NAN));
        self.blocks.push(Block { family, first, case, values: at, hidden: hidden.to_vec() });
        Ok(found)
    }

    /// Orders the observations, so that a sample receives its numbers in order.
    pub(super) fn finish(&mut self) {
        let number = |seen: &Seen| if let Seen::Number(number) = seen { (number + 0.0).to_bits() } else { 0 };
        self.observations.sort_by_key(|it| (it.distribution, number(&it.seen)));
    }

    /// Whether a term is an observation of a learned distribution.
    pub(super) fn observed(&self) -> Vec<bool> {
        let mut observed = vec![false; self.count];
        self.observations.iter().for_each(|it| observed[it.term] = true);
        observed
    }

    /// ln of the density of each term for the current numbers of a program.
    pub(super) fn ln(&self, program: &Program, cases: usize) -> Result<Vec<f64>, Error> {
        let densities = Densities::new(program, cases)?;
        let of_blocks = |blocks: &[Block]| -> Result<Vec<f64>, Error> {
            let mut values = vec![f64::NAN; program.slots.len()];
            let mut ln = Vec::with_capacity(blocks.len());
            for block in blocks {
                let slots = &program.families[block.family].slots;
                let own = &self.values[block.values..block.values + slots.len()];
                slots.iter().zip(own).for_each(|(slot, value)| values[*slot] = *value);
                for cell in 0..cells(program, &block.hidden) {
                    put(program, &block.hidden, cell, &mut values);
                    ln.push(densities.ln(block.family, &values)?);
                }
            }
            Ok(ln)
        };
        let found: Vec<Result<Vec<f64>, Error>> = self.blocks.par_chunks(BLOCKS).map(of_blocks).collect();
        Ok(found.into_iter().collect::<Result<Vec<_>, Error>>()?.concat())
    }

    /// The statistics of terms with these weights, added to others.
    pub(super) fn statistics(&self, learnable: &Learnable, weights: &[f64]) -> Vec<Statistic> {
        let mut statistics = Vec::new();
        grow(learnable, &mut statistics);
        for Observation { term, distribution, seen } in &self.observations {
            if weights[*term] > 0.0 {
                statistics[*distribution].add(seen, weights[*term]);
            }
        }
        statistics
    }
}
