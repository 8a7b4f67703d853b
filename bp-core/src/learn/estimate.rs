//! From what was seen to the numbers of the model.
//!
//! In: statistics of all distributions. Out: the model with its numbers put in, and what was done for each distribution.
//! Invariant: probabilities of a row sum to one; a law's numbers are ones that it can have.
//!
//! Rows: (nᵢ + aᵢ) / (N + Σ a).  Laws: maximum likelihood, or the mean of what is believed after a conjugate prior
//! (Gelman and others, *Bayesian Data Analysis*, 3rd ed., chapter 2):
//! rate of `poisson` (a + Σx) / (b + N), of `exponential` (a + N) / (b + Σx), chance of `binomial` (a + Σx) / (a + b + nN),
//! mean of `normal` (m/t² + Σx/s²) / (1/t² + N/s²).

use super::distribution::{Argument, Cell, Distribution, Kind, Learnable, Share, cells_of};
use super::regression::least_squares;
use super::statistics::Statistic;
use crate::error::Error;
use crate::law::{Law, Refusal, Sample};
use crate::model::{Bins, Domain, Fit};
use std::collections::HashMap;

/// How a distribution came by its numbers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Outcome {
    /// From the cases that belong to it.
    Fitted,
    /// No case belongs to it: what the prior says, or uniform, or the law of all cases of its factor.
    Empty,
    /// Too few cases belong to it: the law of all cases of its factor.
    Pooled,
}

/// Prior counts of a row.
pub(super) fn prior_counts(fit: Option<&Fit>, values: usize) -> Vec<f64> {
    match fit {
        Some(Fit::LaplaceSuccession) => vec![1.0; values],
        Some(Fit::Dirichlet(prior)) => vec![*prior; values],
        Some(Fit::Beta(a, b)) => vec![*b, *a],
        _ => vec![0.0; values],
    }
}

/// Puts numbers into the model; distributions that are kept are left as they are.
pub(super) fn estimate(
    learnable: &mut Learnable,
    statistics: &[Statistic],
    keep: &[bool],
) -> Result<Vec<Outcome>, Error> {
    let mut uses: HashMap<Cell, usize> = HashMap::new();
    for distribution in &learnable.distributions {
        cells_of(&distribution.kind).into_iter().for_each(|cell| *uses.entry(cell).or_default() += 1);
    }
    let mut outcomes = vec![Outcome::Fitted; statistics.len()];
    let mut together = Vec::new();
    for (position, statistic) in statistics.iter().enumerate() {
        if keep[position] {
            continue;
        }
        let distribution = learnable.distributions[position].clone();
        match (&distribution.kind, statistic) {
            (Kind::Row(row), Statistic::Counts(counts)) => {
                outcomes[position] = rows(learnable, row, counts, distribution.fit.as_ref());
            }
            (Kind::Regression(cells), _) => {
                let fitted = least_squares(&statistic.rows())
                    .map_err(|why| Error::input(learnable.head(distribution.factor), why))?;
                cells.iter().zip(fitted).for_each(|(cell, number)| learnable.set(*cell, number));
            }
            (Kind::Law(law, arguments), Statistic::Sample(sample)) => {
                let whole = arguments.iter().all(|argument| match argument {
                    Argument::Learned(cell) => uses[cell] == 1,
                    Argument::Known(_) => false,
                });
                if *law == Law::Normal && !whole && distribution.fit.is_none() {
                    together.push(position);
                    continue;
                }
                let (fitted, outcome) = law_of(learnable, &distribution, sample, statistics)?;
                outcomes[position] = outcome;
                for (argument, number) in arguments.iter().zip(fitted) {
                    if let Argument::Learned(cell) = argument {
                        learnable.set(*cell, number);
                    }
                }
            }
            _ => unreachable!("internal: a statistic is of the kind of its distribution"),
        }
    }
    normals(learnable, statistics, &together, &mut outcomes)?;
    Ok(outcomes)
}

fn rows(learnable: &mut Learnable, row: &[Share], counts: &[f64], fit: Option<&Fit>) -> Outcome {
    let prior = prior_counts(fit, counts.len());
    let total: f64 = counts.iter().sum::<f64>() + prior.iter().sum::<f64>();
    let empty = counts.iter().sum::<f64>() <= 0.0;
    for ((share, count), prior) in row.iter().zip(counts).zip(&prior) {
        let Share::Learned(cell) = share else { continue };
        let number = match total > 0.0 {
            true => (count + prior) / total,
            // A parameter that has a value keeps it; of an entry, uniform is what it has.
            false if fit.is_none() && learnable.number(*cell).is_some() => continue,
            false => 1.0 / counts.len() as f64,
        };
        learnable.set(*cell, number);
    }
    if empty { Outcome::Empty } else { Outcome::Fitted }
}

/// The numbers of a law; where its own cases do not tell them, those of all cases of its factor.
fn law_of(
    learnable: &Learnable,
    distribution: &Distribution,
    sample: &Sample,
    statistics: &[Statistic],
) -> Result<(Vec<f64>, Outcome), Error> {
    let Kind::Law(law, arguments) = &distribution.kind else { unreachable!("internal: a law was expected") };
    let left = learnable.model.factors[distribution.factor].left[0].variable;
    let domain = &learnable.model.variables[left].domain;
    let known: Vec<f64> = (arguments.iter())
        .filter_map(|argument| match argument {
            Argument::Known(bits) => Some(f64::from_bits(*bits)),
            Argument::Learned(_) => None,
        })
        .collect();
    let fit = |sample: &Sample| fitted(*law, distribution.fit.as_ref(), &known, sample, domain);
    let own = fit(sample);
    if let Ok(numbers) = own {
        let outcome = if sample.is_empty() { Outcome::Empty } else { Outcome::Fitted };
        return Ok((numbers, outcome));
    }
    let mut pooled = Sample::default();
    for (other, statistic) in learnable.distributions.iter().zip(statistics) {
        let alike = other.factor == distribution.factor
            && matches!(&other.kind, Kind::Law(other, _) if other == law)
            && other.fit == distribution.fit;
        if let (true, Statistic::Sample(sample)) = (alike, statistic) {
            pooled.add_all(sample);
        }
    }
    let outcome = if sample.is_empty() { Outcome::Empty } else { Outcome::Pooled };
    match fit(&pooled) {
        Ok(numbers) => Ok((numbers, outcome)),
        Err(why) => {
            let seen = match pooled.total() {
                0.0 => "no case says anything of it".to_owned(),
                _ => format!("its values lie in [{}; {}]", pooled.ends().0, pooled.ends().1),
            };
            let message = format!("`{}` {why}; {seen}", law.name());
            Err(Error::input(learnable.head(distribution.factor), message))
        }
    }
}

fn fitted(
    law: Law,
    fit: Option<&Fit>,
    known: &[f64],
    sample: &Sample,
    domain: &Domain,
) -> Result<Vec<f64>, Refusal> {
    let numbers = match (fit, domain) {
        (Some(Fit::Conjugate { known, prior, .. }), _) => conjugate(law, known, *prior, sample),
        (_, Domain::Bins(bins)) if bins.is_circle() && matches!(law, Law::Normal | Law::VonMises) => {
            on_circle(law, sample, bins)?
        }
        _ => law.fit(sample, known)?,
    };
    let numbers = match fit {
        Some(Fit::UnbiasedNormal) => {
            let total = sample.total();
            if total <= 1.0 {
                return Err("needs two cases or more");
            }
            vec![numbers[0], numbers[1] * (total / (total - 1.0)).sqrt()]
        }
        _ => numbers,
    };
    match law.refuses(&numbers) {
        None => Ok(numbers),
        Some(_) => Err("needs values that differ more"),
    }
}

fn conjugate(law: Law, known: &[f64], [first, second]: [f64; 2], sample: &Sample) -> Vec<f64> {
    let total = sample.total();
    let sum = if sample.is_empty() { 0.0 } else { sample.mean_of(|x| x) * total };
    match (law, known) {
        (Law::Poisson, _) => vec![(first + sum) / (second + total)],
        (Law::Exponential, _) => vec![(first + total) / (second + sum)],
        (Law::Binomial, [trials]) => vec![*trials, (first + sum) / (first + second + trials * total)],
        (Law::Normal, [deviation]) => {
            let (before, each) = (1.0 / (second * second), 1.0 / (deviation * deviation));
            vec![(first * before + sum * each) / (before + total * each), *deviation]
        }
        _ => unreachable!("internal: a checked law has its conjugate prior"),
    }
}

/// On a circle numbers are angles: the mean is the direction of the mean vector, and deviations go the shorter way round.
fn on_circle(law: Law, sample: &Sample, bins: &Bins) -> Result<Vec<f64>, Refusal> {
    let (low, high) = bins.ends();
    let scale = std::f64::consts::TAU / (high - low);
    let back = |angle: f64| low + (angle / scale).rem_euclid(high - low);
    let angles = sample.map(|x| (x - low) * scale);
    if law == Law::VonMises {
        let numbers = law.fit(&angles, &[])?;
        return Ok(vec![back(numbers[0]), numbers[1]]);
    }
    let mean = angles.mean_of(f64::sin).atan2(angles.mean_of(f64::cos));
    let turn = std::f64::consts::TAU;
    let near = angles.map(|x| mean + (x - mean + 0.5 * turn).rem_euclid(turn) - 0.5 * turn);
    let numbers = law.fit(&near, &[])?;
    Ok(vec![back(numbers[0]), numbers[1] / scale])
}

/// Normal laws that share means or deviations, or of which one of both is known: each mean, given the deviations, is a
/// weighted mean; each deviation, given the means, is that of all residuals.
fn normals(
    learnable: &mut Learnable,
    statistics: &[Statistic],
    together: &[usize],
    outcomes: &mut [Outcome],
) -> Result<(), Error> {
    let parts: Vec<(usize, [Argument; 2])> = (together.iter())
        .filter_map(|position| match &learnable.distributions[*position].kind {
            Kind::Law(_, arguments) => Some((*position, [arguments[0], arguments[1]])),
            _ => None,
        })
        .collect();
    for (place, learn_mean) in [(0, true), (1, false)] {
        let mut cells: Vec<Cell> = (parts.iter())
            .filter_map(|(_, arguments)| match arguments[place] {
                Argument::Learned(cell) => Some(cell),
                Argument::Known(_) => None,
            })
            .collect();
        cells.sort_unstable();
        cells.dedup();
        for cell in cells {
            let (mut sum, mut total, mut seen) = (0.0, 0.0, 0.0);
            let own = parts.iter().filter(|(_, arguments)| arguments[place] == Argument::Learned(cell));
            let own: Vec<_> = own.collect();
            // Where all deviations are one, they cancel, and are not needed.
            let one = own.iter().all(|(_, arguments)| arguments[1] == own[0].1[1]);
            for (position, arguments) in &own {
                let Statistic::Sample(sample) = &statistics[*position] else { continue };
                let weight = sample.total();
                if weight <= 0.0 {
                    outcomes[*position] = Outcome::Empty;
                    continue;
                }
                let number = |argument: &Argument| match argument {
                    Argument::Learned(cell) => learnable.number(*cell),
                    Argument::Known(bits) => Some(f64::from_bits(*bits)),
                };
                let (mean, deviation) =
                    (number(&arguments[0]).unwrap_or(0.0), number(&arguments[1]).unwrap_or(1.0));
                let precision = if one { weight } else { weight / (deviation * deviation) };
                seen += weight;
                total += if learn_mean { precision } else { weight };
                sum += match learn_mean {
                    true => precision * sample.mean_of(|x| x),
                    false => weight * sample.mean_of(|x| (x - mean) * (x - mean)),
                };
            }
            let number = if learn_mean { sum / total } else { (sum / total).sqrt() };
            let head = || learnable.head(learnable.distributions[own[0].0].factor);
            if seen <= 0.0 && learnable.number(cell).is_some() {
                continue;
            }
            if !number.is_finite() || (!learn_mean && number <= 0.0) {
                return Err(Error::input(head(), "`normal` needs values that differ; no case has them"));
            }
            learnable.set(cell, number);
        }
    }
    Ok(())
}
