//! Moments, intervals and draws of an answer.
//!
//! In: the distribution of one numeric variable. Out: its moments. Invariant: a label is not a number: its mean is an
//! error.

use super::Posterior;
use super::lookup::slots_named;
use crate::answer::{Drawn, Part, PartLaw, Slot};
use crate::error::Error;
use crate::model::Domain;
use crate::sample::Draws;
use nalgebra::DMatrix;
use std::f64::consts::PI;

const BOTH: &str = "it is a distribution of finite variables and reals together: choose one of them";

impl Posterior {
    /// The mean of its variable; `true` counts as 1.
    ///
    /// # Errors
    /// It has several variables, instants or contexts, one of which must be chosen; its values are labels, or lie on a circle.
    pub fn mean(&self) -> Result<f64, Error> {
        self.mean_and_error().map(|[mean, _]| mean)
    }

    /// The mean of its variable, and its standard error: 0 if the answer is exact.
    ///
    /// # Errors
    /// As [`Posterior::mean`].
    pub fn mean_and_error(&self) -> Result<[f64; 2], Error> {
        let (part, slot) = self.single()?;
        self.not_on_a_circle(slot, "where a mean depends on the place of the cut")?;
        Ok(match &part.law {
            PartLaw::Normal { mean, .. } => [mean[0], 0.0],
            PartLaw::Mixture(mixture) => [mixture.mean(0), 0.0],
            PartLaw::ConditionalGaussian(_) => return Err(self.lookup(BOTH.to_owned())),
            PartLaw::NamedMixture(mixture) => [mixture.mean(0), 0.0],
            PartLaw::Laws { laws, .. } => [laws[0].mean(), 0.0],
            PartLaw::Finite(numbers) => [weighted(numbers, &self.numbers_of(slot)?), 0.0],
            PartLaw::Draws(draws, drawn) => match &drawn[0] {
                Drawn::Normals(normals) => normals.moments.mean,
                Drawn::At(position) => {
                    let numbers = self.numbers_of(slot)?;
                    draws.mean(|draw| number(&numbers, draws.value(draw, *position)))
                }
            },
        })
    }

    /// Refuses a variable whose values lie on a circle.
    fn not_on_a_circle(&self, slot: &Slot, why: &str) -> Result<(), Error> {
        let domain = &self.model().variables[slot.variable].domain;
        match domain.bins().is_some_and(|bins| bins.is_circle()) {
            true => {
                let name = slot.name(self.model());
                Err(self.lookup(format!("the values of `{name}` lie on a circle, {why}")))
            }
            false => Ok(()),
        }
    }

    /// The variance of its variable.
    ///
    /// # Errors
    /// As [`Posterior::mean`].
    pub fn variance(&self) -> Result<f64, Error> {
        let (part, slot) = self.single()?;
        let mean = self.mean()?;
        Ok(match &part.law {
            PartLaw::Normal { covariance, .. } => covariance[0],
            PartLaw::Mixture(mixture) => mixture.covariance(0, 0),
            PartLaw::ConditionalGaussian(_) => return Err(self.lookup(BOTH.to_owned())),
            PartLaw::NamedMixture(mixture) => mixture.covariance(0, 0),
            PartLaw::Laws { laws, .. } => laws[0].variance(),
            PartLaw::Finite(numbers) => {
                let squares: Vec<f64> =
                    self.numbers_of(slot)?.iter().map(|number| (number - mean).powi(2)).collect();
                weighted(numbers, &squares)
            }
            PartLaw::Draws(draws, drawn) => match &drawn[0] {
                Drawn::Normals(normals) => normals.moments.variance[0],
                Drawn::At(position) => {
                    let numbers = self.numbers_of(slot)?;
                    draws.mean(|draw| (number(&numbers, draws.value(draw, *position)) - mean).powi(2))[0]
                }
            },
        })
    }

    /// The standard deviation of its variable.
    ///
    /// # Errors
    /// As [`Posterior::mean`].
    pub fn deviation(&self) -> Result<f64, Error> {
        let (part, _) = self.single()?;
        Ok(match &part.law {
            PartLaw::Laws { laws, .. } => laws[0].deviation(),
            _ => self.variance()?.max(0.0).sqrt(),
        })
    }

    /// The covariance of two of its variables.
    ///
    /// # Errors
    /// As [`Posterior::mean`]; it does not contain these variables, or not jointly.
    pub fn covariance(&self, one: &str, other: &str) -> Result<f64, Error> {
        let part = self.one()?;
        let place = |name: &str| match slots_named(self.model(), &part.of, name).as_slice() {
            [place] => Ok(*place),
            _ => self.of(name).and(Err(self.lookup(format!("`{name}` has several elements: name one")))),
        };
        let (one, other) = (place(one)?, place(other)?);
        let numbers = [self.numbers_of(&part.of[one])?, self.numbers_of(&part.of[other])?];
        match &part.law {
            PartLaw::Normal { mean, covariance } => Ok(covariance[one * mean.len() + other]),
            PartLaw::Mixture(mixture) => Ok(mixture.covariance(one, other)),
            PartLaw::NamedMixture(mixture) => Ok(mixture.covariance(one, other)),
            PartLaw::ConditionalGaussian(law) => Ok(law.covariance(&part.of, [one, other], &numbers)),
            PartLaw::Laws { laws, covariance } => Ok(covariance[one * laws.len() + other]),
            PartLaw::Finite(_) => {
                let at = |place: usize| self.joint(part, [one, other], &numbers, place);
                let mean = [at(0), at(1)];
                Ok(at(2) - mean[0] * mean[1])
            }
            PartLaw::Draws(draws, drawn) => {
                let (Drawn::At(one), Drawn::At(other)) = (&drawn[one], &drawn[other]) else {
                    let message = "a variable that was not sampled has no covariance here".to_owned();
                    return Err(self.lookup(message));
                };
                let x = |draw: usize| number(&numbers[0], draws.value(draw, *one));
                let y = |draw: usize| number(&numbers[1], draws.value(draw, *other));
                let ([x_mean, _], [y_mean, _]) = (draws.mean(x), draws.mean(y));
                Ok(draws.mean(|draw| (x(draw) - x_mean) * (y(draw) - y_mean))[0])
            }
        }
    }

    /// E x, E y and E x y, by number, of two slots of a finite part.
    fn joint(&self, part: &Part, places: [usize; 2], numbers: &[Vec<f64>; 2], which: usize) -> f64 {
        let [one, other] = places;
        let both =
            part.marginal(&if one == other { vec![one] } else { vec![one.min(other), one.max(other)] });
        let all = both.probabilities().unwrap_or_default();
        let term = |(at, p): (usize, &f64)| {
            let own = crate::answer::ordinals(&both.of, at);
            let (first, last) = (own[0], own[own.len() - 1]);
            let (x, y) = if one <= other { (first, last) } else { (last, first) };
            let (x, y) = (numbers[0][x], numbers[1][y]);
            p * [x, y, x * y][which]
        };
        all.iter().enumerate().map(term).sum()
    }

    /// The central interval that contains its variable with this probability: from the quantile at (1 − level) / 2 to
    /// that at (1 + level) / 2.
    ///
    /// # Errors
    /// As [`Posterior::quantile`].
    pub fn interval(&self, level: f64) -> Result<[f64; 2], Error> {
        Ok([self.quantile(0.5 - 0.5 * level)?, self.quantile(0.5 + 0.5 * level)?])
    }

    /// The smallest value whose cumulative probability reaches this level; within a bin the probability is spread evenly.
    ///
    /// # Errors
    /// As [`Posterior::mean`]; a level that is not between 0 and 1; a circle, which has no first value.
    pub fn quantile(&self, level: f64) -> Result<f64, Error> {
        self.quantile_and_error(level).map(|[quantile, _]| quantile)
    }

    /// The quantile at a level, and its standard error: 0 if the answer is exact.
    ///
    /// # Errors
    /// As [`Posterior::quantile`].
    pub fn quantile_and_error(&self, level: f64) -> Result<[f64; 2], Error> {
        let (part, slot) = self.single()?;
        if !(level > 0.0 && level < 1.0) {
            return Err(self.lookup(format!("a quantile needs a probability between 0 and 1, not {level}")));
        }
        self.numbers_of(slot)?;
        self.not_on_a_circle(slot, "which has no first one")?;
        let (quantile, error) = part.quantiles(self.model(), 0, &[level])[0];
        Ok([quantile, error.unwrap_or(0.0)])
    }

    /// The draws of its variable with their weights, which sum to 1, if it was estimated by draws.
    ///
    /// # Errors
    /// As [`Posterior::mean`]; the answer is exact.
    pub fn draws(&self) -> Result<Vec<(f64, f64)>, Error> {
        let (part, slot) = self.single()?;
        match &part.law {
            PartLaw::Draws(draws, drawn) => match &drawn[0] {
                Drawn::At(position) => Ok(pairs(draws, *position, &self.numbers_of(slot)?)),
                Drawn::Normals(_) => Err(self.lookup(format!(
                    "`{}` was not sampled: each draw has its distribution",
                    slot.name(self.model())
                ))),
            },
            _ => Err(self.lookup("it is exact: there are no draws".to_owned())),
        }
    }

    /// The number of each value of a finite slot; nothing for a real.
    fn numbers_of(&self, slot: &Slot) -> Result<Vec<f64>, Error> {
        let domain = &self.model().variables[slot.variable].domain;
        if let Domain::Finite { labels, .. } = domain
            && !labels.is_empty()
        {
            let name = slot.name(self.model());
            return Err(self.lookup(format!("the values of `{name}` are labels, not numbers")));
        }
        Ok((0..slot.count).map(|ordinal| domain.number(ordinal)).collect())
    }
}

/// The number of a drawn value.
fn number(numbers: &[f64], value: f64) -> f64 {
    numbers.get(value as usize).copied().unwrap_or(value)
}

/// The draws of a slot, with their weights.
fn pairs(draws: &Draws, position: usize, numbers: &[f64]) -> Vec<(f64, f64)> {
    let pair = |draw: usize| (number(numbers, draws.value(draw, position)), draws.weight(draw));
    (0..draws.count()).map(pair).collect()
}

fn weighted(probabilities: &[f64], values: &[f64]) -> f64 {
    probabilities.iter().zip(values).map(|(p, value)| p * value).sum()
}

/// The differential entropy of a normal distribution: ½ ln det(2πe Σ); −∞ if it has no density.
pub(super) fn normal_entropy(covariance: &[f64], size: usize) -> f64 {
    match DMatrix::from_row_slice(size, size, covariance).cholesky() {
        Some(root) => {
            let ln_determinant: f64 = 2.0 * root.l().diagonal().map(f64::ln).sum();
            0.5 * (ln_determinant + size as f64 * (1.0 + (2.0 * PI).ln()))
        }
        None => f64::NEG_INFINITY,
    }
}
