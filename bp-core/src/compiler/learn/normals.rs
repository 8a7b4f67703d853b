//! Normal distributions with shared means or deviations, or with one of them known.
//!
//! In: their samples. Out: the means and deviations. Invariant: each mean is the maximum-likelihood weighted mean given
//! the deviations, and each deviation that of all residuals given the means: no round lowers the likelihood.

use super::distribution::{Argument, Cell, Kind, Learnable};
use super::estimate::{Outcome, Step};
use super::floor::least_deviation;
use super::statistics::Statistic;
use crate::error::Error;
use crate::ids::FactorId;
use crate::law::Sample;
use std::collections::{BTreeMap, HashMap};

/// Limit of rounds, if means and deviations depend on each other.
const MOST_ROUNDS: usize = 1000;

/// A distribution of the group: its position, mean and deviation.
type Part = (usize, [Argument; 2]);

/// Sets the means and deviations of these distributions.
pub(super) fn normals(
    learnable: &mut Learnable,
    statistics: &[Statistic],
    together: &[usize],
    step: &Step<'_>,
    outcomes: &mut [Outcome],
) -> Result<(), Error> {
    let parts: Vec<Part> = (together.iter())
        .filter_map(|position| match &learnable.distributions()[*position].kind {
            Kind::Law(_, arguments) => Some((*position, [arguments[0], arguments[1]])),
            _ => None,
        })
        .collect();
    for (position, _) in &parts {
        if sample_of(statistics, *position).is_none() {
            outcomes[*position] = Outcome::Empty;
        }
    }
    let cells = [0, 1].map(|place| cells(&parts, place));
    let mut all = HashMap::new();
    for _ in 0..if step.iterating { 1 } else { MOST_ROUNDS } {
        let mut moved: f64 = 0.0;
        for (place, cells) in cells.iter().enumerate() {
            for (cell, own) in cells {
                let before = learnable.number(*cell);
                let found = match place {
                    0 => mean(learnable, statistics, own),
                    _ => deviation(learnable, statistics, own),
                };
                let floor = own.iter().map(|part| least_deviation(step.spreads[part.0])).fold(0.0, f64::max);
                let means = own.iter().map(|part| learnable.arguments(&part.1)[0].abs());
                // Equal values differ from a mean that they share by its rounding.
                let least = floor.max(1e-15 * means.fold(0.0, f64::max));
                let number = match found {
                    Some(number) if place == 1 && number <= least => {
                        if floor <= 0.0 {
                            let message = "`normal` needs values that differ; no case has them";
                            return Err(Error::input(learnable.place(own[0].0), message));
                        }
                        let seen = own.iter().filter(|part| sample_of(statistics, part.0).is_some());
                        seen.for_each(|part| outcomes[part.0] = Outcome::Floored);
                        floor
                    }
                    Some(number) => number,
                    None if learnable.is_declared(*cell) => continue,
                    None => {
                        let all = all
                            .entry(factor_of(learnable, own[0]))
                            .or_insert_with_key(|factor| pool(learnable, statistics, &parts, *factor));
                        stand_in(learnable, all, own[0], place)?
                    }
                };
                moved = moved.max((number - before).abs() / number.abs().max(f64::MIN_POSITIVE));
                learnable.set(*cell, number);
            }
        }
        if moved <= 1e-14 {
            break;
        }
    }
    Ok(())
}

/// The cells learned as means (0) or deviations (1), each with the distributions that use it.
fn cells(parts: &[Part], place: usize) -> BTreeMap<Cell, Vec<&Part>> {
    let mut cells: BTreeMap<Cell, Vec<&Part>> = BTreeMap::new();
    for part in parts {
        if let Argument::Learned(cell) = part.1[place] {
            cells.entry(cell).or_default().push(part);
        }
    }
    cells
}

fn sample_of(statistics: &[Statistic], position: usize) -> Option<&Sample> {
    match &statistics[position] {
        Statistic::Sample(sample) if !sample.is_empty() => Some(sample),
        _ => None,
    }
}

/// The weighted mean of some distributions that share it; `None` if none of them has cases.
fn mean(learnable: &Learnable, statistics: &[Statistic], own: &[&Part]) -> Option<f64> {
    // A common deviation cancels, and is not needed.
    let one = own.iter().all(|(_, arguments)| arguments[1] == own[0].1[1]);
    let parts = own.iter().filter_map(|(position, arguments)| {
        let sample = sample_of(statistics, *position)?;
        Some((sample, if one { 1.0 } else { learnable.arguments(arguments)[1] }))
    });
    let parts: Vec<(&Sample, f64)> = parts.collect();
    let least = parts.iter().map(|(_, deviation)| *deviation).fold(f64::INFINITY, f64::min);
    let mut all = Sample::default();
    for (sample, deviation) in parts {
        all.add(sample.mean(), sample.total() * (least / deviation).powi(2));
    }
    (!all.is_empty()).then(|| all.mean())
}

/// The deviation of some distributions that share it; `None` if none of them has cases.
fn deviation(learnable: &Learnable, statistics: &[Statistic], own: &[&Part]) -> Option<f64> {
    let mut all = Sample::default();
    for (position, arguments) in own {
        let Some(sample) = sample_of(statistics, *position) else { continue };
        all.add(sample.distance(learnable.arguments(arguments)[0]), sample.total());
    }
    (!all.is_empty()).then(|| all.distance(0.0))
}

fn factor_of(learnable: &Learnable, part: &Part) -> FactorId {
    learnable.distributions()[part.0].factor
}

/// All cases of a factor.
fn pool(learnable: &Learnable, statistics: &[Statistic], parts: &[Part], factor: FactorId) -> Sample {
    let mut all = Sample::default();
    let own = parts.iter().filter(|part| factor_of(learnable, part) == factor);
    own.filter_map(|part| sample_of(statistics, part.0)).for_each(|sample| all.add_all(sample));
    all
}

/// The mean or deviation of all cases of the same form, for a distribution without cases.
fn stand_in(learnable: &Learnable, all: &Sample, own: &Part, place: usize) -> Result<f64, Error> {
    let number = if place == 0 { all.mean() } else { all.deviation() };
    match number.is_finite() && (place == 0 || number > 0.0) {
        true => Ok(number),
        false => {
            let message = "`normal` needs values that differ; no case has them";
            Err(Error::input(learnable.place(own.0), message))
        }
    }
}
