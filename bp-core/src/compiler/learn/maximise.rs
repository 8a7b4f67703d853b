//! Accelerated expectation–maximisation.
//!
//! In: an E step, and statistics to start from. Out: a local maximum of the likelihood. Invariant: no step lowers ln L
//! + ln prior; a step that would is shortened, or is the last.
//!
//! Dempster, Laird and Rubin, *Journal of the Royal Statistical Society* B 39:1-38, 1977. EM converges slowly if much
//! is hidden, so each step is extrapolated from the last ones (`accelerate.rs`); if that is outside the domain the step
//! is shortened, and if it lowers ln L it is replaced by the plain step.

use super::Settings;
use super::accelerate::History;
use super::climb::{climb, climbed, share_of_limit};
use super::distribution::{Argument, Cell, Distribution, Kind, Learnable, Share, cells_of};
use super::estimate::{Outcome, Step, estimate, spreads};
use super::expect::{Expectation, Expected};
use super::floor::held;
use super::likelihood::ln_prior;
use super::report::Course;
use super::statistics::Statistic;
use crate::error::Error;
use crate::law::Law;
use crate::progress::Work;
use std::collections::BTreeSet;

/// Number of halvings of a step that lowers the likelihood.
const MOST_HALVINGS: usize = 12;

/// The share of its limit from which on a mean is reported to be at it: ln L rises so little there that the iteration may rest
/// before the limit itself.
const AT_LIMIT: f64 = 0.01;

/// Relative rounding error of a sum of logarithms.
const ROUNDING: f64 = 1e-13;

/// The result of learning, its data, and the course of the iteration.
pub(super) struct Maximised {
    pub(super) outcomes: Vec<Outcome>,
    pub(super) statistics: Vec<Statistic>,
    pub(super) course: Course,
}

/// A point of the iteration: its numbers, and their expected statistics.
struct Point {
    numbers: Vec<f64>,
    expected: Expected,
    /// ln L + ln prior
    objective: f64,
}

/// The state of an iteration.
struct Iteration<'i> {
    learnable: &'i mut Learnable,
    cases: &'i dyn Expectation,
    cells: Vec<Cell>,
    spreads: Vec<f64>,
    settings: &'i Settings,
    /// Whether distributions over integers and bins are fitted with their normalising constants: set once a step without
    /// them was too long, or the steps without them have converged.
    climbs: bool,
}

/// Iterates until neither ln L nor any number changes by more than the thresholds. Distributions that are kept start
/// from their numbers, the others from the statistics.
pub(super) fn maximise(
    learnable: &mut Learnable,
    cases: &dyn Expectation,
    start: &[Statistic],
    keep: &[bool],
    settings: &Settings,
    progress: &mut dyn FnMut(usize, f64),
) -> Result<Maximised, Error> {
    let spreads = spreads(learnable, start);
    let first = Step { keep, spreads: &spreads, iterating: true };
    let mut outcomes = estimate(learnable, start, &first)?;
    let cells: BTreeSet<Cell> = learnable.distributions().iter().flat_map(|it| cells_of(&it.kind)).collect();
    let cells = cells.into_iter().collect();
    let mut iteration = Iteration { learnable, cases, cells, spreads, settings, climbs: false };
    let mut course = Course { seed: settings.seed, drawn: keep.contains(&false), ..Course::default() };
    let mut at = iteration.point()?;
    let (mut history, mut rests) = (History::default(), 0);
    let work = Work::without_end();
    loop {
        course.steps += 1;
        course.trail.push(at.objective);
        progress(course.steps, at.expected.ln_likelihood);
        course.interrupted = !course.converged && !work.goes_on();
        if course.converged || course.interrupted || course.steps >= settings.iterations {
            break;
        }
        outcomes = iteration.step(&at)?;
        let plain = iteration.numbers();
        let scales = iteration.scales(&plain);
        let further = history.further(&at.numbers, &plain, &scales);
        let next = match further.and_then(|further| iteration.further(&at, &plain, further)) {
            Some(next) => next,
            None => {
                history.forget();
                let next = iteration.point_at(&plain)?;
                match iteration.accepted(&at, next)? {
                    Some(next) => next,
                    // The step of a distribution over integers or bins was too long, and so were all parts of it.
                    None if !iteration.climbs => {
                        iteration.climbs = true;
                        iteration.put(&at.numbers);
                        continue;
                    }
                    None => {
                        iteration.put(&at.numbers);
                        (course.converged, course.held) = (true, true);
                        break;
                    }
                }
            }
        };
        // The accelerated step measures the remaining distance; after a plain one it is unknown.
        let rest = iteration.rests(&at, &next.numbers, next.objective, &scales)
            && iteration.rests(&at, &plain, next.objective, &scales);
        rests = if rest { rests + 1 } else { 0 };
        course.converged = rests > 1;
        at = next;
        // Without normalising constants the iteration may rest beside the maximum of ln L: those steps are not M steps.
        if course.converged && !iteration.climbs && iteration.has_climbed() {
            (iteration.climbs, course.converged, rests) = (true, false, 0);
            history = History::default();
        }
    }
    iteration.put(&at.numbers);
    course.ln_likelihood = at.expected.ln_likelihood;
    Ok(Maximised { outcomes, statistics: at.expected.statistics, course })
}

impl Iteration<'_> {
    fn numbers(&self) -> Vec<f64> {
        self.cells.iter().map(|cell| self.learnable.number(*cell)).collect()
    }

    fn put(&mut self, numbers: &[f64]) {
        for (cell, number) in self.cells.iter().zip(numbers) {
            self.learnable.set(*cell, *number);
        }
    }

    /// Whether there is a distribution over integers or bins, which has a normalising constant of its own.
    fn has_climbed(&self) -> bool {
        self.learnable.distributions().iter().any(|it| climbed(self.learnable, it).is_some())
    }

    /// The M step.
    fn step(&mut self, at: &Point) -> Result<Vec<Outcome>, Error> {
        let statistics = &at.expected.statistics;
        let all = self.learnable.distributions().iter();
        let keep: Vec<bool> = match self.climbs {
            true => all.map(|it| climbed(self.learnable, it).is_some()).collect(),
            false => vec![false; statistics.len()],
        };
        let step = Step { keep: &keep, spreads: &self.spreads, iterating: true };
        let mut outcomes = estimate(self.learnable, statistics, &step)?;
        if self.climbs {
            climb(self.learnable, statistics, &self.spreads);
            let empty = |statistic: &Statistic| matches!(statistic, Statistic::Sample(it) if it.is_empty());
            let all = outcomes.iter_mut().zip(statistics).zip(self.learnable.distributions());
            let of_kept = all.zip(&keep).filter(|(_, keep)| **keep);
            of_kept.for_each(|(((outcome, statistic), distribution), _)| {
                *outcome = match share_of_limit(self.learnable, distribution) {
                    _ if empty(statistic) => Outcome::Empty,
                    share if share > AT_LIMIT => Outcome::Limited,
                    _ => Outcome::Fitted,
                };
            });
        }
        Ok(outcomes)
    }

    /// The E step for the current numbers of the program.
    fn point(&self) -> Result<Point, Error> {
        let expected = self.cases.expect(self.learnable)?;
        let all = self.learnable.distributions().iter();
        let prior: f64 = all.map(|it| ln_prior(self.learnable, it)).sum();
        Ok(Point { numbers: self.numbers(), objective: expected.ln_likelihood + prior, expected })
    }

    fn point_at(&mut self, numbers: &[f64]) -> Result<Point, Error> {
        self.put(numbers);
        self.point()
    }

    /// The next point; if it lowers the likelihood, a nearer one that does not, if there is one. (At first a distribution
    /// over integers or bins is fitted without its normalising constant, so that its step may be too long.)
    fn accepted(&mut self, at: &Point, next: Point) -> Result<Option<Point>, Error> {
        let least = at.objective - ROUNDING * at.objective.abs();
        if next.objective >= least {
            return Ok(Some(next));
        }
        let whole = next.numbers;
        for halving in 1..=MOST_HALVINGS {
            let part = 0.5_f64.powi(halving as i32);
            let numbers: Vec<f64> =
                at.numbers.iter().zip(&whole).map(|(from, to)| from + part * (to - from)).collect();
            let next = self.point_at(&numbers)?;
            if next.objective >= least {
                return Ok(Some(next));
            }
        }
        Ok(None)
    }

    /// Whether neither ln L nor any number changes by more than the thresholds.
    fn rests(&self, at: &Point, numbers: &[f64], objective: f64, scales: &[f64]) -> bool {
        let Settings { threshold, tolerance, .. } = self.settings;
        let mut moved = at.numbers.iter().zip(numbers).zip(scales);
        (objective - at.objective).abs() <= threshold * objective.abs().max(1.0)
            && moved.all(|((from, to), scale)| (to - from).abs() <= tolerance * scale)
    }

    /// The scale of the change of each number: its magnitude; for a mean at least the deviation, for a probability or
    /// rate at least 10⁻⁴.
    fn scales(&self, numbers: &[f64]) -> Vec<f64> {
        const LEAST: f64 = 1e-4;
        let mut scales: Vec<f64> = numbers.iter().map(|number| number.abs()).collect();
        let place = |cell: &Cell| self.cells.binary_search(cell).expect("internal: a cell of the program");
        let mut at_least = |cell: &Cell, least: f64| {
            let place = place(cell);
            scales[place] = scales[place].max(least);
        };
        for distribution in self.learnable.distributions() {
            match &distribution.kind {
                Kind::Row(row) => {
                    for share in row {
                        if let Share::Learned(cell) = share {
                            at_least(cell, LEAST);
                        }
                    }
                }
                Kind::Regression(cells) => {
                    let Some((deviation, coefficients)) = cells.split_last() else { continue };
                    let deviation = numbers[place(deviation)];
                    coefficients.iter().for_each(|cell| at_least(cell, deviation));
                }
                Kind::Law(law, arguments) => {
                    let own = self.learnable.arguments(arguments);
                    let least = match law {
                        Law::Normal | Law::Lognormal | Law::Cauchy | Law::Laplace => [own[1], 0.0, 0.0],
                        Law::StudentT => [0.0, own[2], 0.0],
                        Law::VonMises => [1.0, LEAST, 0.0],
                        Law::Uniform => [own[1] - own[0]; 3],
                        Law::Binomial | Law::Poisson | Law::Beta | Law::Geometric | Law::NegativeBinomial => {
                            [LEAST; 3]
                        }
                        _ => [0.0; 3],
                    };
                    for (argument, least) in arguments.iter().zip(least) {
                        if let Argument::Learned(cell) = argument {
                            at_least(cell, least);
                        }
                    }
                }
            }
        }
        scales
    }

    /// The accelerated point, or one on the way to it that is valid for every distribution; nothing if the likelihood
    /// is lower there.
    fn further(&mut self, at: &Point, plain: &[f64], further: Vec<f64>) -> Option<Point> {
        for halving in 0..=MOST_HALVINGS {
            let part = 0.5_f64.powi(halving as i32);
            let numbers: Vec<f64> =
                plain.iter().zip(&further).map(|(from, to)| from + part * (to - from)).collect();
            self.put(&numbers);
            self.sum_rows();
            let all = self.learnable.distributions().iter().zip(&self.spreads);
            let is_possible = |it: &Distribution, spread: f64| {
                self.is_possible(&it.kind, spread) && share_of_limit(self.learnable, it) <= 1.0
            };
            if all.into_iter().all(|(it, spread)| is_possible(it, *spread)) {
                return self.point().ok().filter(|point| point.objective >= at.objective);
            }
        }
        None
    }

    /// Removes rounding from rows that sum to one.
    fn sum_rows(&mut self) {
        for position in 0..self.learnable.distributions().len() {
            let kind = &self.learnable.distributions()[position].kind;
            if matches!(kind, Kind::Row(row) if !row.contains(&Share::Rest)) {
                let cells = cells_of(kind);
                let total: f64 = cells.iter().map(|cell| self.learnable.number(*cell)).sum();
                cells.iter().for_each(|cell| self.learnable.set(*cell, self.learnable.number(*cell) / total));
            }
        }
    }

    fn is_possible(&self, kind: &Kind, spread: f64) -> bool {
        match kind {
            Kind::Row(row) => {
                let learned = cells_of(kind).into_iter().map(|cell| self.learnable.number(cell));
                let learned: Vec<f64> = learned.collect();
                let total: f64 = learned.iter().sum();
                let sums = match row.contains(&Share::Rest) {
                    true => total <= 1.0,
                    false => (total - 1.0).abs() < 1e-12,
                };
                sums && learned.iter().all(|p| (0.0..=1.0).contains(p))
            }
            Kind::Law(law, arguments) => {
                let numbers = self.learnable.arguments(arguments);
                law.refuses(&numbers).is_none() && !held(*law, numbers, spread).1
            }
            Kind::Regression(cells) => {
                let numbers: Vec<f64> = cells.iter().map(|cell| self.learnable.number(*cell)).collect();
                numbers.iter().all(|number| number.is_finite()) && numbers[numbers.len() - 1] > 0.0
            }
        }
    }
}
