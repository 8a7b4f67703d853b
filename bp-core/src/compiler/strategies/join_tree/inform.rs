//! Joint posteriors, and the value of an observation.
//!
//! In: a network, evidence, and some variables. Out: their joint posterior; for each candidate observation the
//! information that it is expected to give about them. Invariant: a joint posterior is computed for each combination of
//! values of all variables but the last, on one plan: P(a, b | e) = P(a, e) / P(e) · P(b | a, e). So it takes no more
//! memory than the marginals.

use super::evidence::NetworkEvidence;
use super::network::Network;
use super::plan::Marginals;
use crate::error::Error;
use crate::operators;
use crate::radix;
use std::f64::consts::LN_2;

/// Upper limit on the products of all runs together; each run conditions on one combination of values.
const MOST_PRODUCTS: f64 = 2e10;

/// A joint posterior.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// The probabilities of all combinations of values, the last variable fastest.
    pub probabilities: Vec<f64>,
    /// ln P(evidence)
    pub ln_evidence: f64,
}

/// The expected information of observing a variable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// The variable.
    pub variable: usize,
    /// H(X | e), its entropy, in bits.
    pub entropy: f64,
    /// I(target; X | e) in bits: by how much observing X is expected to reduce the entropy of the target.
    pub information: f64,
}

/// H = −Σ p log₂ p, in bits.
pub(super) fn entropy(probabilities: &[f64]) -> f64 {
    operators::entropy(probabilities.iter().copied()) / LN_2
}

/// The joint posterior of some variables, all different and not observed.
///
/// # Errors
/// No variable, one that is observed or named twice; too little memory; evidence of probability zero.
pub fn joint(network: &Network, evidence: &NetworkEvidence, variables: &[usize]) -> Result<Joint, Error> {
    let Some((last, first)) = variables.split_last() else {
        return Err(Error::input("joint posterior", "it needs at least one variable"));
    };
    let mut probabilities = Vec::new();
    let ln_evidence = condition(network, evidence, first, &[*last], |p, marginals| {
        let extent = network.cardinalities[*last];
        match marginals {
            Some(marginals) => probabilities.extend(marginals[0].iter().map(|q| p * q)),
            None => probabilities.extend(std::iter::repeat_n(0.0, extent)),
        }
    })?;
    Ok(Joint { probabilities: normalised(probabilities), ln_evidence })
}

/// Ratios of two numbers known by their logarithms: normalising removes the rounding errors.
fn normalised(mut probabilities: Vec<f64>) -> Vec<f64> {
    let total: f64 = probabilities.iter().sum();
    probabilities.iter_mut().for_each(|p| *p /= total);
    probabilities
}

/// The joint posterior of the targets, and the expected information of each candidate observation about them, the largest
/// first. One propagation for P(e), and one for each combination of values of the targets.
///
/// I(T; X | e) = Σ_t P(t | e) Σ_x P(x | t, e) log₂ (P(x | t, e) / P(x | e))
///
/// # Errors
/// As for [`joint`].
pub fn observations(
    network: &Network,
    evidence: &NetworkEvidence,
    targets: &[usize],
    candidates: &[usize],
) -> Result<(Joint, Vec<Observation>), Error> {
    let free = |one: &&usize| !targets.contains(one) && !evidence.hard.iter().any(|(known, _)| known == *one);
    let candidates: Vec<usize> = candidates.iter().filter(free).copied().collect();
    // Σ_t P(t | e) P(x | t, e) is P(x | e); Σ_t P(t | e) H(X | t, e) is the conditional entropy of X.
    let mut means: Vec<Vec<f64>> =
        candidates.iter().map(|one| vec![0.0; network.cardinalities[*one]]).collect();
    let mut remaining = vec![0.0; candidates.len()];
    let mut probabilities = Vec::new();
    let ln_evidence = condition(network, evidence, targets, &candidates, |p, marginals| {
        probabilities.push(p);
        for (number, marginal) in marginals.into_iter().flatten().enumerate() {
            means[number].iter_mut().zip(marginal.iter()).for_each(|(mean, q)| *mean += p * q);
            remaining[number] += p * entropy(marginal);
        }
    })?;
    let joint = Joint { probabilities: normalised(probabilities), ln_evidence };
    let found = candidates.iter().zip(&means).zip(&remaining).map(|((variable, mean), remaining)| {
        let entropy = entropy(mean);
        let information = entropy - remaining;
        // A difference as small as the rounding error counts as zero.
        let information = if information > 1e-12 * entropy { information } else { 0.0 };
        Observation { variable: *variable, entropy, information }
    });
    let mut found: Vec<Observation> = found.collect();
    found.sort_by(|one, other| other.information.total_cmp(&one.information));
    Ok((joint, found))
}

/// For all combinations of values of some variables, the last one fastest: their probability given the evidence, and
/// the marginals of the wanted variables given both; empty where the probability is zero. Returns ln P(evidence).
fn condition(
    network: &Network,
    evidence: &NetworkEvidence,
    variables: &[usize],
    wanted: &[usize],
    mut each: impl FnMut(f64, Option<&[&[f64]]>),
) -> Result<f64, Error> {
    let mut given: Vec<usize> = evidence.hard.iter().map(|(variable, _)| *variable).collect();
    for (place, variable) in variables.iter().chain(wanted).enumerate() {
        if given.contains(variable) || variables.iter().chain(wanted).take(place).any(|one| one == variable) {
            return Err(Error::Evidence {
                variable: *variable,
                message: "it is observed, or named twice: its joint posterior with the others is redundant"
                    .to_owned(),
            });
        }
    }
    let weighed: Vec<usize> = evidence.likelihoods.iter().map(|(variable, _)| *variable).collect();
    let known = Marginals::new(network, &given, &weighed, &[])?;
    let mut session = known.session();
    session.ask(evidence)?;
    let ln_evidence = session.ln_evidence();
    given.extend_from_slice(variables);
    let plan = Marginals::new(network, &given, &weighed, wanted)?;
    let runs: f64 = variables.iter().map(|variable| network.cardinalities[*variable] as f64).product();
    let products = runs * plan.cost().cells.max(1.0);
    if products > MOST_PRODUCTS {
        let (question, help) = ("joint posterior".to_owned(), "name fewer variables".to_owned());
        return Err(Error::TooLong { question, products, most: MOST_PRODUCTS, help });
    }
    let mut session = plan.session();
    let mut own = evidence.clone();
    own.hard.extend(variables.iter().map(|variable| (*variable, 0)));
    let extents: Vec<usize> = variables.iter().map(|variable| network.cardinalities[*variable]).collect();
    for number in 0..extents.iter().product() {
        let ordinals = radix::ordinals(number, extents.iter().rev().copied());
        for (hard, ordinal) in own.hard.iter_mut().rev().zip(ordinals) {
            hard.1 = ordinal;
        }
        match session.ask(&own) {
            Ok(()) => {
                let marginals: Vec<&[f64]> = wanted.iter().map(|one| session.marginal(*one)).collect();
                each((session.ln_evidence() - ln_evidence).exp(), Some(&marginals));
            }
            Err(Error::Contradiction { .. }) => each(0.0, None),
            Err(error) => return Err(error),
        }
    }
    Ok(ln_evidence)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::strategies::join_tree::{FactorTable, propagations};

    #[test]
    fn evidence_below_many_parents_counts_where_nothing_else_is_wanted() {
        // P(X_i) = ¼ for 13 causes, P(Y | X) = ΣX / 13: P(Y) = ¼, and
        // P(X₀ X₁ | Y) = (2 + 11/4) / 13 · (1/16) / ¼, P(no X₀, no X₁ | Y) = (11/4) / 13 · (9/16) / ¼.
        let causes = 13;
        let cause = |number| FactorTable { variables: vec![number], values: vec![0.75, 0.25] };
        let mut tables: Vec<FactorTable> = (0..causes).map(cause).collect();
        let share = |row: u32| f64::from(row.count_ones()) / 13.0;
        let values = (0..1u32 << causes).flat_map(|row| [1.0 - share(row), share(row)]).collect();
        tables.push(FactorTable { variables: (0..=causes).collect(), values });
        let table_of = (0..=causes).map(Some).collect();
        let network = Network { cardinalities: vec![2; causes + 1], tables, table_of, ..Network::default() };
        let evidence = NetworkEvidence { hard: vec![(causes, 1)], ..NetworkEvidence::default() };
        let found = joint(&network, &evidence, &[0, 1]).unwrap();
        assert!((found.ln_evidence - 0.25f64.ln()).abs() < 1e-12, "{}", found.ln_evidence);
        // P(e), and one for each of four combinations: whatever the number of candidates.
        let before = propagations();
        let all: Vec<usize> = (2..causes).collect();
        let (same, list) = observations(&network, &evidence, &[0, 1], &all).unwrap();
        assert_eq!((propagations() - before, list.len()), (5, 11));
        assert!(same.probabilities.iter().zip(&found.probabilities).all(|(p, q)| (p - q).abs() < 1e-14));
        let expected = [2.75 / 13.0 * 2.25, 3.75 / 13.0 * 0.75, 3.75 / 13.0 * 0.75, 4.75 / 13.0 * 0.25];
        let near = |(p, q): (&f64, &f64)| (p - q).abs() < 1e-12;
        assert!(found.probabilities.iter().zip(&expected).all(near), "{:?}", found.probabilities);
    }
}
