//! The factors of an instant, as potentials over its slots.
//!
//! In: a program whose carried variables are finite, and the observations of an instant. Out: a [`Product`] over the
//! slots that are carried or searched; all other slots are summed out. Invariant: each potential is a factor of the
//! decomposition restricted to its observed values and computed from the factor's own form. The factors that distribute
//! X^-1 enter the first instant only: from then on the message of the previous instant replaces them.

mod messages;
mod products;

use super::{far, is_dirac};
use crate::analysis::{is_proper, reached};
use crate::distribution::{Distribution, Instance, Setting};
use crate::error::Error;
use crate::ids::VariableId;
use crate::potential::{MOST_CELLS, Orders, Potential, Product};
use crate::radix;
use crate::strategies::over_time::{Instant, Weighed};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;

/// Upper limit on the numbers of distributions that are cached for one factor.
const MOST_KEPT: usize = 4_000_000;

/// Upper limit on the cells that are cached for patterns of observations.
const MOST_MADE: usize = 10_000_000;

/// The factors of a program at an instant.
pub(super) struct Factors<'s> {
    /// At the first instant, and at the others.
    first: Arc<Setting<'s>>,
    setting: Arc<Setting<'s>>,
    own: Vec<Own>,
    /// For each slot, the index in `own` of the instance that distributes it.
    distributes: Vec<Option<usize>>,
    /// The number of values of each slot; 0 for a real.
    pub(super) counts: Vec<usize>,
    /// The slots of X and of X^-1, in the same order.
    pub(super) now: Vec<usize>,
    pub(super) before: Vec<usize>,
    /// The slots that remain axes even when they are observed: carried, previous and searched ones.
    axes: BTreeSet<usize>,
    /// Likelihoods of slots, applied at each instant with observations (virtual evidence).
    likelihoods: Vec<(usize, Vec<f64>)>,
    /// Those of one instant.
    pub(super) weighed: Vec<Weighed>,
    patterns: HashMap<(bool, Vec<usize>), Arc<Vec<Described>>>,
    distributions: HashMap<(usize, bool), Arc<Vec<Distribution>>>,
    constant: HashMap<(usize, bool), Arc<Potential>>,
    /// Sums of the factors without observed slots, by whether the instant is the first, whether it has
    /// observations, and the observed slots.
    summed: HashMap<(bool, bool, Vec<usize>), Product>,
    made: HashMap<Made, Product>,
    made_cells: usize,
    pub(super) orders: Orders,
}

/// Cache key: whether the instant is the first, whether it has observations, and the observed slots with their bits.
type Made = (bool, bool, Vec<(usize, u64)>);

/// An instance of a factor.
struct Own {
    instance: Instance,
    /// The slots on which the distribution depends.
    parents: Vec<usize>,
    /// Whether it distributes X^-1.
    initial: bool,
    /// Whether it has a form of its own at the first instant.
    starts: bool,
    /// Whether it is certain to sum to one.
    proper: bool,
    /// Whether it determines the value of a real (a Dirac in every branch).
    determined: bool,
    /// Whether it distributes a component of a normal vector.
    normal_vector: bool,
}

/// An instance, some of whose slots are observed.
struct Described {
    own: usize,
    /// Whether its form is that of the first instant.
    first: bool,
    /// The slots that are not observed, on the right-hand side and on the left.
    parents: Vec<usize>,
    left: Vec<usize>,
    /// The instances that determine the real parents, parents first.
    determined: Vec<usize>,
    /// Whether a slot on its right-hand side, or any of its slots, is observed.
    given: bool,
    observed: bool,
}

impl<'s> Factors<'s> {
    pub(super) fn new(
        setting: &Setting<'s>,
        carried: &[(VariableId, VariableId)],
        searched: impl IntoIterator<Item = usize>,
        likelihoods: Vec<(usize, Vec<f64>)>,
    ) -> Result<Self, Error> {
        let model = setting.model;
        if let Some(index) = model.plate_index().filter(|index| setting.count(*index) > 1) {
            let (name, count) = (model.variable_name(index), setting.count(index));
            let reason = format!(
                "over time one element of a plate is followed, and `{name}` has {count}; to follow them all declare families, such as \
                 `X[{name} in 1..={count}]`, in place of the plate"
            );
            return Err(Error::Unplanned { question: model.name.clone(), reason });
        }
        let slots =
            |variables: Vec<VariableId>| variables.into_iter().flat_map(|id| setting.slots_of(id)).collect();
        let (now, before): (Vec<_>, Vec<_>) = carried.iter().copied().unzip();
        let (now, before): (Vec<usize>, Vec<usize>) = (slots(now), slots(before));
        let (mut own, mut distributes) = (Vec::new(), vec![None; setting.slots()]);
        for (position, instance) in setting.ordered()?.into_iter().enumerate() {
            instance.left.iter().for_each(|slot| distributes[*slot] = Some(position));
            let initial = instance.left.iter().any(|slot| before.contains(slot));
            if initial && !instance.left.iter().all(|slot| before.contains(slot)) {
                let head = model.head(&model.factors[instance.factor]);
                let reason = format!(
                    "`{head}` distributes a variable of the last instant together with one of this instant; \
                     write a factor for each"
                );
                return Err(Error::Unplanned { question: model.name.clone(), reason });
            }
            let parents = setting.reads(&instance).into_iter().filter(|slot| !instance.left.contains(slot));
            own.push(Own {
                parents: parents.collect(),
                initial,
                starts: model.factors[instance.factor].form.is_initial(),
                proper: is_proper(model, instance.factor),
                determined: is_dirac(&model.factors[instance.factor].form),
                normal_vector: model.factors[instance.factor].form.is_normal_vector(),
                instance,
            });
        }
        let counts = (0..setting.slots())
            .map(|slot| {
                let variable = setting.variable_of(slot);
                let finite = model.variables[variable].domain.is_finite();
                if finite { setting.count(variable) } else { 0 }
            })
            .collect();
        let axes = now.iter().chain(&before).copied().chain(searched).collect();
        Ok(Self {
            first: Arc::new(setting.at(true)),
            setting: Arc::new(setting.at(false)),
            own,
            distributes,
            counts,
            now,
            before,
            axes,
            likelihoods,
            weighed: Vec::new(),
            patterns: HashMap::new(),
            distributions: HashMap::new(),
            constant: HashMap::new(),
            summed: HashMap::new(),
            made: HashMap::new(),
            made_cells: 0,
            orders: Orders::default(),
        })
    }

    /// The factors without observed slots, and the others.
    fn potentials(
        &mut self,
        instant: &Instant,
        first: bool,
        given: bool,
    ) -> Result<(Product, Product), Error> {
        let pattern = self.pattern(instant, first)?;
        let mut values = vec![f64::NAN; self.setting.slots()];
        for (slot, distributes) in self.distributes.iter().enumerate() {
            // The plate's index has a single element.
            if distributes.is_none() {
                values[slot] = 0.0;
            }
        }
        instant.iter().for_each(|(slot, value)| values[*slot] = *value);
        let (mut constant, mut product) = (Product::default(), Product::default());
        // Observed factors over the same slots are summed as logarithms.
        let mut observed: BTreeMap<Vec<usize>, (Vec<f64>, f64)> = BTreeMap::new();
        for described in pattern.iter() {
            if !described.observed {
                if !self.constant.contains_key(&described.key()) {
                    let (cells, logarithms, _) = self.cells(described, &mut values)?;
                    let made = match logarithms {
                        true => Potential::of_logarithms(described.over(), cells),
                        false => Potential::of_numbers(described.over(), cells),
                    };
                    self.constant.insert(described.key(), Arc::new(made));
                }
                constant.push(self.constant[&described.key()].clone());
                continue;
            }
            let (mut cells, logarithms, ln_scale) = self.cells(described, &mut values)?;
            if !logarithms {
                cells.iter_mut().for_each(|cell| *cell = cell.ln());
            }
            match observed.get_mut(&described.over()) {
                Some((sums, ln_scales)) => {
                    sums.iter_mut().zip(cells).for_each(|(sum, cell)| *sum += cell);
                    *ln_scales += ln_scale;
                }
                None => {
                    observed.insert(described.over(), (cells, ln_scale));
                }
            }
        }
        for (over, (cells, ln_scale)) in observed {
            product.push(Arc::new(Potential::of_logarithms(over, cells).scaled(ln_scale)));
        }
        for (slot, value) in instant.iter().filter(|(slot, _)| self.axes.contains(slot)) {
            let is = |ordinal: usize| f64::from(u8::from(ordinal as f64 == *value));
            let cells = (0..self.counts[*slot]).map(is).collect();
            product.push(Arc::new(Potential::of_numbers(vec![*slot], cells)));
        }
        for (slot, weights) in self.likelihoods.iter().filter(|_| given).chain(&self.weighed) {
            let fixed = instant.iter().find(|(own, _)| own == slot && !self.axes.contains(own));
            product.push(Arc::new(match fixed {
                Some((_, value)) => Potential::of_numbers(Vec::new(), vec![weights[*value as usize]]),
                None => Potential::of_numbers(vec![*slot], weights.clone()),
            }));
        }
        Ok((constant, product))
    }

    fn is_real(&self, described: &Described) -> bool {
        self.counts[self.own[described.own].instance.left[0]] == 0
    }

    /// Writes the values of a factor over its free slots, parents first. They are logarithms for a real, or where f64
    /// cannot represent the probabilities; the returned number is to be added to these.
    fn cells(&mut self, described: &Described, values: &mut [f64]) -> Result<(Vec<f64>, bool, f64), Error> {
        let over = described.over();
        let size: f64 = over.iter().map(|slot| self.counts[*slot] as f64).product();
        if size > MOST_CELLS {
            return Err(self.too_large(size));
        }
        let real = self.is_real(described);
        let setting = Arc::clone(if described.first { &self.first } else { &self.setting });
        let instance = &self.own[described.own].instance;
        let kept = self.distributions.get(&described.key()).filter(|_| !described.given).cloned();
        let mut made = Vec::new();
        let contexts: usize = described.parents.iter().map(|slot| self.counts[*slot]).product();
        let left: usize = described.left.iter().map(|slot| self.counts[*slot]).product();
        for context in 0..contexts {
            if kept.is_some() {
                break;
            }
            radix::assign(context, &described.parents, |slot| self.counts[slot], values);
            for determined in &described.determined {
                let instance = &self.own[*determined].instance;
                if let Some(value) = setting.distribution(instance, values)?.only_value() {
                    values[instance.left[0]] = value;
                }
            }
            made.push(setting.distribution(instance, values)?);
        }
        let distributions: &[Distribution] = kept.as_ref().map_or(&made, |kept| kept);
        let wide = |distribution: &Distribution| matches!(distribution, Distribution::Wide(_));
        let logarithms = real || distributions.iter().any(wide);
        let mut cells = Vec::with_capacity(size as usize);
        for distribution in distributions {
            for ordinal in 0..left {
                radix::assign(ordinal, &described.left, |slot| self.counts[slot], values);
                let value = setting.left_value(instance, values);
                cells.push(match distribution {
                    Distribution::Finite(numbers) if !logarithms => numbers[value as usize],
                    other => other.ln_density(value),
                });
            }
        }
        let ln_scale = match real && described.observed {
            true => {
                let value = setting.left_value(instance, values);
                far::relative(distributions, value, &mut cells)
            }
            false => 0.0,
        };
        if kept.is_none() && !described.given {
            let each = instance.left.iter().map(|slot| self.counts[*slot].max(1)).product::<usize>();
            if described.observed && contexts * each <= MOST_KEPT {
                self.distributions.insert(described.key(), Arc::new(made));
            }
        }
        Ok((cells, logarithms, ln_scale))
    }

    /// The observed slots, and those that have likelihoods at this instant alone.
    fn slots_of(&self, instant: &Instant) -> Vec<usize> {
        let mut slots: Vec<usize> = instant.iter().map(|(slot, _)| *slot).collect();
        if !self.weighed.is_empty() {
            slots.push(usize::MAX);
            slots.extend(self.weighed.iter().map(|(slot, _)| *slot));
        }
        slots
    }

    /// The relevant factors for this set of observed slots.
    fn pattern(&mut self, instant: &Instant, first: bool) -> Result<Arc<Vec<Described>>, Error> {
        let key = (first, self.slots_of(instant));
        if let Some(pattern) = self.patterns.get(&key) {
            return Ok(pattern.clone());
        }
        let improper = |own: &&Own| !own.proper && self.counts[own.instance.left[0]] > 0 && !own.initial;
        let mut rest: Vec<usize> = self.axes.iter().copied().filter(|slot| self.counts[*slot] > 0).collect();
        rest.extend(instant.iter().map(|(slot, _)| *slot));
        rest.extend(self.weighed.iter().map(|(slot, _)| *slot));
        rest.extend(self.likelihoods.iter().map(|(slot, _)| *slot));
        rest.extend(self.own.iter().filter(improper).flat_map(|own| own.instance.left.clone()));
        let applies = |position: &usize| first || !self.own[*position].initial;
        let instance = |slot: usize| self.distributes[slot].filter(applies);
        let found = reached(self.distributes.len(), rest, |slot, rest| {
            rest.extend(instance(slot).into_iter().flat_map(|position| &self.own[position].parents));
        });
        let wanted: BTreeSet<usize> =
            (0..found.len()).filter(|slot| found[*slot]).filter_map(instance).collect();
        let mut described = Vec::new();
        for position in wanted {
            let left = &self.own[position].instance.left;
            let observed = |slot: &usize| instant.iter().any(|(own, _)| own == slot);
            let fixed = |slot: &usize| observed(slot) && !self.axes.contains(slot);
            // An unobserved real: the expression of its Dirac is substituted where the value is needed.
            if self.counts[left[0]] == 0 && !observed(&left[0]) {
                continue;
            }
            let mut own = Described {
                own: position,
                first: first && self.own[position].starts,
                parents: Vec::new(),
                left: left.iter().copied().filter(|slot| !fixed(slot)).collect(),
                determined: Vec::new(),
                given: false,
                observed: left.iter().any(fixed),
            };
            let mut rest: Vec<usize> = self.own[position].parents.clone();
            while let Some(slot) = rest.pop() {
                if fixed(&slot) {
                    (own.given, own.observed) = (true, true);
                    continue;
                }
                let Some(from) = self.distributes[slot] else { continue };
                // A component of a normal vector has a distribution without those that are not observed.
                if self.own[position].normal_vector
                    && self.setting.variable_of(slot) == self.setting.variable_of(left[0])
                {
                    continue;
                }
                let taken = if self.counts[slot] > 0 { &mut own.parents } else { &mut own.determined };
                let new = if self.counts[slot] > 0 { slot } else { from };
                if taken.contains(&new) {
                    continue;
                }
                taken.push(new);
                if self.counts[slot] == 0 {
                    if !self.own[from].determined {
                        return Err(self.not_observed(position, slot));
                    }
                    own.first |= first && self.own[from].starts;
                    rest.extend(&self.own[from].parents);
                }
            }
            own.parents.sort_unstable();
            own.determined.sort_unstable();
            described.push(own);
        }
        let described = Arc::new(described);
        self.patterns.insert(key, described.clone());
        Ok(described)
    }
}

impl Described {
    fn key(&self) -> (usize, bool) {
        (self.own, self.first)
    }
    fn over(&self) -> Vec<usize> {
        self.parents.iter().chain(&self.left).copied().collect()
    }
}
