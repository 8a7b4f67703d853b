//! One conditioning of a program of one instant, element by element: only slots that are still needed are kept.
//!
//! In: a [`Gaussian`] plan that carries nothing, a setting, the observations. Out: the law of each ask. Invariant: a
//! value enters after those that it depends on, is conditioned at once where it is observed, and leaves when nothing
//! depends on it any more: a chain of n variables takes n steps and the memory of two, a plate of n rows n steps and
//! the memory of what they share.

use super::equations::{Equation, Equations, NEEDED};
use super::filter::{observe, proper};
use super::{Gaussian, NormalLaw};
use crate::distribution::Setting;
use crate::error::Error;
use crate::ids::FactorId;
use std::collections::{BTreeSet, HashMap};

/// The laws of the searched slots, and ln of the density of the observations.
pub(crate) struct Conditioned {
    /// One for each ask.
    pub(crate) laws: Vec<NormalLaw>,
    pub(crate) ln_evidence: f64,
}

impl Equations<'_> {
    /// An order, parents first, in which few slots are needed together: the children of a slot follow it at once, those
    /// without children first.
    fn ordered(&self, slots: &[usize]) -> Vec<usize> {
        let mut places = vec![usize::MAX; self.made.len()];
        slots.iter().enumerate().for_each(|(place, slot)| places[*slot] = place);
        let mut children: Vec<Vec<usize>> = vec![Vec::new(); slots.len()];
        let mut waiting = vec![0; slots.len()];
        let mut height = vec![0; slots.len()];
        for (place, slot) in slots.iter().enumerate().rev() {
            for (parent, _) in &self.of(*slot).parents {
                let parent = places[*parent];
                children[parent].push(place);
                waiting[place] += 1;
                height[parent] = height[parent].max(height[place] + 1);
            }
        }
        // The last of the stack is next: of the first slots the one with the most children.
        let mut stack: Vec<usize> = (0..slots.len()).rev().filter(|place| waiting[*place] == 0).collect();
        stack.sort_by_key(|place| children[*place].len());
        let mut order = Vec::with_capacity(slots.len());
        while let Some(place) = stack.pop() {
            order.push(slots[place]);
            let begin = stack.len();
            for child in &children[place] {
                waiting[*child] -= 1;
                if waiting[*child] == 0 {
                    stack.push(*child);
                }
            }
            stack[begin..].sort_by_key(|child| std::cmp::Reverse(height[*child]));
        }
        order
    }
}

/// The slots that are still needed, with their normal law.
struct Frontier {
    slots: Vec<usize>,
    /// The row of each slot; `usize::MAX` where it has none.
    rows: Vec<usize>,
    law: NormalLaw,
}

impl Frontier {
    fn enter(&mut self, slot: usize, equation: &Equation) {
        let terms = equation.parents.iter().map(|(parent, coefficient)| (self.rows[*parent], *coefficient));
        let terms: Vec<(usize, f64)> = terms.collect();
        self.rows[slot] = self.law.len();
        self.slots.push(slot);
        self.law.extend(&terms, equation.constant, equation.deviation);
    }

    fn leave(&mut self, slot: usize) {
        let row = std::mem::replace(&mut self.rows[slot], usize::MAX);
        self.slots.swap_remove(row);
        self.law.swap_remove(row);
        if let Some(moved) = self.slots.get(row) {
            self.rows[*moved] = row;
        }
    }
}

/// What the steps through the slots read.
struct Pass<'p> {
    setting: &'p Setting<'p>,
    equations: &'p Equations<'p>,
    observed: &'p [(usize, f64)],
    /// The slots that the law of the searched variables reads.
    kept: &'p [bool],
    question: &'p str,
}

impl Pass<'_> {
    /// The law of the slots that are kept, ln of the density of the observations, and whether some of them determine
    /// another.
    fn run(&self, order: Vec<usize>) -> Result<(Frontier, f64, bool), Error> {
        let (equations, setting) = (self.equations, self.setting);
        let mut values = vec![f64::NAN; setting.slots()];
        self.observed.iter().for_each(|(slot, value)| values[*slot] = *value);
        let has_dirac = self.observed.iter().any(|(slot, _)| equations.of(*slot).deviation == 0.0);
        let mut uses = vec![0; setting.slots()];
        for slot in &order {
            equations.of(*slot).parents.iter().for_each(|(parent, _)| uses[*parent] += 1);
        }
        let law = NormalLaw::new(has_dirac);
        let mut frontier = Frontier { slots: Vec::new(), rows: vec![usize::MAX; setting.slots()], law };
        let (mut ln_evidence, mut determined) = (0.0, false);
        for slot in order {
            let equation = equations.of(slot);
            frontier.enter(slot, equation);
            if !values[slot].is_nan() {
                let (row, name) = (frontier.rows[slot], setting.slot_name(slot));
                let before = frontier.law.noises() + frontier.law.flats();
                ln_evidence += observe(&mut frontier.law, row, values[slot], &name, self.question)?;
                determined |= frontier.law.noises() + frontier.law.flats() == before;
            }
            equation.parents.iter().for_each(|(parent, _)| uses[*parent] -= 1);
            for slot in equation.parents.iter().map(|(parent, _)| *parent).chain([slot]) {
                if uses[slot] == 0 && !self.kept[slot] {
                    frontier.leave(slot);
                }
            }
            // Seldom, so that its cost is shared by as many slots as it goes through.
            if frontier.law.noises() > 2 * frontier.law.len() + 8 {
                frontier.law.reduce();
            }
        }
        Ok((frontier, ln_evidence, determined))
    }
}

/// The joint law of the searched variables, given the observed slots and their values.
///
/// # Errors
/// A standard deviation that is not positive; a mean that is not finite; an observation that others exclude.
pub(super) fn condition(
    setting: &Setting<'_>,
    plan: &Gaussian,
    observed: &[(usize, f64)],
) -> Result<Conditioned, Error> {
    let mut equations = Equations::new(setting, plan.sources.iter())?;
    let mut marks = vec![0; setting.slots()];
    let mut slots = Vec::new();
    for (slot, _) in observed {
        equations.add_with_parents(*slot, (&mut marks, NEEDED), &mut slots)?;
    }
    // The searched slots and their ancestors, beside those of the observations.
    let mut kept = vec![false; setting.slots()];
    let mut searched = Vec::new();
    for (number, ask) in plan.asks.iter().enumerate() {
        let own: Vec<usize> = ask.searched.iter().flat_map(|item| setting.slots_of(item.variable)).collect();
        let mut extra = Vec::new();
        for slot in &own {
            equations.add_with_parents(*slot, (&mut marks, NEEDED + 1 + number), &mut extra)?;
        }
        let parents = extra.iter().flat_map(|slot| &equations.of(*slot).parents).map(|(parent, _)| *parent);
        parents.chain(own.iter().copied()).for_each(|slot| kept[slot] = true);
        searched.push((own, extra));
    }
    let question = setting.model.ask_text(&plan.asks[0]);
    let pass = Pass { setting, equations: &equations, observed, kept: &kept, question: &question };
    let (mut frontier, mut ln_evidence, determined) = pass.run(equations.ordered(&slots))?;
    if determined {
        // A value that others determine has a probability in place of a density, so which of them comes first is
        // a part of what ln P says. The order of the decomposition is the same in every question and strategy.
        let factors: BTreeSet<FactorId> = plan.sources.iter().map(|source| source.factor).collect();
        let factors: Vec<FactorId> = factors.into_iter().collect();
        let of_setting = setting.in_order(&setting.model.parents_first(&factors))?;
        let place: HashMap<usize, usize> =
            of_setting.iter().enumerate().map(|(place, instance)| (instance.left[0], place)).collect();
        slots.sort_by_key(|slot| place.get(slot).copied());
        (frontier, ln_evidence, _) = pass.run(slots)?;
    }
    let (rows, noises) = (frontier.law.len(), frontier.law.noises());
    let mut laws = Vec::with_capacity(searched.len());
    for (own, extra) in searched {
        extra.iter().for_each(|slot| frontier.enter(*slot, equations.of(*slot)));
        proper(&frontier.law, observed.len(), &question)?;
        laws.push(frontier.law.select(own.iter().map(|slot| frontier.rows[*slot])));
        frontier.slots.truncate(rows);
        frontier.law.truncate(rows, noises);
    }
    Ok(Conditioned { laws, ln_evidence })
}
