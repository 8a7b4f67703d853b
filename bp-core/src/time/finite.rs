//! Questions over time to programs whose carried variables are finite.
//!
//! In: a question and what was observed at each instant. Out: what is believed of the searched slots. Invariant: exact, for
//! whatever is impossible at the start, in a transition or in an observation.

use super::chain::Chain;
use super::{Answered, Instant, Told, What};
use crate::distribution::Setting;
use crate::error::Error;
use crate::model::{Evidence, Reduction};
use crate::plan::OverTime;

pub(super) fn answer(
    setting: &Setting<'_>,
    route: &OverTime,
    instants: &[Instant],
) -> Result<Answered, Error> {
    let searched: Vec<usize> =
        route.ask.searched.iter().flat_map(|item| setting.slots_of(item.variable)).collect();
    let likelihoods = (route.ask.known.iter()).filter_map(|known| match &known.evidence {
        Evidence::Virtual(weights) => Some((setting.slots_of(known.variable).start, weights.clone())),
        _ => None,
    });
    let asked = setting.model.ask_text(&route.ask);
    let mut chain = Chain::new(setting, &route.carried, searched.clone(), likelihoods.collect(), asked)?;
    let ahead = match route.ask.reduction {
        Reduction::Predict(steps) => steps,
        _ => 0,
    };
    let forward = chain.forward(instants, ahead)?;
    let counts: Vec<usize> = searched.iter().map(|slot| chain.count(*slot)).collect();
    let told = |instant: usize, probabilities: Vec<f64>| Told {
        instant: instant + 1,
        what: What::Probabilities(searched.clone(), rows(&counts, &probabilities)),
    };
    let several = matches!(route.ask.reduction, Reduction::Smooth | Reduction::Sequence);
    if !several {
        let probabilities = chain.at_last(&forward, |joint| joint.distribution(&searched))?;
        let last = instants.len() + ahead - 1;
        return Ok(Answered { told: vec![told(last, probabilities)], ln_evidence: forward.ln_evidence });
    }
    let mut all = Vec::with_capacity(instants.len());
    chain.backward(&forward, |instant, joint| {
        all.push(told(instant, joint.distribution(&searched)?));
        Ok(())
    })?;
    all.reverse();
    if route.ask.reduction == Reduction::Sequence {
        for (told, chosen) in all.iter_mut().zip(chain.most_likely(&forward)?) {
            let What::Probabilities(_, rows) = &mut told.what else { continue };
            rows.retain(|(values, _)| {
                values.iter().zip(&chosen).all(|(value, chosen)| *value == *chosen as f64)
            });
        }
    }
    Ok(Answered { told: all, ln_evidence: forward.ln_evidence })
}

/// The values of slots with so many values each, the last one fastest, beside their probabilities.
fn rows(counts: &[usize], probabilities: &[f64]) -> Vec<(Vec<f64>, f64)> {
    let row = |(position, p): (usize, &f64)| {
        let (mut rest, mut values) = (position, vec![0.0; counts.len()]);
        for (value, count) in values.iter_mut().zip(counts).rev() {
            *value = (rest % count) as f64;
            rest /= count;
        }
        (values, *p)
    };
    probabilities.iter().enumerate().map(row).collect()
}
