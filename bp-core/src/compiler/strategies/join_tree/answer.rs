//! Answers of a join tree to questions over thousands of factors.
//!
//! In: a [`JoinTree`] route and the host's inputs. Out: the table of each ask, and ln P(evidence). Invariant: the
//! tables equal those that loops would compute: P(S | K) of each context sums to one, or is all zero where the context
//! is impossible.

use super::{self as join_tree, Absorbed, JoinTree, Network, NetworkEvidence, absorb, groups, joint};
use crate::distribution::Setting;
use crate::equation::{Binding, Group};
use crate::error::{Error, Impossible};
use crate::exec::Inputs;
use crate::ids::VariableId;
use crate::model::{Model, Value};
use crate::posterior::Table;
use crate::radix;
use crate::sample::Observations;
use crate::strategies::{Case, Found, Prepared};

/// Upper limit on the cells of a joint posterior.
const MOST_CELLS: f64 = 1e9;

impl Prepared for JoinTree {
    fn run(&self, model: &Model, case: &Case<'_>) -> Result<Vec<Found>, Error> {
        if self.group != Group::Tables {
            return groups::answers(model, self, case);
        }
        let tables = tables(model, self, case.inputs)?;
        Ok(tables.into_iter().map(|(table, ln_evidence)| Found::Table(table, ln_evidence)).collect())
    }
}

/// The table of each ask, in their order.
fn tables(
    model: &Model,
    route: &JoinTree,
    inputs: &Inputs<'_, f64>,
) -> Result<Vec<(Table, Option<f64>)>, Error> {
    let exact = &route.exact;
    let setting = Setting::new(model, inputs)?;
    let open: Vec<VariableId> = exact.each.iter().chain(&exact.searched).copied().collect();
    let wanted: Vec<usize> = open.iter().flat_map(|id| setting.slots_of(*id)).collect();
    let values = |id: &VariableId| (setting.count(*id) as f64).powf(setting.slots_of(*id).len() as f64);
    let all: f64 = open.iter().map(values).product();
    if all > MOST_CELLS {
        let help = "search or know fewer variables at once".to_owned();
        let name = model.ask_text(&exact.asks[0]);
        return Err(Error::TooLarge { name, cells: all, most: MOST_CELLS, help });
    }
    let (mut network, numbers) = Network::part(&setting, &route.factors, &wanted)?;
    let (evidence, observed) = evidence(&setting, route, &numbers)?;
    let extents: Vec<usize> =
        open.iter().flat_map(|id| setting.slots_of(*id).map(|_| setting.count(*id))).collect();
    let ask = &exact.asks[0];
    let with_question = |error: Error| match error {
        Error::Contradiction { .. } => Error::Impossible(Impossible {
            question: model.ask_text(ask),
            reason: setting.zero_factor(&observed),
        }),
        Error::TooLarge { cells, most, help, .. } => {
            Error::TooLarge { name: model.ask_text(ask), cells, most, help }
        }
        Error::TooLong { products, most, help, .. } => {
            Error::TooLong { question: model.ask_text(ask), products, most, help }
        }
        other => other,
    };
    let likelihoods = evidence.likelihoods.iter();
    network.tables.extend(likelihoods.map(|(variable, weights)| join_tree::FactorTable {
        variables: vec![*variable],
        values: weights.clone(),
    }));
    let Absorbed { network, numbers: left, ln_scale } = absorb(network, &evidence).map_err(with_question)?;
    let searched: Vec<usize> = wanted.iter().map(|slot| left[numbers[*slot]]).collect();
    let found = joint(&network, &NetworkEvidence::default(), &searched).map_err(with_question)?;
    let ln_evidence = found.ln_evidence + ln_scale;
    // A conditional distribution is the joint one divided by that of its context.
    let contexts = exact.each.iter().map(values).product::<f64>() as usize;
    let mut cells = found.probabilities;
    let width = cells.len() / contexts.max(1);
    for context in cells.chunks_mut(width.max(1)) {
        let total: f64 = context.iter().sum();
        if total > 0.0 {
            context.iter_mut().for_each(|p| *p /= total);
        }
    }
    let mut tables = Vec::new();
    for ask in &exact.asks {
        let own = |id: &VariableId| {
            exact.each.contains(id) || ask.searched.iter().any(|searched| searched.variable == *id)
        };
        let variables: Vec<VariableId> = open.iter().copied().filter(own).collect();
        let kept: Vec<bool> = open.iter().flat_map(|id| setting.slots_of(*id).map(|_| own(id))).collect();
        let (numbers, extents) = summed(&cells, &extents, &kept);
        let table = Table::read(model, (ask, model.ask_text(ask)), &variables, numbers, None, &extents);
        tables.push((table, exact.ln_evidence.then_some(ln_evidence)));
    }
    Ok(tables)
}

/// The evidence by the network's numbers, and the values of the observed slots.
pub(super) fn evidence(
    setting: &Setting<'_>,
    route: &JoinTree,
    numbers: &[usize],
) -> Result<(NetworkEvidence, Vec<f64>), Error> {
    let mut observations = Observations::none(setting);
    let mut evidence = NetworkEvidence::default();
    for (variable, binding) in &route.exact.bindings {
        let Binding::Value(value) = binding else { continue };
        let slots = setting.slots_of(*variable);
        match value {
            Value::Ordinal(ordinal) => observations.values[slots.clone()].fill(*ordinal as f64),
            Value::Real(number) => observations.observe(setting, slots.start, *number)?,
            Value::Vector(numbers) => observations.values[slots.clone()].copy_from_slice(numbers),
            Value::Given(name) => observations.give(setting, slots.clone(), name)?,
        }
        // Barren variables have no number in the network.
        let is_known = |slot: &usize| numbers[*slot] != usize::MAX && !observations.values[*slot].is_nan();
        let known = slots.filter(is_known);
        evidence.hard.extend(known.map(|slot| (numbers[slot], observations.values[slot] as usize)));
    }
    for (variable, weights) in &route.likelihoods {
        let number = numbers[setting.slots_of(*variable).start];
        if number != usize::MAX {
            evidence.likelihoods.push((number, weights.clone()));
        }
    }
    Ok((evidence, observations.values))
}

/// A table summed over all axes except those kept, and the extents of these.
fn summed(cells: &[f64], extents: &[usize], kept: &[bool]) -> (Vec<f64>, Vec<usize>) {
    if kept.iter().all(|kept| *kept) {
        return (cells.to_vec(), extents.to_vec());
    }
    let left: Vec<usize> =
        extents.iter().zip(kept).filter(|(_, kept)| **kept).map(|(extent, _)| *extent).collect();
    let mut sums = vec![0.0; left.iter().product()];
    for (position, cell) in cells.iter().enumerate() {
        let ordinals =
            radix::in_order(position, extents.iter().copied()).into_iter().zip(extents.iter().copied());
        let kept = ordinals.zip(kept).filter(|(_, kept)| **kept).map(|(digit, _)| digit);
        sums[radix::position(kept)] += cell;
    }
    (sums, left)
}
