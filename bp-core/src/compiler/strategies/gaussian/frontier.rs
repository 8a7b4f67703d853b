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
    let mut values = vec![f64::NAN; setting.slots()];
    observed.iter().for_each(|(slot, value)| values[*slot] = *value);
    let is_determined = |(slot, _): &(usize, f64)| equations.of(*slot).deviation == 0.0;
    let law = NormalLaw::new(observed.iter().any(is_determined));
    let mut uses = vec![0; setting.slots()];
    for slot in &slots {
        equations.of(*slot).parents.iter().for_each(|(parent, _)| uses[*parent] += 1);
    }
    let mut frontier = Frontier { slots: Vec::new(), rows: vec![usize::MAX; setting.slots()], law };
    let question = setting.model.ask_text(&plan.asks[0]);
    let mut ln_evidence = 0.0;
    for slot in equations.ordered(&slots) {
        let equation = equations.of(slot);
        frontier.enter(slot, equation);
        if !values[slot].is_nan() {
            let (row, name) = (frontier.rows[slot], setting.slot_name(slot));
            ln_evidence += observe(&mut frontier.law, row, values[slot], &name, &question)?;
        }
        equation.parents.iter().for_each(|(parent, _)| uses[*parent] -= 1);
        for slot in equation.parents.iter().map(|(parent, _)| *parent).chain([slot]) {
            if uses[slot] == 0 && !kept[slot] {
                frontier.leave(slot);
            }
        }
        // Seldom, so that its cost is shared by as many slots as it goes through.
        if frontier.law.noises() > 2 * frontier.law.len() + 8 {
            frontier.law.reduce();
        }
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
