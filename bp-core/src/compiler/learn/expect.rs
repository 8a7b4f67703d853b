//! The E step: expected statistics, with missing values summed out.
//!
//! In: cases. Out: ln P of all cases by the whole program, and the statistics of each distribution, hidden values
//! weighted by their probabilities given the case. Invariant: sums are computed in logarithms and in the order of the
//! cases, so that nothing underflows and the result does not depend on the number of threads.
//!
//! E: n(x, u) = Σ_cases P(X = x, U = u | case).
//!
//! A family whose left-hand slots are missing, and on which no observed variable depends, sums to one: it is omitted.

use super::cliques::Cliques;
use super::density::Densities;
use super::distribution::{Finder, Learnable, Seen};
use super::program::Program;
use super::statistics::{Statistic, grow};
use crate::error::Error;
use crate::ids::VariableId;
use crate::radix;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// Limit of the joint values of the hidden slots of one clique.
const MOST_VALUES: usize = 1 << 16;

/// A case as a key: the bits of the number in each slot, or [`MISSING`].
pub(super) type Key = Box<[u64]>;

/// A bit pattern that is not the number of any case.
pub(super) const MISSING: u64 = u64::MAX;

/// The structure common to all cases with the same missing slots.
#[derive(Clone, Debug)]
struct Pattern {
    /// Families that are fully observed.
    seen: Vec<usize>,
    /// Families with hidden slots, and these slots.
    hidden: Vec<(usize, Vec<usize>)>,
    cliques: Option<Cliques>,
}

/// A case, and the targets of its expected counts.
#[derive(Clone, Debug)]
struct Asked {
    pattern: usize,
    /// Ordinals and reals; NaN if missing.
    values: Box<[f64]>,
    weight: f64,
    /// The fully observed part of a case with hidden learned values.
    seen: Vec<(usize, Seen)>,
    /// Hidden family, position among its hidden values, distribution, observation.
    counts: Vec<(usize, usize, usize, Seen)>,
}

/// Prepared cases.
pub(super) struct Cases {
    patterns: Vec<Pattern>,
    asked: Vec<Asked>,
    /// The statistics of cases without hidden learned values.
    complete: Vec<Statistic>,
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
    /// Groups cases by their missing slots.
    pub(super) fn new(learnable: &mut Learnable, cases: &BTreeMap<Key, f64>) -> Result<Self, Error> {
        let mut all = Self { patterns: Vec::new(), asked: Vec::new(), complete: Vec::new() };
        let mut known: BTreeMap<Vec<bool>, usize> = BTreeMap::new();
        let mut finder = learnable.finder()?;
        for (key, weight) in cases {
            let shape: Vec<bool> = key.iter().map(|bits| *bits != MISSING).collect();
            let pattern = match known.get(&shape) {
                Some(pattern) => *pattern,
                None => {
                    all.patterns.push(Pattern::of(finder.program, &shape)?);
                    known.insert(shape, all.patterns.len() - 1);
                    all.patterns.len() - 1
                }
            };
            all.case(&mut finder, key, *weight, pattern)?;
        }
        grow(learnable, &mut all.complete);
        Ok(all)
    }

    fn case(&mut self, finder: &mut Finder<'_>, key: &Key, weight: f64, number: usize) -> Result<(), Error> {
        let (program, pattern) = (finder.program, &self.patterns[number]);
        let mut numbers: Vec<f64> =
            key.iter().map(|bits| if *bits == MISSING { f64::NAN } else { f64::from_bits(*bits) }).collect();
        let value = |(slot, number): (usize, &f64)| program.value(slot, *number).unwrap_or(f64::NAN);
        let mut values: Vec<f64> = numbers.iter().enumerate().map(value).collect();
        let mut seen = Vec::new();
        for family in pattern.seen.iter().map(|family| &program.families[*family]) {
            if family.learned {
                seen.extend(finder.locate(family, &values, &numbers)?);
            }
        }
        let mut counts = Vec::new();
        for (position, (family, slots)) in pattern.hidden.iter().enumerate() {
            let family = &program.families[*family];
            if !family.learned {
                continue;
            }
            for cell in 0..cells(program, slots) {
                put(program, slots, cell, &mut values);
                slots.iter().for_each(|slot| numbers[*slot] = program.number(*slot, values[*slot]));
                if let Some((distribution, seen)) = finder.locate(family, &values, &numbers)? {
                    counts.push((position, cell, distribution, seen));
                }
            }
            slots.iter().for_each(|slot| (values[*slot], numbers[*slot]) = (f64::NAN, f64::NAN));
        }
        if counts.is_empty() {
            for (distribution, seen) in seen.drain(..) {
                finder.grow(&mut self.complete);
                self.complete[distribution].add(&seen, weight);
            }
        }
        self.asked.push(Asked { pattern: number, values: values.into(), weight, seen, counts });
        Ok(())
    }

    /// Whether a learned distribution depends on hidden values.
    pub(super) fn is_incomplete(&self) -> bool {
        self.asked.iter().any(|asked| !asked.counts.is_empty())
    }

    /// The observed statistics, and hidden values with these weights instead of probabilities.
    pub(super) fn weighted(&self, weight: &mut dyn FnMut(usize, usize, usize) -> f64) -> Vec<Statistic> {
        let mut statistics = self.complete.clone();
        for (number, asked) in self.asked.iter().enumerate() {
            for (distribution, seen) in &asked.seen {
                statistics[*distribution].add(seen, asked.weight);
            }
            for (family, cell, distribution, seen) in &asked.counts {
                let share = weight(number, *family, *cell);
                if share > 0.0 {
                    statistics[*distribution].add(seen, asked.weight * share);
                }
            }
        }
        statistics
    }
}

impl Expectation for Cases {
    fn expect(&self, learnable: &Learnable) -> Result<Expected, Error> {
        let program = &learnable.program;
        let densities = Densities::new(program, self.asked.len())?;
        let answers: Vec<(f64, Vec<Vec<f64>>)> = (self.asked.par_iter())
            .map(|asked| self.patterns[asked.pattern].answer(program, &densities, &asked.values))
            .collect::<Result<_, _>>()?;
        // A case of weight 0 does not count, not even if it is impossible.
        let weighted = self.asked.iter().zip(&answers).filter(|(asked, _)| asked.weight > 0.0);
        let ln_likelihood = weighted.map(|(asked, (ln, _))| asked.weight * ln).sum();
        let statistics = self.weighted(&mut |number, family, cell| answers[number].1[family][cell]);
        Ok(Expected { ln_likelihood, statistics })
    }
}

impl Pattern {
    /// The structure of cases with these observed slots.
    fn of(program: &Program, shown: &[bool]) -> Result<Self, Error> {
        if let Some(index) = program.plate_slot().filter(|slot| !shown[*slot]) {
            let message = "it is missing, but the program is repeated over it";
            return Err(Error::input(&program.slots[index].name, message));
        }
        // From the children up: a variable on which nothing observed depends sums to one.
        let (mut needed, mut kept) = (shown.to_vec(), Vec::new());
        for (number, family) in program.families.iter().enumerate().rev() {
            if family.instance.left.iter().any(|slot| needed[*slot]) {
                family.slots.iter().for_each(|slot| needed[*slot] = true);
                kept.push(number);
            }
        }
        kept.reverse();
        let mut pattern = Pattern { seen: Vec::new(), hidden: Vec::new(), cliques: None };
        for number in kept {
            let family = &program.families[number];
            let hidden: Vec<usize> = family.slots.iter().copied().filter(|slot| !shown[*slot]).collect();
            if let Some(real) = hidden.iter().find(|slot| program.slots[**slot].count.is_none()) {
                let slot = &program.slots[*real];
                let domain = program.model.domain_text(&program.model.variables[slot.variable].domain);
                let head = program.head(family.instance.factor);
                let message = format!(
                    "it is `{domain}` and missing in some cases, on which `{head}` depends; only variables whose \
                     values can be listed may be hidden"
                );
                return Err(Error::input(&slot.name, message));
            }
            match hidden.is_empty() {
                true => pattern.seen.push(number),
                false => pattern.hidden.push((number, hidden)),
            }
        }
        if !pattern.hidden.is_empty() {
            let scopes: Vec<Vec<usize>> = pattern.hidden.iter().map(|(_, slots)| slots.clone()).collect();
            let count = |slot: usize| program.slots[slot].count.unwrap_or(1);
            let cliques = Cliques::new(&scopes, &count, MOST_VALUES);
            pattern.cliques = Some(cliques.map_err(|slots| {
                let names: Vec<&str> = slots.iter().map(|slot| program.slots[*slot].name.as_str()).collect();
                let message = format!("together they have more than {MOST_VALUES} hidden values");
                Error::input(names.join(" "), message)
            })?);
        }
        Ok(pattern)
    }

    /// ln P of a case, and for each hidden family the probabilities of its hidden values.
    fn answer(
        &self,
        program: &Program,
        densities: &Densities<'_>,
        case: &[f64],
    ) -> Result<(f64, Vec<Vec<f64>>), Error> {
        let mut ln = 0.0;
        for family in &self.seen {
            let own = densities.ln(*family, case)?;
            if own == f64::NEG_INFINITY {
                return Err(impossible(program, case, Some(*family)));
            }
            ln += own;
        }
        let Some(cliques) = &self.cliques else { return Ok((ln, Vec::new())) };
        let mut values = case.to_vec();
        let mut tables = Vec::with_capacity(self.hidden.len());
        for (family, slots) in &self.hidden {
            let cells = cells(program, slots);
            let mut table = Vec::with_capacity(cells);
            for cell in 0..cells {
                put(program, slots, cell, &mut values);
                table.push(densities.ln(*family, &values)?);
            }
            if table.iter().all(|cell| *cell == f64::NEG_INFINITY) {
                return Err(impossible(program, case, Some(*family)));
            }
            tables.push(table);
        }
        let (sum, posteriors) = cliques.sum(&tables);
        match sum == f64::NEG_INFINITY {
            true => Err(impossible(program, case, None)),
            false => Ok((ln + sum, posteriors)),
        }
    }
}

/// The number of joint values of some slots.
pub(super) fn cells(program: &Program, slots: &[usize]) -> usize {
    slots.iter().map(|slot| program.slots[*slot].count.unwrap_or(1)).product()
}

/// Sets slots to the values of a joint ordinal, the last slot fastest.
pub(super) fn put(program: &Program, slots: &[usize], cell: usize, values: &mut [f64]) {
    let counts = slots.iter().rev().map(|slot| program.slots[*slot].count.unwrap_or(1));
    for (slot, ordinal) in slots.iter().rev().zip(radix::ordinals(cell, counts)) {
        values[*slot] = ordinal as f64;
    }
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
