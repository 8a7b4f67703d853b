//! Finite variables that are summed out instead of drawn, given the drawn ones.
//!
//! In: the instances of forms that distribute or read them. Out: ln of the sum of the product of these forms, and draws of what was
//! summed. Invariant: what does not depend on each other is summed apart: each label of a mixture alone, the states of a chain one
//! after the other. In the assignments that it reads, summed slots have no value.
//!
//! Instances of a factor that are the same function of the drawn variables share their distributions: those of a thousand rows are
//! computed once for each value of a label.

mod build;

use crate::distribution::{Distribution, Instance, Setting, choose, exponentiate, ln_sum};
use crate::error::Error;
use crate::radix;
use crate::random::Random;
use rand::RngExt;
use std::collections::{BTreeSet, HashMap};

/// An instance, what it reads, or a likelihood of a slot.
pub(super) enum Summand {
    Instance(Instance, BTreeSet<usize>),
    Likelihood(usize, Vec<f64>),
}

impl Summand {
    /// Its summed slots: the parents, ascending, and the left-hand side last.
    fn scope(&self, is_summed: &dyn Fn(usize) -> bool) -> Vec<usize> {
        match self {
            Summand::Instance(instance, reads) => {
                let left = instance.left[0];
                let parents = reads.iter().copied().filter(|slot| *slot != left && is_summed(*slot));
                parents.chain(Some(left).filter(|left| is_summed(*left))).collect()
            }
            Summand::Likelihood(slot, _) => vec![*slot],
        }
    }
}

/// Distributions that several instances share.
#[derive(Debug)]
struct Template {
    instance: Instance,
    parents: Vec<usize>,
    /// The drawn slots on which it depends.
    inputs: Vec<usize>,
    /// Whether one observed instance alone uses it: its density is enough.
    alone: bool,
}

/// The values of a part.
#[derive(Debug)]
struct Table {
    source: Source,
    /// Where its cells begin, and how many they are; the last slot is the fastest.
    start: usize,
    cells: usize,
}

#[derive(Debug)]
enum Source {
    /// The logarithms of the probabilities of a summed left-hand side.
    Distributed(usize),
    /// The logarithm of the density at the value of a slot; whether that value may change.
    At(usize, usize, bool),
    Likelihood(Vec<f64>),
}

/// The sum over one slot.
#[derive(Debug)]
struct Step {
    slot: usize,
    count: usize,
    /// The slots on which the sum depends.
    scope: Vec<usize>,
    /// The strides of the scope and of the slot in each table and in each earlier sum under it.
    tables: Vec<(usize, Vec<usize>)>,
    sums: Vec<(usize, Vec<usize>)>,
    /// Where its sums begin.
    start: usize,
    cells: usize,
}

/// Finite variables that are summed out.
#[derive(Debug)]
pub(super) struct FiniteRest<'s> {
    setting: &'s Setting<'s>,
    templates: Vec<Template>,
    tables: Vec<Table>,
    /// For each part that depends on no other: its tables and its steps.
    clumps: Vec<(Vec<usize>, Vec<Step>)>,
    /// The clump of each summed slot.
    places: HashMap<usize, usize>,
    cells: usize,
}

/// What a chain remembers of its last sums.
#[derive(Clone, Debug, Default)]
pub(super) struct Sums {
    cells: Vec<f64>,
    sums: Vec<f64>,
    /// For each template: when it was computed and looked at, its inputs, its distributions, and logarithms of probabilities.
    shared: Vec<Shared>,
    /// When each table was computed.
    made: Vec<u64>,
    now: u64,
}

#[derive(Clone, Debug, Default)]
struct Shared {
    made: u64,
    seen: u64,
    inputs: Vec<f64>,
    distributions: Vec<Distribution>,
    /// In place of the distributions of an instance alone, ln of its densities.
    lns: Vec<f64>,
}

impl<'s> FiniteRest<'s> {
    /// The clump of a slot, if it is summed out.
    pub(super) fn clump(&self, slot: usize) -> Option<usize> {
        self.places.get(&slot).copied()
    }

    /// The number of clumps.
    pub(super) fn clumps(&self) -> usize {
        self.clumps.len()
    }

    /// Computes the distributions of a template if its inputs have changed.
    fn renew(&self, number: usize, values: &mut [f64], memory: &mut Sums) -> Result<(), Error> {
        let (setting, template) = (self.setting, &self.templates[number]);
        let shared = &mut memory.shared[number];
        if shared.seen == memory.now {
            return Ok(());
        }
        shared.seen = memory.now;
        let same = template.inputs.iter().zip(&shared.inputs).all(|(slot, before)| values[*slot] == *before);
        if shared.made > 0 && same {
            return Ok(());
        }
        shared.inputs.clear();
        shared.inputs.extend(template.inputs.iter().map(|slot| values[*slot]));
        shared.distributions.clear();
        shared.lns.clear();
        let count = |slot: &usize| setting.count(setting.variable_of(*slot));
        let combinations: usize = template.parents.iter().map(count).product();
        let before: Vec<f64> = template.parents.iter().map(|slot| values[*slot]).collect();
        let mut found = Ok(());
        for combination in 0..combinations {
            radix::assign(combination, &template.parents, |slot| count(&slot), values);
            let computed = match template.alone {
                true => setting.ln_density(&template.instance, values).map(|ln| shared.lns.push(ln)),
                false => (setting.distribution(&template.instance, values))
                    .map(|distribution| shared.distributions.push(distribution)),
            };
            if computed.is_err() {
                found = computed;
                break;
            }
        }
        template.parents.iter().zip(before).for_each(|(slot, value)| values[*slot] = value);
        shared.made = if found.is_ok() { memory.now } else { 0 };
        found
    }

    /// Computes the cells of a table where they have changed.
    fn fill(&self, number: usize, values: &mut [f64], memory: &mut Sums) -> Result<(), Error> {
        let table = &self.tables[number];
        let template = match table.source {
            Source::Distributed(template) | Source::At(template, ..) => {
                self.renew(template, values, memory)?;
                Some(template)
            }
            Source::Likelihood(_) => None,
        };
        let changes = matches!(table.source, Source::At(_, _, true));
        let newest = template.map_or(1, |template| memory.shared[template].made);
        if memory.made[number] >= newest && !changes {
            return Ok(());
        }
        memory.made[number] = memory.now;
        let cells = &mut memory.cells[table.start..table.start + table.cells];
        match &table.source {
            Source::Likelihood(likelihoods) => cells.copy_from_slice(likelihoods),
            Source::At(template, ..) if self.templates[*template].alone => {
                cells.copy_from_slice(&memory.shared[*template].lns);
            }
            Source::At(template, slot, _) => {
                let distributions = memory.shared[*template].distributions.iter();
                cells
                    .iter_mut()
                    .zip(distributions)
                    .for_each(|(cell, of)| *cell = of.ln_density(values[*slot]));
            }
            Source::Distributed(template) => {
                let distributions = &memory.shared[*template].distributions;
                let count = table.cells / distributions.len().max(1);
                for (cells, of) in cells.chunks_exact_mut(count).zip(distributions) {
                    cells
                        .iter_mut()
                        .enumerate()
                        .for_each(|(value, cell)| *cell = of.ln_density(value as f64));
                }
            }
        }
        Ok(())
    }

    /// ln of the sum of a clump at these values of the drawn variables.
    ///
    /// # Errors
    /// A number outside the range that a form accepts.
    pub(super) fn ln_sum(
        &self,
        clumps: &[usize],
        values: &mut [f64],
        memory: &mut Sums,
    ) -> Result<f64, Error> {
        memory.begin(self);
        let mut ln = 0.0;
        let mut joint = Vec::new();
        for clump in clumps {
            let (tables, steps) = &self.clumps[*clump];
            for table in tables {
                self.fill(*table, values, memory)?;
            }
            for step in steps {
                for cell in 0..step.cells {
                    self.joint(step, steps, cell, memory, &mut joint);
                    memory.sums[step.start + cell] = ln_sum(&joint);
                }
                if step.scope.is_empty() {
                    ln += memory.sums[step.start];
                }
            }
        }
        Ok(if ln.is_nan() { f64::NEG_INFINITY } else { ln })
    }

    /// ln of the product under a sum, for each value of its slot and this combination of values of its scope.
    fn joint(&self, step: &Step, steps: &[Step], cell: usize, memory: &Sums, joint: &mut Vec<f64>) {
        joint.clear();
        joint.resize(step.count, 0.0);
        let position = |strides: &[usize]| {
            let scope = step.scope.iter().rev();
            let counts = scope.map(|slot| self.setting.count(self.setting.variable_of(*slot)));
            let strides = strides[..step.scope.len()].iter().rev();
            radix::ordinals(cell, counts)
                .zip(strides)
                .map(|(ordinal, stride)| ordinal * stride)
                .sum::<usize>()
        };
        let mut add = |start: usize, cells: &[f64], strides: &[usize]| {
            let start = start + if step.scope.is_empty() { 0 } else { position(strides) };
            let stride = strides[step.scope.len()];
            joint.iter_mut().enumerate().for_each(|(value, sum)| *sum += cells[start + value * stride]);
        };
        for (table, strides) in &step.tables {
            add(self.tables[*table].start, &memory.cells, strides);
        }
        for (earlier, strides) in &step.sums {
            add(steps[*earlier].start, &memory.sums, strides);
        }
    }

    /// Draws the slots of some clumps, given the drawn variables.
    ///
    /// # Errors
    /// A number outside the range that a form accepts.
    pub(super) fn draw(
        &self,
        clumps: &[usize],
        values: &mut [f64],
        memory: &mut Sums,
        random: &mut Random,
    ) -> Result<(), Error> {
        self.ln_sum(clumps, values, memory)?;
        let mut joint = Vec::new();
        for clump in clumps {
            let steps = &self.clumps[*clump].1;
            for step in steps.iter().rev() {
                let digit = |slot: &usize| {
                    (values[*slot] as usize, self.setting.count(self.setting.variable_of(*slot)))
                };
                let cell = radix::position(step.scope.iter().map(digit));
                self.joint(step, steps, cell, memory, &mut joint);
                exponentiate(&mut joint);
                let total: f64 = joint.iter().sum();
                values[step.slot] = choose(&joint, random.random::<f64>() * total).unwrap_or(0) as f64;
            }
        }
        Ok(())
    }

    /// Takes back what was drawn.
    pub(super) fn withdraw(&self, values: &mut [f64]) {
        self.places.keys().for_each(|slot| values[*slot] = f64::NAN);
    }
}

impl Sums {
    /// A new computation.
    fn begin(&mut self, of: &FiniteRest<'_>) {
        if self.made.len() != of.tables.len() {
            let sums = of.clumps.iter().flat_map(|(_, steps)| steps).map(|step| step.cells).sum();
            *self = Self {
                cells: vec![0.0; of.cells],
                sums: vec![0.0; sums],
                shared: vec![Shared::default(); of.templates.len()],
                made: vec![0; of.tables.len()],
                now: 0,
            };
        }
        self.now += 1;
    }
}
