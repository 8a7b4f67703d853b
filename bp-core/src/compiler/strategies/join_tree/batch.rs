//! Many cases of evidence for one network.
//!
//! In: cases. Out: for each its marginals and ln P(evidence), or the error. Invariant: the answers equal those of one
//! case after the other, in the order of the cases, for any number of threads.
//!
//! Cases that observe the same variables share a plan, in which these variables are sliced away. Where the cases have
//! too many such patterns, the others share one plan, in which evidence is a likelihood of 0 and 1. The two kinds of plans
//! differ in their rounding; cases of one pattern have the same bits in any part of them.

use super::evidence::NetworkEvidence;
use super::network::Network;
use super::plan::{Marginals, MarginalsSession};
use crate::error::Error;
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};

/// The answer to one case.
#[derive(Clone, Debug, PartialEq)]
pub struct Posterior {
    /// ln P(evidence)
    pub ln_evidence: f64,
    /// The marginals of the wanted variables, one after the other.
    pub marginals: Vec<f64>,
}

/// The least number of cases with the same pattern that get a plan of their own, unless it is the only pattern.
const WORTH_A_PLAN: usize = 16;

/// Upper limit on the plans for single patterns.
const MOST_PLANS: usize = 64;

/// Answers every case. `done` is called after each, from any thread.
///
/// # Errors
/// Memory does not hold a plan.
pub fn answer_cases(
    network: &Network,
    cases: &[NetworkEvidence],
    wanted: &[usize],
    done: impl Fn() + Sync,
) -> Result<Vec<Result<Posterior, Error>>, Error> {
    // The observed variables of each case, by their number, and how many cases have them.
    let (mut patterns, mut counts) = (HashMap::new(), Vec::new());
    let number = |case: &NetworkEvidence| {
        let mut observed: Vec<usize> = case.hard.iter().map(|(variable, _)| *variable).collect();
        observed.sort_unstable();
        let number = *patterns.entry(observed).or_insert(counts.len());
        counts.resize(counts.len().max(number + 1), 0_usize);
        counts[number] += 1;
        number
    };
    let numbers: Vec<usize> = cases.iter().map(number).collect();
    let is_worth = |number: usize| counts.len() == 1 || counts[number] >= WORTH_A_PLAN;
    let mut own: Vec<(Vec<usize>, usize)> =
        patterns.into_iter().filter(|(_, number)| is_worth(*number)).collect();
    own.sort_by(|one, other| counts[other.1].cmp(&counts[one.1]).then_with(|| one.0.cmp(&other.0)));
    own.truncate(MOST_PLANS);
    let weighed = cases.iter().flat_map(|case| case.likelihoods.iter().map(|(variable, _)| *variable));
    let weighed: HashSet<usize> = weighed.collect();
    let plan = |given: &[usize], weighed: &HashSet<usize>| {
        let mut weighed: Vec<usize> = weighed.iter().copied().filter(|one| !given.contains(one)).collect();
        weighed.sort_unstable();
        Marginals::new(network, given, &weighed, wanted)
    };
    let mut plans: Vec<Marginals> =
        own.iter().map(|(given, _)| plan(given, &weighed)).collect::<Result<_, _>>()?;
    let general = plans.len();
    let mut plan_of = vec![general; counts.len()];
    own.iter().enumerate().for_each(|(plan, (_, number))| plan_of[*number] = plan);
    // All other cases share a plan in which every variable observed in one of them is weighed.
    if plan_of.contains(&general) {
        let others = cases.iter().zip(&numbers).filter(|(_, number)| plan_of[**number] == general);
        let observed = others.flat_map(|(case, _)| case.hard.iter().map(|(variable, _)| *variable));
        plans.push(plan(&[], &observed.chain(weighed.iter().copied()).collect())?);
    }
    let sessions = || plans.iter().map(|_| None).collect::<Vec<Option<MarginalsSession<'_>>>>();
    let answers = (cases.par_iter().zip(&numbers))
        .map_init(sessions, |sessions, (case, number)| {
            let plan = plan_of[*number];
            let session = sessions[plan].get_or_insert_with(|| plans[plan].session());
            let answer = session.ask(case).map(|()| Posterior {
                ln_evidence: session.ln_evidence(),
                marginals: wanted.iter().flat_map(|one| session.posterior(*one, case)).collect(),
            });
            done();
            answer
        })
        .collect();
    Ok(answers)
}
