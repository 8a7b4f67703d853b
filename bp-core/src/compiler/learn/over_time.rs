//! Baum–Welch: the E step over sequences.
//!
//! In: sequences of cases of a program with variables X^-1. Out: ln P of all sequences, and the statistics of each
//! distribution, hidden values weighted by their probabilities given the whole sequence. Invariant: the messages are
//! those of `smooth`; a form of X^-1 applies to the first instant only, all others to every instant.
//!
//! E: n(x, u) = Σ_sequences Σₜ P(Xₜ = x, Uₜ = u | z₁..T), from α and β (Baum, Petrie, Soules and Weiss, *Annals of
//! Mathematical Statistics* 41:164-171, 1970; Rabiner 1989).

use super::distinct::{Key, MISSING};
use super::distribution::{Finder, Learnable, Seen};
use super::expect::{Expectation, Expected, cells, put};
use super::messages::{Messages, Part};
use super::program::Program;
use super::statistics::{Statistic, grow};
use crate::analysis::{carried, is_proper};
use crate::error::Error;
use crate::error::Impossible;
use crate::ids::VariableId;
use crate::model::{Ask, Finding, Known, Searched, Value, When};
use crate::strategies::chain::{Chain, refusal};
use crate::strategies::over_time::Instant;
use rayon::prelude::*;
use std::collections::{BTreeSet, HashMap};

/// Limit of the joint values of the hidden slots of one family.
const MOST_VALUES: usize = 1 << 16;

/// Sequences that share the tables of one chain.
const TOGETHER: usize = 64;

/// A prepared sequence.
struct Sequence {
    name: String,
    instants: Vec<Instant>,
    /// The instants in the form of `messages`.
    slices: Vec<usize>,
    /// The parts of each instant that are counted.
    counted: Vec<Vec<usize>>,
}

/// Prepared sequences.
pub(super) struct Sequences {
    carried: Vec<(VariableId, VariableId)>,
    /// The hidden slots of learned distributions.
    axes: Vec<usize>,
    /// Families, for each combination of their observed values.
    parts: Vec<Part>,
    /// For each part the counted hidden values: the value, its distribution, the observation.
    counts: Vec<Vec<Counted>>,
    sequences: Vec<Sequence>,
    /// The observed statistics.
    complete: Vec<Statistic>,
    /// For instants with few hidden values; for others the messages are those of [`Chain`].
    messages: Option<Messages>,
}

impl Sequences {
    /// Prepares the hidden values of each instant.
    ///
    /// # Errors
    /// A program with carried variables that are not finite; a hidden real on which a learned distribution depends.
    pub(super) fn new(learnable: &mut Learnable, sequences: &[(String, Vec<Key>)]) -> Result<Self, Error> {
        let carried = carried(&learnable.program.model);
        is_finite(&learnable.program, &carried, sequences)?;
        let mut finder = learnable.finder()?;
        let program = finder.program;
        let mut messages = by_messages(program, &carried);
        let (mut parts, mut counts, mut complete) = (Vec::new(), Vec::new(), Vec::new());
        let mut axes = BTreeSet::new();
        let mut met: HashMap<(usize, Vec<u64>), usize> = HashMap::new();
        let mut all = Vec::new();
        for (name, keys) in sequences {
            // Instants after the last observation are uninformative.
            let length = keys.iter().rposition(|key| key.iter().any(|bits| *bits != MISSING));
            let keys = &keys[..length.map_or(0, |last| last + 1)];
            let (instants, slices, counted) = Default::default();
            let mut sequence = Sequence { name: name.clone(), instants, slices, counted };
            for (number, key) in keys.iter().enumerate() {
                let (mut values, mut numbers) = values(program, key);
                let seen: Vec<usize> = (0..key.len()).filter(|slot| key[*slot] != MISSING).collect();
                sequence.instants.push(seen.iter().map(|slot| (*slot, values[*slot])).collect());
                if let Some(index) = program.plate_slot() {
                    (values[index], numbers[index]) = (0.0, 0.0);
                }
                let mut own = Vec::new();
                for position in needed(program, &carried, &values, number, keys.len()) {
                    let family = &program.families[position];
                    if family.learned
                        && family.slots.iter().all(|slot| !values[*slot].is_nan())
                        && let Some((distribution, seen)) = finder.locate(family, &values, &numbers)?
                    {
                        finder.grow(&mut complete);
                        complete[distribution].add(&seen, 1.0);
                    }
                    let bits = family.slots.iter().map(|slot| numbers[*slot].to_bits()).collect();
                    let next = parts.len();
                    let part = *met.entry((position, bits)).or_insert(next);
                    if part == next {
                        let (made, cells) = part_of(&mut finder, position, &mut values, &mut numbers)?;
                        if !cells.is_empty() {
                            axes.extend(&made.slots);
                        }
                        parts.push(made);
                        counts.push(cells);
                    }
                    own.push(part);
                }
                let is_counted = |part: usize| !counts[part].is_empty();
                sequence.counted.push(own.iter().copied().filter(|part| is_counted(*part)).collect());
                if let Some(known) = &mut messages {
                    let slice = known.instant(program, number == 0, &values, (&parts, own), is_counted);
                    match slice {
                        Some(slice) => sequence.slices.push(slice),
                        None => messages = None,
                    }
                }
            }
            all.push(sequence);
        }
        grow(learnable, &mut complete);
        let axes = axes.into_iter().collect();
        Ok(Self { carried, axes, parts, counts, sequences: all, complete, messages })
    }

    /// The observed statistics, and hidden values with weights instead of probabilities: those of a sequence's cells,
    /// one counted part after the other.
    pub(super) fn weighted(&self, weight: &mut dyn FnMut(usize, usize) -> f64) -> Vec<Statistic> {
        let mut sums: Vec<Vec<f64>> = self.counts.iter().map(|counts| vec![0.0; counts.len()]).collect();
        for (number, sequence) in self.sequences.iter().enumerate() {
            let mut from = 0;
            for part in sequence.counted.iter().flatten() {
                for (sum, (cell, ..)) in sums[*part].iter_mut().zip(&self.counts[*part]) {
                    *sum += weight(number, from + cell);
                }
                from += self.parts[*part].cells;
            }
        }
        let mut statistics = self.complete.clone();
        for (sum, (_, distribution, seen)) in sums.iter().flatten().zip(self.counts.iter().flatten()) {
            if *sum > 0.0 {
                statistics[*distribution].add(seen, *sum);
            }
        }
        statistics
    }
}

impl Expectation for Sequences {
    fn expect(&self, learnable: &Learnable) -> Result<Expected, Error> {
        let program = &learnable.program;
        let weights = match &self.messages {
            Some(messages) => Some(messages.weights(program, &self.parts)?),
            None => None,
        };
        let some = |sequences: &[Sequence]| -> Result<Vec<Smoothed>, Error> {
            let (setting, name) = (program.setting()?, program.model.name.clone());
            let mut chain = None;
            let answer = |sequence: &Sequence| {
                if let Some(answer) = weights.as_ref().and_then(|weights| weights.answer(&sequence.slices)) {
                    return Ok(answer);
                }
                if chain.is_none() {
                    let axes = self.axes.clone();
                    chain = Some(Chain::new(&setting, &self.carried, axes, Vec::new(), name.clone())?);
                }
                let chain = chain.as_mut().expect("internal: it was made");
                sequence.answer(chain, &self.parts)
            };
            sequences.iter().map(answer).collect()
        };
        let answers: Vec<Vec<_>> = self.sequences.par_chunks(TOGETHER).map(some).collect::<Result<_, _>>()?;
        let answers: Vec<Smoothed> = answers.into_iter().flatten().collect();
        let ln_likelihood = answers.iter().map(|(ln, _)| ln).sum();
        let statistics = self.weighted(&mut |number, cell| answers[number].1[cell]);
        Ok(Expected { ln_likelihood, statistics })
    }
}

/// ln P of a sequence; the probabilities of the hidden values of its counted parts, one part after the other.
type Smoothed = (f64, Vec<f64>);

impl Sequence {
    /// The posterior of each instant given the whole sequence, by the messages of `smooth`.
    fn answer(&self, chain: &mut Chain<'_>, parts: &[Part]) -> Result<Smoothed, Error> {
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
            for part in &self.counted[instant] {
                answers[instant].extend(joint.distribution(&parts[*part].slots)?);
            }
            Ok(())
        })?;
        Ok((forward.ln_evidence, answers.into_iter().flatten().collect()))
    }
}

/// Messages on flat arrays, for a program whose factors always sum to one.
fn by_messages(program: &Program, carried: &[(VariableId, VariableId)]) -> Option<Messages> {
    let finite = |slot: usize| program.slots[slot].count.is_some();
    let proper = program
        .families
        .iter()
        .all(|family| !finite(family.instance.left[0]) || is_proper(&program.model, family.instance.factor));
    let slots = |of: &dyn Fn(&(VariableId, VariableId)) -> VariableId| -> Vec<usize> {
        let own =
            |variable| (0..program.slots.len()).filter(move |slot| program.slots[*slot].variable == variable);
        carried.iter().map(of).flat_map(own).collect()
    };
    if !proper {
        return None;
    }
    Messages::new(program, slots(&|pair| pair.0), slots(&|pair| pair.1))
}

/// A counted hidden value: its index, its distribution, the observation.
type Counted = (usize, usize, Seen);

/// A family with given values of some slots, and its counted hidden values.
fn part_of(
    finder: &mut Finder<'_>,
    position: usize,
    values: &mut [f64],
    numbers: &mut [f64],
) -> Result<(Part, Vec<Counted>), Error> {
    let program = finder.program;
    let family = &program.families[position];
    let slots: Vec<usize> = family.slots.iter().copied().filter(|slot| values[*slot].is_nan()).collect();
    let own = family.slots.iter().map(|slot| values[*slot]).collect();
    let mut part = Part { family: position, values: own, slots, cells: 1 };
    let mut counted = Vec::new();
    if !family.learned || part.slots.is_empty() {
        part.cells = cells(program, &part.slots);
        return Ok((part, counted));
    }
    part.cells = cells_of(program, &part.slots, position)?;
    for cell in 0..part.cells {
        put(program, &part.slots, cell, values);
        part.slots.iter().for_each(|slot| numbers[*slot] = program.number(*slot, values[*slot]));
        if let Some((distribution, seen)) = finder.locate(family, values, numbers)? {
            counted.push((cell, distribution, seen));
        }
    }
    part.slots.iter().for_each(|slot| (values[*slot], numbers[*slot]) = (f64::NAN, f64::NAN));
    Ok((part, counted))
}

/// Refuses a program that is not finite over time.
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
        .map(|variable| Known { variable, evidence: Finding::Hard(Value::Given(String::new())) });
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
            let message = format!("learning over time needs finite states: {reason}");
            Err(Error::input(&program.model.name, message))
        }
    }
}

/// The values and numbers of a case, NaN if missing.
fn values(program: &Program, key: &Key) -> (Vec<f64>, Vec<f64>) {
    let number = |bits: &u64| if *bits == MISSING { f64::NAN } else { f64::from_bits(*bits) };
    let numbers: Vec<f64> = key.iter().map(number).collect();
    let value = |(slot, number): (usize, &f64)| program.value(slot, *number).unwrap_or(f64::NAN);
    (numbers.iter().enumerate().map(value).collect(), numbers)
}

/// The families of an instant on which an observation depends, now or later. The others sum to one.
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

/// The number of joint values of the hidden slots of a family.
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
