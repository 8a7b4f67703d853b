//! The tables and steps of sums over finite variables.
//!
//! In: parts of a product and the slots to sum over. Out: a [`FiniteRest`]. Invariant: the order is found by `elimination`.

use super::super::signature::signature;
use super::{FiniteRest, Source, Step, Summand, Table, Template};
use crate::distribution::Setting;
use crate::elimination;
use crate::ids::Id;
use crate::model::Form;
use crate::radix;
use std::collections::{BTreeSet, HashMap};

/// The most cells of a step.
const MOST_CELLS: usize = 1 << 14;

impl<'s> FiniteRest<'s> {
    /// The sums over some slots, each of which is the left-hand side of a part alone; `hidden` are the slots without an observation.
    /// Slots whose tables would be too large are left out.
    pub(in super::super) fn new(
        setting: &'s Setting<'s>,
        parts: &[Summand],
        slots: &BTreeSet<usize>,
        hidden: &dyn Fn(usize) -> bool,
    ) -> Self {
        let mut slots = slots.clone();
        loop {
            match Self::of(setting, parts, &slots, hidden) {
                Ok(rest) => return rest,
                Err(large) => slots.retain(|slot| !large.contains(slot)),
            }
        }
    }

    /// `Err` are slots whose tables would be too large.
    fn of(
        setting: &'s Setting<'s>,
        parts: &[Summand],
        slots: &BTreeSet<usize>,
        hidden: &dyn Fn(usize) -> bool,
    ) -> Result<Self, BTreeSet<usize>> {
        let is_summed = |slot: usize| slots.contains(&slot);
        let count = |slot: usize| setting.count(setting.variable_of(slot));
        let numbers: HashMap<usize, u32> = slots.iter().copied().zip(0..).collect();
        let all: Vec<usize> = slots.iter().copied().collect();
        let scopes: Vec<Vec<usize>> = parts.iter().map(|part| part.scope(&is_summed)).collect();
        let numbered: Vec<Vec<u32>> =
            scopes.iter().map(|scope| scope.iter().map(|slot| numbers[slot]).collect()).collect();
        let cardinality = all.iter().map(|slot| count(*slot) as f64).collect();
        let away: Vec<u32> = (0..all.len() as u32).collect();
        let order = elimination::order(cardinality, &numbered, &away).variables;
        let mut rest = Self {
            setting,
            templates: Vec::new(),
            tables: Vec::new(),
            clumps: Vec::new(),
            places: HashMap::new(),
            cells: 0,
        };
        let mut known = HashMap::new();
        // With each factor of the product, its slots, and whether it is a table or an earlier sum.
        let mut product: Vec<(Vec<usize>, usize, bool)> = Vec::new();
        let mut users: HashMap<usize, BTreeSet<usize>> = HashMap::new();
        for (part, scope) in parts.iter().zip(scopes).filter(|(_, scope)| !scope.is_empty()) {
            let table = rest.table(part, &scope, hidden, &mut known);
            scope.iter().for_each(|slot| users.entry(*slot).or_default().extend([product.len()]));
            product.push((scope, table, true));
        }
        let mut steps = Vec::new();
        let mut sums = 0;
        for slot in order.into_iter().map(|number| all[number as usize]) {
            let inside = users.remove(&slot).unwrap_or_default();
            let union: BTreeSet<usize> =
                inside.iter().flat_map(|at| product[*at].0.iter().copied()).collect();
            let scope: Vec<usize> = union.iter().copied().filter(|own| *own != slot).collect();
            let extents: Vec<usize> = scope.iter().chain([&slot]).map(|slot| count(*slot)).collect();
            let cells = extents.iter().try_fold(1usize, |cells, extent| cells.checked_mul(*extent));
            let Some(cells) = cells.filter(|cells| *cells <= MOST_CELLS) else { return Err(union) };
            let strides = |own: &[usize]| {
                let stride = |slot: &usize| radix::stride(own, slot, |slot| count(*slot));
                scope.iter().chain([&slot]).map(stride).collect::<Vec<usize>>()
            };
            let (mut tables, mut earlier) = (Vec::new(), Vec::new());
            for at in &inside {
                let (own, number, is_table) = &product[*at];
                for slot in own {
                    users.entry(*slot).or_default().remove(at);
                }
                if *is_table { &mut tables } else { &mut earlier }.push((*number, strides(own)));
            }
            scope.iter().for_each(|slot| users.entry(*slot).or_default().extend([product.len()]));
            product.push((scope.clone(), steps.len(), false));
            let cells = cells / count(slot).max(1);
            steps.push(Step { slot, count: count(slot), scope, tables, sums: earlier, start: sums, cells });
            sums += cells;
        }
        rest.gather(steps);
        rest.find_alone();
        Ok(rest)
    }

    /// Adds the table of a part; returns its number.
    fn table(
        &mut self,
        part: &Summand,
        scope: &[usize],
        hidden: &dyn Fn(usize) -> bool,
        known: &mut HashMap<Vec<u64>, usize>,
    ) -> usize {
        let setting = self.setting;
        let source = match part {
            Summand::Likelihood(_, likelihoods) => {
                Source::Likelihood(likelihoods.iter().map(|likelihood| likelihood.ln()).collect())
            }
            Summand::Instance(instance, reads) => {
                let left = instance.left[0];
                let own = scope.contains(&left);
                let parents: Vec<usize> = scope.iter().copied().filter(|slot| *slot != left).collect();
                // Summed slots are distinguished by their places alone.
                let place = |slot: usize| match scope.iter().position(|own| *own == slot) {
                    Some(at) => u64::MAX - at as u64,
                    None => slot as u64,
                };
                let mut key =
                    vec![instance.factor.position() as u64, instance.component as u64, parents.len() as u64];
                let form = setting.form_at(instance);
                form.each_expression(&mut |id| key.extend(signature(setting, id, instance, &place)));
                key.extend(setting.looked_up(instance).into_iter().map(place));
                if form.couples() || matches!(form, Form::Weights(_)) {
                    key.push(left as u64);
                }
                let inputs = || {
                    let drawn = reads.iter().copied().filter(|slot| hidden(*slot) && !scope.contains(slot));
                    drawn.collect::<Vec<usize>>()
                };
                let template = *known.entry(key).or_insert_with(|| {
                    let (instance, inputs) = (instance.clone(), inputs());
                    self.templates.push(Template { instance, parents, inputs, alone: false });
                    self.templates.len() - 1
                });
                if own { Source::Distributed(template) } else { Source::At(template, left, hidden(left)) }
            }
        };
        let cells = scope.iter().map(|slot| setting.count(setting.variable_of(*slot))).product();
        self.tables.push(Table { source, start: self.cells, cells });
        self.cells += cells;
        self.tables.len() - 1
    }

    /// Finds the templates that one observed instance alone uses.
    fn find_alone(&mut self) {
        let mut users = vec![(0, true); self.templates.len()];
        for table in &self.tables {
            match table.source {
                Source::Distributed(template) => users[template].1 = false,
                Source::At(template, _, changes) => {
                    users[template].0 += 1;
                    users[template].1 &= !changes;
                }
                Source::Likelihood(_) => {}
            }
        }
        let alone = users.into_iter().map(|(count, observed)| count == 1 && observed);
        self.templates.iter_mut().zip(alone).for_each(|(template, alone)| template.alone = alone);
    }

    /// Parts the steps into those that do not depend on each other.
    fn gather(&mut self, steps: Vec<Step>) {
        // The step that sums each step's result, or none.
        let mut next: Vec<Option<usize>> = vec![None; steps.len()];
        for (number, step) in steps.iter().enumerate() {
            step.sums.iter().for_each(|(earlier, _)| next[*earlier] = Some(number));
        }
        let mut clumps = vec![0; steps.len()];
        for number in (0..steps.len()).rev() {
            clumps[number] = match next[number] {
                Some(next) => clumps[next],
                None => {
                    self.clumps.push((Vec::new(), Vec::new()));
                    self.clumps.len() - 1
                }
            };
        }
        // Sums are named by their place in their clump.
        let mut places = vec![0; steps.len()];
        for (number, mut step) in steps.into_iter().enumerate() {
            let (tables, own) = &mut self.clumps[clumps[number]];
            places[number] = own.len();
            step.sums.iter_mut().for_each(|(earlier, _)| *earlier = places[*earlier]);
            tables.extend(step.tables.iter().map(|(table, _)| *table));
            self.places.insert(step.slot, clumps[number]);
            own.push(step);
        }
    }
}
