//! The join tree, compared with enumeration.
//!
//! In: a finite program and the hard and virtual evidence of an ask. Out: pass or fail of the posteriors of all
//! variables, ln P(evidence), and the most probable assignment. Invariant: sums and maxima over all assignments.

use crate::enumerate::{Ask, Evidence, is_possible, ln_sum_of};
use crate::program::{Assignment, Program};
use crate::question::near;
use bp_core::compiler::error::Error;
use bp_core::compiler::model::Model;
use bp_core::compiler::strategies::join_tree::{Marginals, Named, most_probable};

/// Whether the join tree's answers equal the sums over all assignments.
pub(crate) fn verdict(
    program: &Program,
    model: &Model,
    all: &[(Assignment, f64)],
    ask: &Ask,
) -> Result<(), String> {
    let (mut values, mut likelihoods) = (Vec::new(), Vec::new());
    let mut weighed = all.to_vec();
    for (variable, evidence) in &ask.known {
        let slots = program.slots_of(*variable);
        match evidence {
            Evidence::Hard(ordinals) => {
                for (slot, ordinal) in slots.zip(ordinals) {
                    values.push((program.slot_name(slot), program.value(*variable, *ordinal)));
                    weighed.retain(|(at, _)| at[slot] == *ordinal as f64);
                }
            }
            Evidence::Virtual(weights) => {
                likelihoods.push((program.slot_name(slots.start), weights.clone()));
                weighed.iter_mut().for_each(|(at, ln)| *ln += weights[at[slots.start] as usize].ln());
            }
            _ => {}
        }
    }
    weighed.retain(|(_, ln)| is_possible(*ln));
    let total = ln_sum_of(&weighed, |_| true);
    let named = Named::new(model.clone(), &[]).map_err(|error| format!("join tree: {error}"))?;
    let evidence = named
        .evidence(
            values.iter().map(|(name, value)| (name.as_str(), value.as_str())),
            likelihoods.iter().map(|(name, weights)| (name.as_str(), weights.as_slice())),
        )
        .map_err(|error| format!("join tree: {error}"))?;
    let given: Vec<usize> = evidence.hard.iter().map(|(one, _)| *one).collect();
    let weighed_by: Vec<usize> = evidence.likelihoods.iter().map(|(one, _)| *one).collect();
    let marginals = Marginals::new(&named.network, &given, &weighed_by, &named.shown())
        .map_err(|error| format!("join tree: {error}"))?;
    let mut session = marginals.session();
    match session.ask(&evidence) {
        Err(Error::Impossible(_) | Error::Contradiction { .. }) if !is_possible(total) => return Ok(()),
        Err(error) => return Err(format!("join tree: {error}; ln P(evidence) = {total}")),
        Ok(()) if !is_possible(total) => return Err("join tree: impossible evidence was answered".to_owned()),
        Ok(()) => {}
    }
    if !near(session.ln_evidence(), total) {
        return Err(format!("join tree: ln P = {}, expected {total}", session.ln_evidence()));
    }
    for slot in 0..program.slots() {
        let number = named.number_of(&program.slot_name(slot)).map_err(|error| error.to_string())?;
        for (value, found) in session.posterior(number, &evidence).into_iter().enumerate() {
            let expected = (ln_sum_of(&weighed, |at| at[slot] == value as f64) - total).exp();
            if !near(found, expected) {
                let name = program.slot_name(slot);
                return Err(format!("join tree: {name}, value {value}: {found}, expected {expected}"));
            }
        }
    }
    let (assignment, _) =
        most_probable(&named.network, &evidence).map_err(|error| format!("mpe: {error}"))?;
    let chosen = weighed.iter().find(|(at, _)| {
        (0..program.slots()).all(|slot| {
            let number = named.number_of(&program.slot_name(slot)).expect("it was there above");
            at[slot] == assignment[number] as f64
        })
    });
    let best = weighed.iter().map(|(_, ln)| *ln).fold(f64::NEG_INFINITY, f64::max);
    match chosen {
        Some((_, ln)) if near((ln - best).exp(), 1.0) => Ok(()),
        other => Err(format!("mpe: {assignment:?} has ln P = {:?} of {best}", other.map(|(_, ln)| ln))),
    }
}
