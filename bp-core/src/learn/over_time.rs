//! Baum–Welch: the E step over sequences.
//!
//! In: sequences of cases of a program with variables X^-1. Out: ln P of all sequences, and the statistics of each
//! distribution, hidden values weighted by their probabilities given the whole sequence. Invariant: the messages are those
//! of `smooth`; a form of X^-1 belongs to the first instant alone, all others to every instant.
//!
//! E: n(x, u) = Σ_sequences Σₜ P(Xₜ = x, Uₜ = u | z₁..T), from α and β (Baum, Petrie, Soules and Weiss, *Annals of
//! Mathematical Statistics* 41:164-171, 1970; Rabiner 1989).

use super::distribution::{Learnable, Seen};
use super::expect::{Expectation, Expected, Key, MISSING};
use super::program::Program;
use super::statistics::{Statistic, grow};
use crate::error::Error;
use crate::error::Impossible;
use crate::ids::VariableId;
use crate::model::{Ask, Evidence, Known, Model, Searched, Value, When};
use crate::plan::refusal;
use crate::time::Instant;
use crate::time::chain::Chain;
use rayon::prelude::*;
use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

/// The most values that the hidden slots of one family may have together.
const MOST_VALUES: usize = 1 << 16;

/// Sequences that share the tables of one chain.
const TOGETHER: usize = 64;

/// The variables that a program carries from instant to instant: (X, X^-1).
pub(super) fn carried(model: &Model) -> Vec<(VariableId, VariableId)> {
    model.variables.iter().filter_map(|(id, variable)| Some((variable.previous_of?, id))).collect()
}

/// A family of which something is hidden, and where its expected counts go.
struct Hidden {
    slots: Vec<usize>,
    /// Position among the hidden values, distribution, what would have been seen.
    cells: Vec<(usize, usize, Seen)>,
}

/// A sequence, ready to be asked again and again.
struct Sequence {
    name: String,
    instants: Vec<Instant>,
    /// The hidden families of each instant.
    hidden: Vec<Vec<Arc<Hidden>>>,
}

/// Sequences, ready to be asked again and again.
pub(super) struct Sequences {
    carried: Vec<(VariableId, VariableId)>,
    /// The hidden slots of what is learned.
    axes: Vec<usize>,
    sequences: Vec<Sequence>,
    /// What is seen for sure.
    complete: Vec<Statistic>,
}

/// A family, and the bits of what is seen of it.
type Met = (usize, Vec<u64>);

impl Sequences {
    /// Sorts out what is hidden at each instant.
    ///
    /// # Errors
    /// A program whose carried variables are not finite; a hidden real on which something learned depends.
    pub(super) fn new(learnable: &mut Learnable, sequences: &[(String, Vec<Key>)]) -> Result<Self, Error> {
        let carried = carried(&learnable.program.model);
        is_finite(&learnable.program, &carried, sequences)?;
        let mut all = Self { carried, axes: Vec::new(), sequences: Vec::new(), complete: Vec::new() };
        let (mut axes, mut met): (BTreeSet<usize>, HashMap<Met, Arc<Hidden>>) = Default::default();
        let mut finder = learnable.finder()?;
        let program = finder.program;
        for (name, keys) in sequences {
            // What comes after the last observation says nothing.
            let length = keys.iter().rposition(|key| key.iter().any(|bits| *bits != MISSING));
            let keys = &keys[..length.map_or(0, |last| last + 1)];
            let mut sequence = Sequence { name: name.clone(), instants: Vec::new(), hidden: Vec::new() };
            for (number, key) in keys.iter().enumerate() {
                let (mut values, mut numbers) = values(program, key);
                let seen: Vec<usize> = (0..key.len()).filter(|slot| key[*slot] != MISSING).collect();
                sequence.instants.push(seen.iter().map(|slot| (*slot, values[*slot])).collect());
                if let Some(index) = program.plate_slot() {
                    (values[index], numbers[index]) = (0.0, 0.0);
                }
                let mut hidden = Vec::new();
                for position in needed(program, &all.carried, &values, number, keys.len()) {
                    let family = &program.families[position];
                    if !family.learned {
                        continue;
                    }
                    let slots: Vec<usize> =
                        family.slots.iter().copied().filter(|slot| values[*slot].is_nan()).collect();
                    if slots.is_empty() {
                        if let Some((distribution, seen)) = finder.locate(family, &values, &numbers)? {
                            finder.grow(&mut all.complete);
                            all.complete[distribution].add(&seen, 1.0);
                        }
                        continue;
                    }
                    let bits = family.slots.iter().map(|slot| numbers[*slot].to_bits()).collect();
                    let known = met.get(&(position, bits));
                    if let Some(known) = known {
                        hidden.push(known.clone());
                        continue;
                    }
                    let bits = family.slots.iter().map(|slot| numbers[*slot].to_bits()).collect();
                    let mut cells = Vec::new();
                    for cell in 0..cells_of(program, &slots, position)? {
                        let mut rest = cell;
                        for slot in slots.iter().rev() {
                            let count = program.slots[*slot].count.unwrap_or(1);
                            values[*slot] = (rest % count) as f64;
                            numbers[*slot] = program.number(*slot, values[*slot]);
                            rest /= count;
                        }
                        if let Some((distribution, seen)) = finder.locate(family, &values, &numbers)? {
                            cells.push((cell, distribution, seen));
                        }
                    }
                    slots.iter().for_each(|slot| (values[*slot], numbers[*slot]) = (f64::NAN, f64::NAN));
                    axes.extend(&slots);
                    let made = Arc::new(Hidden { slots, cells });
                    met.insert((position, bits), made.clone());
                    hidden.push(made);
                }
                sequence.hidden.push(hidden);
            }
            all.sequences.push(sequence);
        }
        all.axes = axes.into_iter().collect();
        grow(learnable, &mut all.complete);
        Ok(all)
    }

    /// What is seen for sure, and hidden values with these weights instead of probabilities.
    pub(super) fn weighted(
        &self,
        weight: &mut dyn FnMut(usize, usize, usize, usize) -> f64,
    ) -> Vec<Statistic> {
        let mut statistics = self.complete.clone();
        for (number, sequence) in self.sequences.iter().enumerate() {
            for (instant, hidden) in sequence.hidden.iter().enumerate() {
                for (position, hidden) in hidden.iter().enumerate() {
                    for (cell, distribution, seen) in &hidden.cells {
                        let share = weight(number, instant, position, *cell);
                        if share > 0.0 {
                            statistics[*distribution].add(seen, share);
                        }
                    }
                }
            }
        }
        statistics
    }
}

impl Expectation for Sequences {
    fn expect(&self, learnable: &Learnable) -> Result<Expected, Error> {
        let program = &learnable.program;
        let some = |sequences: &[Sequence]| -> Result<Vec<Smoothed>, Error> {
            let (setting, name) = (program.setting()?, program.model.name.clone());
            let mut chain = Chain::new(&setting, &self.carried, self.axes.clone(), Vec::new(), name)?;
            sequences.iter().map(|sequence| sequence.answer(&mut chain)).collect()
        };
        let answers: Vec<Vec<_>> = self.sequences.par_chunks(TOGETHER).map(some).collect::<Result<_, _>>()?;
        let answers: Vec<Smoothed> = answers.into_iter().flatten().collect();
        let ln_likelihood = answers.iter().map(|(ln, _)| ln).sum();
        let mut share = |number: usize, instant: usize, position: usize, cell: usize| -> f64 {
            answers[number].1[instant][position][cell]
        };
        Ok(Expected { ln_likelihood, statistics: self.weighted(&mut share) })
    }
}

/// ln P of a sequence; for each instant and each of its hidden families the probabilities of the hidden values.
type Smoothed = (f64, Vec<Vec<Vec<f64>>>);

impl Sequence {
    /// What the whole sequence says of each instant.
    fn answer(&self, chain: &mut Chain<'_>) -> Result<Smoothed, Error> {
        if self.instants.is_empty() {
            return Ok((0.0, Vec::new()));
        }
        let forward = chain.forward(&self.instants, 0).map_err(|error| match error {
            Error::Impossible(Impossible { question, reason }) if !self.name.is_empty() => {
                let question = format!("{question}, sequence {}", self.name);
                Error::Impossible(Impossible { question, reason })
            }
            other => other,
        })?;
        let mut answers = vec![Vec::new(); self.instants.len()];
        chain.backward(&forward, |instant, joint| {
            for hidden in &self.hidden[instant] {
                answers[instant].push(joint.distribution(&hidden.slots)?);
            }
            Ok(())
        })?;
        Ok((forward.ln_evidence, answers))
    }
}

/// Refuses a program that sums over finite states do not answer.
fn is_finite(
    program: &Program,
    carried: &[(VariableId, VariableId)],
    sequences: &[(String, Vec<Key>)],
) -> Result<(), Error> {
    let keys = || sequences.iter().flat_map(|(_, keys)| keys);
    let seen = |slot: &usize| keys().any(|key| key[*slot] != MISSING);
    let known: BTreeSet<VariableId> =
        (0..program.slots.len()).filter(seen).map(|slot| program.slots[slot].variable).collect();
    let known = known
        .into_iter()
        .map(|variable| Known { variable, evidence: Evidence::Hard(Value::Given(String::new())) });
    let searched = carried.iter().map(|(now, _)| Searched { variable: *now, at: None });
    let ask = Ask {
        statistic: crate::model::Statistic::Distribution,
        when: When::Smooth,
        searched: searched.collect(),
        known: known.collect(),
    };
    match refusal(&program.model, &ask, carried) {
        None => Ok(()),
        Some(reason) => {
            let message = format!("over time it is learned by sums over finite states: {reason}");
            Err(Error::input(&program.model.name, message))
        }
    }
}

/// The values and numbers of a case, NaN where it says none.
fn values(program: &Program, key: &Key) -> (Vec<f64>, Vec<f64>) {
    let number = |bits: &u64| if *bits == MISSING { f64::NAN } else { f64::from_bits(*bits) };
    let numbers: Vec<f64> = key.iter().map(number).collect();
    let value = |(slot, number): (usize, &f64)| program.value(slot, *number).unwrap_or(f64::NAN);
    (numbers.iter().enumerate().map(value).collect(), numbers)
}

/// The families of an instant on which something seen depends, there or later. What nothing depends on sums to one.
fn needed(
    program: &Program,
    carried: &[(VariableId, VariableId)],
    values: &[f64],
    number: usize,
    length: usize,
) -> Vec<usize> {
    let is = |slot: usize, of: &dyn Fn(&(VariableId, VariableId)) -> VariableId| {
        carried.iter().any(|pair| of(pair) == program.slots[slot].variable)
    };
    let mut needed: Vec<bool> = (0..values.len())
        .map(|slot| !values[slot].is_nan() || (number + 1 < length && is(slot, &|(now, _)| *now)))
        .collect();
    let mut kept = Vec::new();
    for (position, family) in program.families.iter().enumerate().rev() {
        let initial = is(family.instance.left[0], &|(_, before)| *before);
        if (number > 0 && initial) || !family.instance.left.iter().any(|slot| needed[*slot]) {
            continue;
        }
        family.slots.iter().for_each(|slot| needed[*slot] = true);
        kept.push(position);
    }
    kept.reverse();
    kept
}

/// How many values the hidden slots of a family have together.
fn cells_of(program: &Program, slots: &[usize], position: usize) -> Result<usize, Error> {
    let mut cells = 1usize;
    for slot in slots {
        let Some(count) = program.slots[*slot].count else {
            let head = program.head(program.families[position].instance.factor);
            let message = format!(
                "it is a real and missing at some instants, on which `{head}` depends; only variables whose values \
                 can be listed may be hidden"
            );
            return Err(Error::input(&program.slots[*slot].name, message));
        };
        cells = cells.saturating_mul(count);
    }
    if cells > MOST_VALUES {
        let names: Vec<&str> = slots.iter().map(|slot| program.slots[*slot].name.as_str()).collect();
        let message = format!("together they have more than {MOST_VALUES} hidden values");
        return Err(Error::input(names.join(" "), message));
    }
    Ok(cells)
}
