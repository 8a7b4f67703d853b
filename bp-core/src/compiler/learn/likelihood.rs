//! The likelihood and the prior of each form.
//!
//! In: distributions with their numbers, and statistics. Out: ln L of a form, and ln of the priors up to constants.
//! Invariant: the estimates maximise ln L + ln prior.
//!
//! A distribution over integers or bins is normalised over the domain here, as in an answer; it is fitted without the
//! normalising constant.

use super::distribution::{Distribution, Kind, Learnable, Share};
use super::estimate::prior_counts;
use super::statistics::Statistic;
use crate::distribution::ln_sum;
use crate::law::{Law, Numbers};
use crate::model::{Domain, Fit};
use std::f64::consts::TAU;

/// x ln y, 0 where x is 0.
fn times_ln(x: f64, y: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x * y.ln() }
}

/// The probabilities of a row.
fn probabilities(learnable: &Learnable, row: &[Share]) -> Vec<f64> {
    let known: Vec<Option<f64>> = (row.iter())
        .map(|share| match share {
            Share::Learned(cell) => Some(learnable.number(*cell)),
            Share::Rest => None,
        })
        .collect();
    let rest = 1.0 - known.iter().flatten().sum::<f64>();
    known.into_iter().map(|number| number.unwrap_or(rest.max(0.0))).collect()
}

/// ln P of the data of a distribution.
pub(super) fn ln_likelihood(
    learnable: &Learnable,
    distribution: &Distribution,
    statistic: &Statistic,
) -> f64 {
    match (&distribution.kind, statistic) {
        (Kind::Row(row), Statistic::Counts(counts)) => {
            let probabilities = probabilities(learnable, row);
            counts.iter().zip(probabilities).map(|(count, p)| times_ln(*count, p)).sum()
        }
        (Kind::Law(law, arguments), Statistic::Sample(sample)) if !sample.is_empty() => {
            let (parameters, domain) = (learnable.arguments(arguments), learnable.domain(distribution));
            let ln = |x: f64| ln_weight(*law, &parameters, domain, x);
            let ln_total = match learnable.count(distribution) {
                None => 0.0,
                Some(count) => ln_sum(&(0..count).map(|at| ln(domain.number(at))).collect::<Vec<f64>>()),
            };
            sample.total() * (sample.mean_of(ln) - ln_total)
        }
        (Kind::Regression(cells), statistic) => {
            let numbers: Vec<f64> = cells.iter().map(|cell| learnable.number(*cell)).collect();
            let Some((deviation, coefficients)) = numbers.split_last() else { return f64::NAN };
            let mut sum = 0.0;
            for (row, count) in statistic.rows() {
                let terms = coefficients[1..].iter().zip(&row).map(|(slope, x)| slope * x).sum::<f64>();
                let (mean, y) = (coefficients[0] + terms, row[row.len() - 1]);
                sum += count * Law::Normal.ln_density(&mut Numbers, y, &[mean, *deviation]);
            }
            sum
        }
        _ => 0.0,
    }
}

fn ln_weight(law: Law, parameters: &[f64], domain: &Domain, x: f64) -> f64 {
    match domain {
        Domain::Bins(_) => weight(law, parameters, domain, x).ln(),
        _ => law.ln_density(&mut Numbers, x, parameters),
    }
}

/// The unnormalised density of a distribution at a number.
fn weight(law: Law, parameters: &[f64], domain: &Domain, x: f64) -> f64 {
    let Domain::Bins(bins) = domain else { return law.density(x, parameters) };
    let Some(bin) = bins.holding(x) else { return 0.0 };
    let (from, to) = (bins.edges()[bin], bins.edges()[bin + 1]);
    if bins.is_circle() && matches!(law, Law::Normal | Law::VonMises) {
        let turn = bins.ends().1 - bins.ends().0;
        let centred = bins.centre(bin) - parameters[0].rem_euclid(turn);
        let distance = (centred + 0.5 * turn).rem_euclid(turn) - 0.5 * turn;
        if law == Law::VonMises {
            return law.density(distance * TAU / turn, &[0.0, parameters[1]]);
        }
        let (half, around) = (0.5 * (to - from), [0.0, parameters[1]]);
        return law.between(distance - half, distance + half, &around);
    }
    law.between(from, to, parameters)
}

/// ln of the prior, up to a constant; the estimate is the maximum of its sum with ln L.
pub(super) fn ln_prior(learnable: &Learnable, distribution: &Distribution) -> f64 {
    match (&distribution.kind, &distribution.fit) {
        (Kind::Row(row), fit) => {
            let prior = prior_counts(fit.as_ref(), row.len());
            let probabilities = probabilities(learnable, row);
            prior.iter().zip(probabilities).map(|(count, p)| times_ln(*count, p)).sum()
        }
        (Kind::Law(law, arguments), Some(Fit::Conjugate { prior: [first, second], .. })) => {
            let parameters = learnable.arguments(arguments);
            match law {
                Law::Poisson | Law::Exponential => times_ln(*first, parameters[0]) - second * parameters[0],
                Law::Binomial => times_ln(*first, parameters[1]) + times_ln(*second, 1.0 - parameters[1]),
                _ => -0.5 * ((parameters[0] - first) / second).powi(2),
            }
        }
        // s² = S / (N − 1) maximises ln L + ln s.
        (Kind::Law(_, arguments), Some(Fit::UnbiasedNormal)) => learnable.arguments(arguments)[1].ln(),
        _ => 0.0,
    }
}
