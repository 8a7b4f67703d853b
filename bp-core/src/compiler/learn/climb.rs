//! The M step of laws over integers and bins, which has no closed form.
//!
//! In: a program with its numbers, and the expected statistics of each distribution. Out: numbers with a larger
//! expected ln L of these laws, normalised over their domains. Invariant: no step lowers it.
//!
//! Newton's steps in one or two parameters of a law at a time, with derivatives from finite differences of ln L; where it is
//! not concave, the steps follow the gradient. A normal law is parametrised by m/s² and 1/s², in which ln L is concave:
//! where the values lie at both ends of the domain, it increases towards s = ∞, along a curve on which m/s² stays
//! finite.
//!
//! Where all values of a law of counts or positive numbers lie at the upper end of the domain, ln L increases with its mean
//! towards ∞: the mean is a million times the largest value at most, from which on the law over the domain hardly
//! changes.

use super::distribution::{Argument, Cell, Distribution, Kind, Learnable};
use super::floor::{held, least_deviation};
use super::likelihood::{ln_likelihood, ln_prior};
use super::statistics::Statistic;
use crate::law::{Law, MOST_SHAPE, Sample};
use crate::model::Domain;
use std::collections::HashMap;

/// Limit of the steps for one law, and of the halvings of each.
const MOST: usize = 30;

/// Finite difference for derivatives, in the scale of a number.
const DIFFERENCE: f64 = 1e-4;

/// The largest deviation that is sought, as a multiple of that of all values: such a law is flat over them, and its
/// mean not so far away that densities lose digits.
const WIDEST: f64 = 30.0;

/// A step below this, in the scale of each number, is the last.
const REST: f64 = 1e-9;

/// Increases the expected ln L of laws over finite domains.
pub(super) fn climb(learnable: &mut Learnable, statistics: &[Statistic], spreads: &[f64]) {
    let mut users: HashMap<Cell, Vec<usize>> = HashMap::new();
    for (position, distribution) in learnable.distributions().iter().enumerate() {
        learned(distribution).into_iter().for_each(|cell| users.entry(cell).or_default().push(position));
    }
    for position in 0..statistics.len() {
        let distribution = &learnable.distributions()[position];
        let cells = learned(distribution);
        let Some((law, arguments)) = climbed(learnable, distribution).filter(|_| !cells.is_empty()) else {
            continue;
        };
        let (law, arguments) = (law, arguments.to_vec());
        let mut together: Vec<usize> = cells.iter().flat_map(|cell| &users[cell]).copied().collect();
        together.sort_unstable();
        together.dedup();
        let Statistic::Sample(sample) = &statistics[position] else { continue };
        if sample.is_empty() {
            continue;
        }
        // Location and scale together; the degrees of freedom, which come before them, by themselves.
        for cells in cells.rchunks(2) {
            let own = (&*learnable, position);
            let (chart, cells) =
                (Chart::of(own, (law, &arguments), sample, spreads[position]), cells.to_vec());
            Own { together: together.clone(), statistics, spreads, chart, cells }.climb(learnable);
        }
    }
}

/// Its law and arguments, if it is a law over integers or bins. (The likelihood of a uniform law is piecewise constant:
/// its ends are fitted.)
pub(super) fn climbed<'d>(
    learnable: &Learnable,
    distribution: &'d Distribution,
) -> Option<(Law, &'d [Argument])> {
    let Kind::Law(law, arguments) = &distribution.kind else { return None };
    (*law != Law::Uniform && learnable.count(distribution).is_some()).then_some((*law, arguments))
}

/// The mean of a law over integers or bins as a share of its limit; 0 of a law without a limit. Of `half_cauchy` and `weibull`, whose
/// mean may be infinite, it is the scale.
pub(super) fn share_of_limit(learnable: &Learnable, distribution: &Distribution) -> f64 {
    let (Kind::Law(law, arguments), Some(count)) = (&distribution.kind, learnable.count(distribution)) else {
        return 0.0;
    };
    let numbers = learnable.arguments(arguments);
    let size = match law {
        Law::Poisson
        | Law::Geometric
        | Law::NegativeBinomial
        | Law::Exponential
        | Law::Gamma
        | Law::HalfNormal => law.mean(&numbers),
        Law::HalfCauchy => numbers[0],
        Law::Weibull => numbers[1],
        _ => return 0.0,
    };
    let largest = learnable.domain(distribution).number(count.saturating_sub(1));
    size / (MOST_SHAPE * largest.abs().max(1.0))
}

/// The cells of a law that are learned.
fn learned(distribution: &Distribution) -> Vec<Cell> {
    let Kind::Law(_, arguments) = &distribution.kind else { return Vec::new() };
    let cell = |argument: &Argument| match argument {
        Argument::Learned(cell) => Some(*cell),
        Argument::Known(_) => None,
    };
    arguments.iter().filter_map(cell).collect()
}

/// The coordinates in which a law is optimised.
enum Chart {
    /// Its own parameters; the step of a mean is bounded by the deviation, that of other parameters by themselves.
    Own { law: Law, known: Option<f64> },
    /// (m − centre) / s² and 1 / s², the second between two bounds; and the spread of the values.
    Precision { centre: f64, bounds: [f64; 2], spread: f64 },
}

impl Chart {
    fn of(
        (learnable, position): (&Learnable, usize),
        (law, arguments): (Law, &[Argument]),
        sample: &Sample,
        spread: f64,
    ) -> Self {
        let distribution = &learnable.distributions()[position];
        let both = learned(distribution).len() == 2;
        let is_circle = matches!(learnable.domain(distribution), Domain::Bins(bins) if bins.is_circle());
        let centre = match law {
            Law::Normal if both && !is_circle => sample.mean(),
            Law::Lognormal if both && sample.ends().0 > 0.0 => sample.map(f64::ln).mean(),
            _ => {
                let known = learnable.arguments(arguments).get(1).copied().filter(|_| !both);
                return Chart::Own { law, known };
            }
        };
        let spread = if spread > 0.0 { spread } else { 1.0 };
        let bounds =
            [WIDEST * spread, least_deviation(spread)].map(|deviation| 1.0 / (deviation * deviation));
        Chart::Precision { centre, bounds, spread }
    }

    /// The coordinates of a law's numbers, moved inside the bounds so that differences can be taken.
    fn coordinates(&self, numbers: &[f64]) -> Vec<f64> {
        match self {
            Chart::Own { .. } => numbers.to_vec(),
            Chart::Precision { centre, bounds: [least, most], .. } => {
                let precision = 1.0 / (numbers[1] * numbers[1]);
                let inside =
                    precision.clamp(least * (1.0 + 4.0 * DIFFERENCE), most * (1.0 - 4.0 * DIFFERENCE));
                vec![(numbers[0] - centre) * precision, inside]
            }
        }
    }

    fn numbers(&self, at: &[f64]) -> Vec<f64> {
        match self {
            Chart::Own { .. } => at.to_vec(),
            Chart::Precision { centre, .. } => vec![centre + at[0] / at[1], 1.0 / at[1].sqrt()],
        }
    }

    fn scales(&self, at: &[f64]) -> Vec<f64> {
        const LEAST: f64 = 1e-4;
        let scale = |(place, number): (usize, &f64)| match (self, place) {
            (Chart::Precision { spread, .. }, 0) => at[1].sqrt().max(1.0 / spread),
            (Chart::Precision { .. }, _) => *number,
            (Chart::Own { law: Law::Normal | Law::Lognormal, known }, 0)
                if at.len() == 2 || known.is_some() =>
            {
                known.unwrap_or(at[at.len() - 1])
            }
            (Chart::Own { law: Law::Cauchy | Law::Laplace | Law::StudentT, .. }, 0) if at.len() == 2 => at[1],
            (Chart::Own { law: Law::VonMises, .. }, 0) => 1.0,
            _ => number.abs().max(LEAST),
        };
        at.iter().enumerate().map(scale).collect()
    }
}

/// ln L near a point, in its scales times [`DIFFERENCE`]: first, second and mixed differences.
struct Local {
    slope: [f64; 2],
    bend: [f64; 2],
    mixed: f64,
}

impl Local {
    /// Newton's step; a gradient step where ln L is not concave.
    fn newton(&self) -> [f64; 2] {
        let Self { slope: [one, other], bend: [first, second], mixed } = self;
        let determinant = first * second - mixed * mixed;
        if *first < 0.0 && determinant > 0.0 {
            return [
                -(one * second - other * mixed) / determinant,
                -(other * first - one * mixed) / determinant,
            ];
        }
        let length = one.hypot(*other).max(f64::MIN_POSITIVE) * DIFFERENCE;
        [one / length, other / length]
    }

    /// The step of the first coordinate, given that of the second.
    fn beside(&self, second: f64) -> f64 {
        let slope = self.slope[0] + self.mixed * second;
        if self.bend[0] < 0.0 { -slope / self.bend[0] } else { 0.0 }
    }
}

/// One law, and those that share a number with it.
struct Own<'o> {
    together: Vec<usize>,
    statistics: &'o [Statistic],
    spreads: &'o [f64],
    chart: Chart,
    cells: Vec<Cell>,
}

impl Own<'_> {
    /// The expected ln L at a point, whose numbers are set in the program; −∞ where they are invalid.
    fn value(&self, learnable: &mut Learnable, at: &[f64]) -> f64 {
        let numbers = self.chart.numbers(at);
        self.cells.iter().zip(numbers).for_each(|(cell, number)| learnable.set(*cell, number));
        let mut sum = 0.0;
        for position in &self.together {
            let distribution = &learnable.distributions()[*position];
            let Kind::Law(law, arguments) = &distribution.kind else { continue };
            let numbers = learnable.arguments(arguments);
            let is_beyond = || share_of_limit(learnable, distribution) > 1.0;
            if law.refuses(&numbers).is_some()
                || held(*law, numbers, self.spreads[*position]).1
                || is_beyond()
            {
                return f64::NEG_INFINITY;
            }
            let seen = ln_likelihood(learnable, distribution, &self.statistics[*position]);
            sum += seen + ln_prior(learnable, distribution);
        }
        if sum.is_finite() { sum } else { f64::NEG_INFINITY }
    }

    fn climb(&self, learnable: &mut Learnable) {
        let numbers: Vec<f64> = self.cells.iter().map(|cell| learnable.number(*cell)).collect();
        let mut at = self.chart.coordinates(&numbers);
        let mut best = self.value(learnable, &at);
        for _ in 0..MOST {
            let scales = self.chart.scales(&at);
            let step = self.step(learnable, &at, &scales, best);
            let moved = (0..MOST as i32).find_map(|halving| {
                let part = 0.5_f64.powi(halving);
                let to =
                    at.iter().zip(&step).zip(&scales).map(|((at, step), scale)| at + part * step * scale);
                let to: Vec<f64> = to.collect();
                let value = self.value(learnable, &to);
                (value > best).then_some((to, value, part))
            });
            let Some((to, value, part)) = moved else { break };
            (at, best) = (to, value);
            if step.iter().all(|step| (part * step).abs() <= REST) {
                break;
            }
        }
        self.value(learnable, &at);
    }

    /// The step from a point, in its scales.
    fn step(&self, learnable: &mut Learnable, at: &[f64], scales: &[f64], here: f64) -> Vec<f64> {
        let mut value = |first: f64, second: f64| {
            let moves = [first * DIFFERENCE, second * DIFFERENCE];
            let to = at.iter().zip(moves).zip(scales).map(|((at, step), scale)| at + step * scale);
            self.value(learnable, &to.collect::<Vec<f64>>()) - here
        };
        let (up, down) = (value(1.0, 0.0), value(-1.0, 0.0));
        let (slope, bend) = (0.5 * (up - down), up + down);
        if at.len() == 1 {
            let step = if bend < 0.0 { -slope / bend * DIFFERENCE } else { slope.signum() };
            return vec![if step.is_finite() { step.clamp(-1.0, 1.0) } else { 0.0 }];
        }
        let (up, down) = (value(0.0, 1.0), value(0.0, -1.0));
        let mixed = 0.25 * (value(1.0, 1.0) - value(1.0, -1.0) - value(-1.0, 1.0) + value(-1.0, -1.0));
        let local = Local { slope: [slope, 0.5 * (up - down)], bend: [bend, up + down], mixed };
        let mut step = local.newton().map(|step| step * DIFFERENCE);
        match self.chart {
            Chart::Own { .. } => {
                let longest = step.iter().fold(1.0, |longest: f64, step| longest.max(step.abs()));
                step = step.map(|step| step / longest);
            }
            Chart::Precision { bounds: [least, most], .. } => {
                // The precision within its bounds, and the best mean for it.
                let low = (least * (1.0 + 3.0 * DIFFERENCE) / at[1] - 1.0).max(-0.75);
                let high = (most * (1.0 - 3.0 * DIFFERENCE) / at[1] - 1.0).min(3.0);
                if !(low..=high).contains(&step[1]) {
                    step[1] = step[1].clamp(low, high);
                    step[0] = local.beside(step[1] / DIFFERENCE) * DIFFERENCE;
                }
            }
        }
        step.into_iter().map(|step| if step.is_finite() { step } else { 0.0 }).collect()
    }
}
