//! The M step: from statistics to the numbers of the program.
//!
//! In: statistics of all distributions. Out: the program with its estimates, and the origin of the estimate of each
//! distribution. Invariant: probabilities of a row sum to one; the parameters of a distribution are valid, or there is
//! an error that names form, context and number.
//!
//! Rows: (nᵢ + aᵢ) / (N + Σ a). Other distributions: maximum likelihood, or the posterior mean with a conjugate prior
//! (Gelman and others, *Bayesian Data Analysis*, 3rd ed., chapter 2): rate of `poisson` (a + Σx) / (b + N), of
//! `exponential` (a + N) / (b + Σx), probability of `binomial` (a + Σx) / (a + b + nN), mean of `normal` (m/t² + Σx/s²)
//! / (1/t² + N/s²).

use super::distribution::{Argument, Cell, Kind, Learnable, Share, cells_of};
use super::floor::{Bound, bound, collapsed, held, is_narrowest, spread};
use super::normals::normals;
use super::regression::least_squares;
use super::statistics::Statistic;
use super::uniform_bins;
use crate::error::Error;
use crate::law::{Law, Refusal, Sample};
use crate::model::{Bins, Domain, Fit, ParameterKind};
use crate::spelling::number as written;
use std::collections::HashMap;

/// The origin of the estimate of a distribution.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Outcome {
    /// Its own cases.
    Fitted,
    /// No cases: the prior, or uniform, or the distribution of all cases of its factor.
    Empty,
    /// Its own cases, most of which are equal, with the floor.
    Floored,
    /// Its own cases, with a parameter at its limit.
    Limited,
}

impl From<Option<Bound>> for Outcome {
    fn from(bound: Option<Bound>) -> Self {
        match bound {
            None => Outcome::Fitted,
            Some(Bound::Floor) => Outcome::Floored,
            Some(Bound::Limit) => Outcome::Limited,
        }
    }
}

/// Options of the M step.
#[derive(Clone, Debug)]
pub(super) struct Step<'s> {
    /// Distributions that keep their numbers.
    pub(super) keep: &'s [bool],
    /// For each distribution, the spread of all values of its form.
    pub(super) spreads: &'s [f64],
    /// Whether this is a step of an iteration: then coupled equations are solved once.
    pub(super) iterating: bool,
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

/// All values of the forms: for each distribution those of all distributions with the same estimator.
pub(super) fn pooled(learnable: &Learnable, statistics: &[Statistic]) -> Vec<Sample> {
    let mut groups: Vec<(usize, Sample)> = Vec::new();
    let all = learnable.distributions();
    let of: Vec<Option<usize>> = (all.iter().enumerate())
        .map(|(position, distribution)| {
            let Kind::Law(law, _) = &distribution.kind else { return None };
            let alike = |first: usize| {
                let other = &all[first];
                other.factor == distribution.factor
                    && matches!(&other.kind, Kind::Law(other, _) if other == law)
                    && other.fit == distribution.fit
            };
            let group = groups.iter().position(|(first, _)| alike(*first)).unwrap_or_else(|| {
                groups.push((position, Sample::default()));
                groups.len() - 1
            });
            if let Statistic::Sample(sample) = &statistics[position] {
                groups[group].1.add_all(sample);
            }
            Some(group)
        })
        .collect();
    of.into_iter().map(|group| group.map_or_else(Sample::default, |group| groups[group].1.clone())).collect()
}

/// The spread of all values of each distribution's form, each value counted once: the expected counts change from step
/// to step, but the floor must not.
pub(super) fn spreads(learnable: &Learnable, statistics: &[Statistic]) -> Vec<f64> {
    let all = learnable.distributions().iter().zip(pooled(learnable, statistics));
    all.map(|(distribution, sample)| match &distribution.kind {
        Kind::Law(law, _) => {
            let once = sample.iter().filter(|(_, weight)| *weight > 0.0).map(|(number, _)| number).collect();
            spread(*law, &on_line(*law, &once, learnable.domain(distribution)).1)
        }
        _ => 0.0,
    })
    .collect()
}

/// Sets the numbers of the program.
pub(super) fn estimate(
    learnable: &mut Learnable,
    statistics: &[Statistic],
    step: &Step<'_>,
) -> Result<Vec<Outcome>, Error> {
    let mut uses: HashMap<Cell, usize> = HashMap::new();
    for distribution in learnable.distributions() {
        cells_of(&distribution.kind).into_iter().for_each(|cell| *uses.entry(cell).or_default() += 1);
    }
    let mut outcomes = vec![Outcome::Fitted; statistics.len()];
    let (mut together, mut pools) = (Vec::new(), None);
    for (position, statistic) in statistics.iter().enumerate() {
        if step.keep[position] {
            continue;
        }
        let distribution = learnable.distributions()[position].clone();
        match (&distribution.kind, statistic) {
            (Kind::Row(row), Statistic::Counts(counts)) => {
                outcomes[position] = rows(learnable, row, counts, distribution.fit.as_ref());
            }
            (Kind::Regression(cells), _) => {
                let fitted = least_squares(&statistic.rows())
                    .map_err(|why| learnable.program.wrong(distribution.factor, why))?;
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
                let law = (*law, arguments.as_slice());
                let found = own_law(learnable, position, law, sample, step);
                let (fitted, outcome) = match found {
                    Ok(found) => found,
                    Err(why) => {
                        let pools = pools.get_or_insert_with(|| pooled(learnable, statistics));
                        law_of_all(learnable, position, law, [sample, &pools[position]], step, why)?
                    }
                };
                outcomes[position] = outcome;
                for (argument, number) in arguments.iter().zip(fitted) {
                    if let Argument::Learned(cell) = argument {
                        learnable.set(*cell, number);
                    }
                }
            }
            _ => {
                let message = "its observations are not of the kind of its distribution";
                return Err(learnable.program.wrong(distribution.factor, message));
            }
        }
    }
    normals(learnable, statistics, &together, step, &mut outcomes)?;
    check(learnable)?;
    Ok(outcomes)
}

/// Why an unbiased deviation cannot be estimated.
const TOO_FEW: Refusal = "divides by the number of cases less one, and needs more than one case";

/// Refuses unbiased deviations of one case or less.
///
/// # Errors
/// A context has one case or less, but not none; the error names it.
pub(super) fn check_unbiased(learnable: &Learnable, statistics: &[Statistic]) -> Result<(), Error> {
    for (position, distribution) in learnable.distributions().iter().enumerate() {
        let Statistic::Sample(sample) = &statistics[position] else { continue };
        if distribution.fit == Some(Fit::UnbiasedNormal) && !sample.is_empty() && sample.total() <= 1.0 {
            let seen = written(sample.total());
            let message = format!("`normal, unbiased` {TOO_FEW}; the weight of its cases is {seen}");
            return Err(Error::input(learnable.place(position), message));
        }
    }
    Ok(())
}

/// Refuses invalid numbers of a form.
fn check(learnable: &Learnable) -> Result<(), Error> {
    for (position, distribution) in learnable.distributions().iter().enumerate() {
        let wrong = |what: &str, number: f64, expected: &str| {
            let message = format!("{what} is learned as {number}, but it must be {expected}");
            Err(Error::input(learnable.place(position), message))
        };
        match &distribution.kind {
            Kind::Law(law, arguments) => {
                let numbers = learnable.arguments(arguments);
                if let Some((place, expected)) = law.refuses(&numbers) {
                    let what = format!("the {} of `{}`", law.parameters()[place].0, law.name());
                    return wrong(&what, numbers[place], expected);
                }
            }
            kind => {
                for cell in cells_of(kind) {
                    let number = learnable.number(cell);
                    let inside = (0.0..=1.0).contains(&number);
                    match kind {
                        Kind::Row(_) if !inside => return wrong("a probability", number, "between 0 and 1"),
                        _ if !number.is_finite() => return wrong("a number", number, "finite"),
                        _ => {}
                    }
                }
            }
        }
        for cell in cells_of(&distribution.kind) {
            if let Cell::Place(parameter, _) = cell {
                let parameter = &learnable.program.model.parameters[parameter];
                let number = learnable.number(cell);
                let kind = match parameter.kind {
                    ParameterKind::Size | ParameterKind::Integer | ParameterKind::Element(_) => {
                        ParameterKind::Real
                    }
                    kind => kind,
                };
                if let Some(expected) = kind.refuses(number) {
                    return wrong(&format!("`{}`", parameter.name), number, expected);
                }
            }
        }
    }
    Ok(())
}

fn rows(learnable: &mut Learnable, row: &[Share], counts: &[f64], fit: Option<&Fit>) -> Outcome {
    let prior = prior_counts(fit, counts.len());
    let total: f64 = counts.iter().sum::<f64>() + prior.iter().sum::<f64>();
    let empty = counts.iter().sum::<f64>() <= 0.0;
    for ((share, count), prior) in row.iter().zip(counts).zip(&prior) {
        let Share::Learned(cell) = share else { continue };
        let number = match total > 0.0 {
            true => ((count + prior) / total).min(1.0),
            // A parameter with a value keeps it; the default of an entry is uniform.
            false if fit.is_none() && learnable.is_declared(*cell) => continue,
            false => 1.0 / counts.len() as f64,
        };
        learnable.set(*cell, number);
    }
    if empty { Outcome::Empty } else { Outcome::Fitted }
}

/// The known arguments of a distribution.
fn known(arguments: &[Argument]) -> Vec<f64> {
    (arguments.iter())
        .filter_map(|argument| match argument {
            Argument::Known(bits) => Some(f64::from_bits(*bits)),
            Argument::Learned(_) => None,
        })
        .collect()
}

/// The parameters of a distribution from its own cases.
fn own_law(
    learnable: &Learnable,
    position: usize,
    (law, arguments): (Law, &[Argument]),
    sample: &Sample,
    step: &Step<'_>,
) -> Result<(Vec<f64>, Outcome), Refusal> {
    let distribution = &learnable.distributions()[position];
    let (fit, domain) = (distribution.fit.as_ref(), learnable.domain(distribution));
    let numbers = fitted(law, fit, &known(arguments), sample, domain)?;
    let spread = on_turn(law, step.spreads[position], domain);
    let (numbers, is_held) = match fit {
        Some(Fit::Conjugate { .. }) => (numbers, false),
        _ => held(law, numbers, spread),
    };
    let outcome = match (sample.is_empty(), is_held || is_narrowest(law, &numbers)) {
        (true, _) => Outcome::Empty,
        (false, true) => bound(law, &numbers, sample, spread).into(),
        (false, false) => Outcome::Fitted,
    };
    Ok((numbers, outcome))
}

/// The parameters of a distribution that its own cases do not determine: at the floor, if they are all equal; without a
/// floor, those of all cases of its factor.
fn law_of_all(
    learnable: &Learnable,
    position: usize,
    (law, arguments): (Law, &[Argument]),
    [own, all]: [&Sample; 2],
    step: &Step<'_>,
    why: Refusal,
) -> Result<(Vec<f64>, Outcome), Error> {
    let distribution = &learnable.distributions()[position];
    let (fit, domain) = (distribution.fit.as_ref(), learnable.domain(distribution));
    let floored = |sample: &Sample, why: Refusal| {
        let (back, line) = on_line(law, sample, domain);
        let numbers = collapsed(law, &line, step.spreads[position], why)?;
        Ok(back(numbers))
    };
    let found = match own.is_empty() {
        false => floored(own, why).map(|numbers| {
            let outcome = bound(law, &numbers, own, on_turn(law, step.spreads[position], domain)).into();
            (numbers, outcome)
        }),
        true => fitted(law, fit, &known(arguments), all, domain)
            .or_else(|why| if all.is_empty() { Err(why) } else { floored(all, why) })
            .map(|numbers| (numbers, Outcome::Empty)),
    };
    found.map_err(|why| {
        let sample = if own.is_empty() { all } else { own };
        let seen = match sample.total() {
            0.0 => "no case contains information about it".to_owned(),
            _ => format!("its values lie in [{}; {}]", sample.ends().0, sample.ends().1),
        };
        Error::input(learnable.place(position), format!("`{}` {why}; {seen}", law.name()))
    })
}

fn fitted(
    law: Law,
    fit: Option<&Fit>,
    known: &[f64],
    sample: &Sample,
    domain: &Domain,
) -> Result<Vec<f64>, Refusal> {
    if let Some(Fit::Conjugate { known, prior, .. }) = fit {
        return conjugate(law, known, *prior, sample);
    }
    let (total, is_unbiased) = (sample.total(), fit == Some(&Fit::UnbiasedNormal));
    if is_unbiased && total > 0.0 && total <= 1.0 {
        return Err(TOO_FEW);
    }
    if let Some(ends) = uniform_bins::ends(law, sample, domain) {
        return Ok(ends);
    }
    let (back, line) = on_line(law, sample, domain);
    let mut numbers = law.fit(&line, known)?;
    if is_unbiased {
        numbers[1] *= (total / (total - 1.0)).sqrt();
    }
    match law.refuses(&numbers) {
        None => Ok(back(numbers)),
        // The error shows it with the number.
        Some(_) if numbers.iter().any(|number| number.is_infinite()) => Ok(numbers),
        Some(_) => Err("needs values that differ more"),
    }
}

fn conjugate(law: Law, known: &[f64], [a, b]: [f64; 2], sample: &Sample) -> Result<Vec<f64>, Refusal> {
    let total = sample.total();
    let sum = if sample.is_empty() { 0.0 } else { sample.mean_of(|x| x) * total };
    Ok(match (law, known) {
        (Law::Poisson, _) => vec![(a + sum) / (b + total)],
        (Law::Exponential, _) => vec![(a + total) / (b + sum)],
        (Law::Binomial, [trials]) => vec![*trials, (a + sum) / (a + b + trials * total)],
        (Law::Normal, [deviation]) => {
            let (before, each) = (1.0 / (b * b), 1.0 / (deviation * deviation));
            vec![(a * before + sum * each) / (before + total * each), *deviation]
        }
        _ => return Err("has no conjugate prior"),
    })
}

/// Parameters of a distribution of angles, wrapped to the circle.
type Back = Box<dyn Fn(Vec<f64>) -> Vec<f64>>;

/// The sample of a distribution. On a circle numbers are angles: the mean is the direction of the mean vector, and
/// deviations are measured along the shorter arc.
fn on_line(law: Law, sample: &Sample, domain: &Domain) -> (Back, Sample) {
    let Domain::Bins(bins) = domain else { return (Box::new(|numbers| numbers), sample.clone()) };
    if !bins.is_circle() || !matches!(law, Law::Normal | Law::VonMises) || sample.is_empty() {
        return (Box::new(|numbers| numbers), sample.clone());
    }
    let ((low, high), scale) = (bins.ends(), turn_of(bins));
    let angles = sample.map(|x| (x - low) * scale);
    let back = move |angle: f64| low + (angle / scale).rem_euclid(high - low);
    if law == Law::VonMises {
        return (Box::new(move |numbers| vec![back(numbers[0]), numbers[1]]), angles);
    }
    let mean = angles.mean_of(f64::sin).atan2(angles.mean_of(f64::cos));
    let turn = std::f64::consts::TAU;
    let near = angles.map(|x| mean + (x - mean + 0.5 * turn).rem_euclid(turn) - 0.5 * turn);
    (Box::new(move |numbers| vec![back(numbers[0]), numbers[1] / scale]), near)
}

/// Radians of one unit of a circle.
fn turn_of(bins: &Bins) -> f64 {
    std::f64::consts::TAU / (bins.ends().1 - bins.ends().0)
}

/// A spread of angles in the units of the circle.
fn on_turn(law: Law, spread: f64, domain: &Domain) -> f64 {
    match domain {
        Domain::Bins(bins) if bins.is_circle() && law == Law::Normal => spread / turn_of(bins),
        _ => spread,
    }
}
