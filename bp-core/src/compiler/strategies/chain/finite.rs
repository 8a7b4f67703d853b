//! Questions over time for programs whose carried variables are finite.
//!
//! In: a question and the observations of each instant. Out: the posterior of the searched slots. Invariant: the answer
//! is exact, also where the initial law, a transition or an observation has probability zero.

use super::{Chain, Forward};
use crate::distribution::Setting;
use crate::error::Error;
use crate::model::{Finding, Known, Statistic, When};
use crate::posterior::{Numbers, check_draws};
use crate::strategies::over_time::{
    Answered, Instant, InstantLaw, InstantPosterior, OverTime, Scope, Sequence, Weighed,
};

pub(crate) fn answer(
    setting: &Setting<'_>,
    route: &OverTime,
    (instants, weighed): (&[Instant], Vec<Vec<Weighed>>),
    scope: Scope,
    seed: u64,
) -> Result<Answered, Error> {
    let ask = route.ask();
    let searched: Vec<usize> = ask.searched.iter().flat_map(|item| setting.slots_of(item.variable)).collect();
    let mut chain = chain(setting, route)?;
    let are_weighed = weighed.iter().any(|instant| !instant.is_empty());
    chain.weighed = weighed;
    let forward = chain.forward(instants, ask.when.ahead())?;
    // One array for the posteriors of all instants.
    let last = instants.len() + ask.when.ahead();
    let is_whole = ask.when.is_every_instant() || scope == Scope::Each;
    let first = if is_whole { 0 } else { last - 1 };
    let place = |instant: usize, width: usize| (instant - first) * width..(instant - first + 1) * width;
    let mut numbers = Vec::new();
    let mut put = |instant: usize, own: &[f64]| {
        numbers.resize((last - first) * own.len(), 0.0);
        numbers[place(instant, own.len())].copy_from_slice(own);
    };
    if ask.when.is_every_instant() {
        chain.backward(&forward, |instant, joint| {
            put(instant, &joint.distribution(&searched)?);
            Ok(())
        })?;
    } else {
        for instant in first..last {
            put(instant, &chain.at(&forward, instant, |joint| joint.distribution(&searched))?);
        }
    }
    let (width, numbers) = (numbers.len() / (last - first).max(1), Numbers::from(numbers));
    let posterior = |instant| InstantPosterior {
        instant: instant + 1,
        law: InstantLaw::Finite(numbers.range(place(instant, width))),
    };
    let all = (first..last).map(posterior).collect();
    let mut sequences = Vec::new();
    if ask.when == When::Sequence {
        sequences = self::sequences(&mut chain, &forward, &ask.statistic, &searched, instants, seed)?;
    }
    // Sums of rounded logarithms may exceed 0, which the probability of finite observations does not.
    let is_finite =
        |(slot, _): &(usize, f64)| setting.model.variables[setting.variable_of(*slot)].domain.is_finite();
    let is_virtual = |known: &Known| matches!(known.evidence, Finding::Virtual(_));
    let is_event =
        instants.iter().flatten().all(is_finite) && !are_weighed && !ask.known.iter().any(is_virtual);
    let most = if is_event { 0.0 } else { f64::INFINITY };
    Ok(Answered { posteriors: all, sequences, ln_evidence: forward.ln_evidence.min(most) })
}

/// The chain that answers a route.
pub(crate) fn chain<'s>(setting: &Setting<'s>, route: &OverTime) -> Result<Chain<'s>, Error> {
    let searched = route.ask().searched.iter().flat_map(|item| setting.slots_of(item.variable));
    let likelihoods = (route.ask().known.iter()).filter_map(|known| match &known.evidence {
        Finding::Virtual(weights) => Some((setting.slots_of(known.variable).start, weights.clone())),
        _ => None,
    });
    let asked = setting.model.ask_text(route.ask());
    Chain::new(setting, &route.carried, searched.collect(), likelihoods.collect(), asked)
}

/// The sequences that a statistic requests.
fn sequences(
    chain: &mut Chain<'_>,
    forward: &Forward,
    statistic: &Statistic,
    searched: &[usize],
    instants: &[Instant],
    seed: u64,
) -> Result<Vec<Sequence>, Error> {
    if let Statistic::Best(count) | Statistic::Draw(count) = statistic {
        check_draws(|| chain.asked.clone(), *count as f64 * (instants.len() * searched.len()) as f64)?;
    }
    Ok(match statistic {
        Statistic::Best(count) => (chain.best(forward, *count)?.into_iter())
            .map(|(ln, values)| Sequence { probability: Some(ln.exp().min(1.0)), values })
            .collect(),
        Statistic::Draw(count) => (chain.drawn(forward, *count, seed)?.into_iter())
            .map(|values| Sequence { probability: None, values })
            .collect(),
        _ => {
            let values = chain.most_likely(forward)?;
            let mut probability = None;
            if *statistic == Statistic::Maximum {
                // P(sequence | observations) = P(sequence, observations) / P(observations).
                let known = |(instant, values): (&Instant, &Vec<usize>)| {
                    let own = searched.iter().zip(values).map(|(slot, value)| (*slot, *value as f64));
                    let mut all: Instant = instant.iter().copied().chain(own).collect();
                    all.sort_by_key(|(slot, _)| *slot);
                    all
                };
                let known: Vec<Instant> = instants.iter().zip(&values).map(known).collect();
                let ln = chain.forward(&known, 0)?.ln_evidence;
                probability = Some((ln - forward.ln_evidence).exp().min(1.0));
            }
            vec![Sequence { probability, values }]
        }
    })
}
