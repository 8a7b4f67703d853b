//! What a Markov chain does with each part of a route.
//!
//! In: the instances of a route, and which slots are observed. Out: what is needed, what is summed, and the [`Site`]s of what is
//! drawn. Invariant: a slot on which nothing observed depends is no site.

use super::blanket::{Node, Site};
use super::compiled::Terms;
use super::finite_rest::{FiniteRest, Summand};
use crate::analysis::is_linear_in;
use crate::distribution::{Instance, Setting};
use crate::door::Advice;
use crate::error::Error;
use crate::ids::VariableId;
use crate::model::{Form, Model};
use crate::sample::Observations;
use crate::strategies::weighting::Step;
use std::collections::BTreeSet;

/// An instance of a route.
pub(super) struct Part<'p> {
    pub(super) instance: &'p Instance,
    /// The Dirac that is solved for its left-hand side.
    pub(super) dirac: Option<&'p Instance>,
    pub(super) reads: BTreeSet<usize>,
}

impl<'p> Part<'p> {
    pub(super) fn of(setting: &Setting<'_>, step: &'p Step) -> Vec<Self> {
        let of = |instance: &'p Instance| {
            let mut reads = setting.reads(instance);
            if let Some(dirac) = &step.dirac {
                reads.extend(setting.reads(dirac));
                reads.retain(|slot| !instance.left.contains(slot));
            }
            Self { instance, dirac: step.dirac.as_ref(), reads }
        };
        step.instances.iter().map(of).collect()
    }
}

/// Some parts of a route, and their slots and those that they read.
pub(super) struct Behind {
    pub(super) parts: Vec<bool>,
    pub(super) slots: BTreeSet<usize>,
}

/// The parts that some slots depend on, and those that matter by themselves with what these depend on.
pub(super) fn behind(
    parts: &[Part<'_>],
    mut slots: BTreeSet<usize>,
    matters: &dyn Fn(&Part<'_>) -> bool,
) -> Behind {
    let mut found = vec![false; parts.len()];
    let mut more = true;
    // Children come after their parents, except within a family whose elements depend on later ones.
    while more {
        more = false;
        for (number, part) in parts.iter().enumerate().rev() {
            let left = &part.instance.left;
            if !found[number] && (left.iter().any(|slot| slots.contains(slot)) || matters(part)) {
                slots.extend(left);
                slots.extend(&part.reads);
                (found[number], more) = (true, true);
            }
        }
    }
    Behind { parts: found, slots }
}

fn is_finite(setting: &Setting<'_>, slot: usize) -> bool {
    setting.model.variables[setting.variable_of(slot)].domain.is_finite()
}

/// Whether a form determines its value for all values of its parents.
pub(super) fn is_point(form: &Form, component: usize) -> bool {
    match form {
        Form::Dirac(_) => true,
        Form::Dirichlet(parameters) => component + 1 == parameters.len(),
        Form::If { then, otherwise, .. } => is_point(then, component) && is_point(otherwise, component),
        _ => false,
    }
}

/// Whether a form determines its value for some values of its parents.
fn may_be_point(form: &Form, component: usize) -> bool {
    let mut found = is_point(form, component);
    form.each_part(&mut |part| found |= may_be_point(part, component));
    found
}

/// Whether a form gives counts that are tied to each other, for some values of its parents.
fn may_count(form: &Form) -> bool {
    let mut found = matches!(form, Form::Multinomial { .. });
    form.each_part(&mut |part| found |= may_count(part));
    found
}

/// The sums over finite slots that need not be drawn: each alone on the left-hand side of its factor, and read only where its value
/// can be summed over.
pub(super) fn summed<'s, 'p>(
    setting: &'s Setting<'s>,
    needed: impl Iterator<Item = &'p Part<'p>>,
    observations: &Observations,
    is_integrated: &dyn Fn(&Part<'_>) -> bool,
) -> FiniteRest<'s> {
    let hidden = |slot: usize| observations.values[slot].is_nan();
    let (mut slots, mut excluded, mut summands) = (BTreeSet::new(), BTreeSet::new(), Vec::new());
    for part in needed {
        let left = &part.instance.left;
        let form = setting.form_at(part.instance);
        let is_real = !is_finite(setting, left[0]);
        let moves =
            is_real && left.iter().any(|slot| hidden(*slot)) && is_point(form, part.instance.component);
        if left.len() > 1 || part.dirac.is_some() || moves || is_integrated(part) {
            excluded.extend(left.iter().chain(&part.reads).copied());
            continue;
        }
        slots.extend(left.iter().copied().filter(|slot| !is_real && hidden(*slot)));
        summands.push(Summand::Instance(part.instance.clone(), part.reads.clone()));
    }
    slots.retain(|slot| !excluded.contains(slot));
    let likelihoods = observations.likelihoods.iter().filter(|(slot, _)| slots.contains(slot));
    summands.extend(likelihoods.map(|(slot, likelihoods)| Summand::Likelihood(*slot, likelihoods.clone())));
    FiniteRest::new(setting, &summands, &slots, &hidden)
}

/// Refuses a left-hand side of which single-site moves cannot change the slots that are not observed.
pub(super) fn check_moves(
    setting: &Setting<'_>,
    form: &Form,
    component: usize,
    slots: &[usize],
) -> Result<(), Error> {
    if let Some(slot) = slots.first().filter(|_| may_count(form)) {
        return Err(stuck(setting, *slot, "is a count of `multinomial`, tied to the others by their sum"));
    }
    match slots.iter().find(|slot| !is_finite(setting, **slot)) {
        Some(slot) if may_be_point(form, component) => {
            Err(stuck(setting, *slot, "has a `dirac` in part of its form"))
        }
        _ => Ok(()),
    }
}

pub(super) fn site(setting: &Setting<'_>, nodes: &[Node], reads: &[BTreeSet<usize>], slot: usize) -> Site {
    let mut moved = BTreeSet::from([slot]);
    let mut blanket = Vec::new();
    let (mut moves_rest, mut clumps) = (false, BTreeSet::new());
    for (position, node) in nodes.iter().enumerate() {
        let own = match node {
            Node::Weighed(instance) | Node::Integrated(instance) | Node::Summed(instance, _) => {
                instance.left.contains(&slot)
            }
            _ => false,
        };
        if !own && reads[position].is_disjoint(&moved) {
            continue;
        }
        match node {
            Node::Integrated(_) => {
                moves_rest = true;
                continue;
            }
            Node::Summed(_, clump) => {
                clumps.insert(*clump);
                continue;
            }
            _ => {}
        }
        blanket.push(position);
        if let Node::Determined(instance) | Node::Solved(instance, _) = node {
            moved.extend(&instance.left);
        }
    }
    let variable = setting.variable_of(slot);
    let moved: BTreeSet<VariableId> = moved.into_iter().map(|slot| setting.variable_of(slot)).collect();
    let is_normal = blanket.iter().all(|node| node_is_linear(setting.model, &nodes[*node], &moved));
    let count = is_finite(setting, slot).then(|| setting.count(variable));
    let is_normal = is_normal && count.is_none() && !moves_rest && clumps.is_empty();
    Site {
        slot,
        count,
        blanket,
        is_normal,
        moves_rest,
        clumps: clumps.into_iter().collect(),
        terms: Terms::default(),
    }
}

fn node_is_linear(model: &Model, node: &Node, moved: &BTreeSet<VariableId>) -> bool {
    let (Node::Weighed(instance) | Node::Determined(instance)) = node else { return false };
    let factor = &model.factors[instance.factor];
    !model.variables[factor.left[0].variable].domain.is_finite() && is_linear_in(model, &factor.form, moved)
}

pub(super) fn stuck(setting: &Setting<'_>, slot: usize, why: &str) -> Error {
    let name = setting.slot_name(slot);
    let reason = format!(
        "`{name}` {why}; Gibbs sampling would never leave where it begins: add some noise, \
         `normal(…, deviation)`, or take `{}`",
        Advice::By("weighting")
    );
    Error::Unplanned { question: setting.model.name.clone(), reason }
}
