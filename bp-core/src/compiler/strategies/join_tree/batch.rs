//! Many cases of evidence for one network.
//!
//! In: cases. Out: for each its marginals and ln P(evidence), or the error. Invariant: the answers equal those of one
//! case after the other, in the order of the cases, for any number of threads.
//!
//! Cases that observe the same variables share a plan, in which these variables are sliced away. Where the cases have
//! too many such patterns, all share one plan, in which evidence is a likelihood of 0 and 1.

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

/// The least number of cases with the same pattern that get a plan of their own.
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
    let pattern = |case: &NetworkEvidence| {
        let mut hard: Vec<usize> = case.hard.iter().map(|(variable, _)| *variable).collect();
        hard.sort_unstable();
        hard
    };
    let mut counts: HashMap<Vec<usize>, usize> = HashMap::new();
    cases.iter().for_each(|case| *counts.entry(pattern(case)).or_default() += 1);
    let mut patterns: Vec<(Vec<usize>, usize)> =
        counts.into_iter().filter(|(_, count)| *count >= WORTH_A_PLAN).collect();
    patterns.sort_by(|one, other| other.1.cmp(&one.1).then_with(|| one.0.cmp(&other.0)));
    patterns.truncate(MOST_PLANS);
    let weighed = cases.iter().flat_map(|case| case.likelihoods.iter().map(|(variable, _)| *variable));
    let weighed: HashSet<usize> = weighed.collect();
    let plan = |given: &[usize], weighed: &HashSet<usize>| {
        let mut weighed: Vec<usize> = weighed.iter().copied().filter(|one| !given.contains(one)).collect();
        weighed.sort_unstable();
        Marginals::new(network, given, &weighed, wanted)
    };
    let mut plans: Vec<Marginals> =
        patterns.iter().map(|(given, _)| plan(given, &weighed)).collect::<Result<_, _>>()?;
    let own: HashMap<Vec<usize>, usize> =
        patterns.into_iter().enumerate().map(|(number, (pattern, _))| (pattern, number)).collect();
    // All other cases share a plan in which every variable observed in one of them is weighed.
    let others = cases.iter().filter(|case| !own.contains_key(&pattern(case)));
    let observed: HashSet<usize> = others.flat_map(&pattern).chain(weighed.iter().copied()).collect();
    let general = plans.len();
    plans.push(plan(&[], &observed)?);
    let sessions = || plans.iter().map(|_| None).collect::<Vec<Option<MarginalsSession<'_>>>>();
    let answers = (cases.par_iter())
        .map_init(sessions, |sessions, case| {
            let number = own.get(&pattern(case)).copied().unwrap_or(general);
            let session = sessions[number].get_or_insert_with(|| plans[number].session());
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
