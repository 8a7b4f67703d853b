//! Estimates from draws: probabilities, moments, quantiles, each with its standard error.
//!
//! In: draws with ln weights. Out: estimates. Invariant: sums have a fixed order, so that they do not depend on
//! threads; weights do not overflow, since the largest is subtracted.
//!
//! With Wₙ = wₙ / Σ w: E f ≈ Σ W f, standard error √Σ W² (f − E f)² (Geweke, *Econometrica* 57:1317-1339, 1989);
//! effective size 1 / Σ W² (Kong, Liu and Wong, JASA 89:278-288, 1994). Draws of chains have equal weights; `chains`
//! has their diagnostics. The error of a quantile is half the distance of the quantiles at one error above and below
//! (Woodruff, JASA 47:635-646, 1952).

use super::chains;
use crate::distribution::{ln_sum, normalise};
use serde::{Deserialize, Serialize};

/// Draws of some slots.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Draws {
    /// Draw after draw, the kept slots in order; then those of the repeats.
    values: Vec<f64>,
    kept: usize,
    weights: Vec<f64>,
    /// ln P(evidence), which Markov chains do not estimate.
    ln_mean_weight: Option<f64>,
    /// The length of a chain, where draws are those of Markov chains.
    chain: Option<usize>,
    /// The origin of each draw, where draws of one origin are not independent: numbers below the number of draws. Where there
    /// are several lists, each misses what the others show, and the largest error counts.
    origins: Vec<Vec<u32>>,
    /// Independent repeats with fewer draws of equal weights: their number, and the draws of each. Their scatter is an error that
    /// the draws themselves do not show.
    repeats: [usize; 2],
}

/// The standard error of a sum of parts, each of a draw; parts of one origin are not independent.
pub(super) fn error_of_sum(parts: impl Iterator<Item = (usize, f64)>, origins: Option<&[u32]>) -> f64 {
    let Some(origins) = origins else { return parts.map(|(_, part)| part * part).sum::<f64>().sqrt() };
    let mut sums = vec![0.0; origins.len()];
    parts.for_each(|(draw, part)| sums[origins[draw] as usize] += part);
    sums.iter().map(|sum| sum * sum).sum::<f64>().sqrt()
}

/// A quantile and its standard error: `at` gives the quantile at a level, `below` the probability of at most a number and its
/// standard error.
pub(crate) fn error_of_quantile(
    at: impl Fn(f64) -> f64,
    below: impl Fn(f64) -> [f64; 2],
    level: f64,
) -> [f64; 2] {
    let quantile = at(level);
    let [_, error] = below(quantile);
    let (low, high) = (at((level - error).max(0.0)), at((level + error).min(1.0)));
    [quantile, 0.5 * (high - low)]
}

/// Estimates about a real.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Moments {
    /// Expectation, and its standard error.
    pub mean: [f64; 2],
    /// Standard deviation, and its standard error.
    pub deviation: [f64; 2],
    /// Variance, and its standard error.
    pub variance: [f64; 2],
    /// The quantiles at [`Moments::LEVELS`], and their standard errors.
    pub quantiles: [[f64; 2]; 3],
}

impl Moments {
    /// The levels of the reported quantiles.
    pub const LEVELS: [f64; 3] = [0.05, 0.5, 0.95];
}

/// The unit in which the squares of some numbers neither overflow nor underflow: 1, unless the largest of them is far from 1.
fn unit_of(numbers: impl Iterator<Item = f64>) -> f64 {
    let largest = numbers.fold(0.0, |largest: f64, number| largest.max(number.abs()));
    let is_near = largest == 0.0 || largest.is_infinite() || (1e-140..=1e140).contains(&largest);
    if is_near { 1.0 } else { largest }
}

impl Draws {
    /// Weighted draws of `kept` slots each.
    pub fn weighted(values: Vec<f64>, kept: usize, ln_weights: &[f64]) -> Self {
        let mut weights = ln_weights.to_vec();
        normalise(&mut weights);
        let ln_mean_weight = ln_sum(ln_weights) - (ln_weights.len() as f64).ln();
        Self::of_weights(values, kept, weights, ln_mean_weight)
    }

    /// Draws of `kept` slots each, whose weights sum to one, or are all 0, and ln of the mean of these before.
    pub(crate) fn of_weights(values: Vec<f64>, kept: usize, weights: Vec<f64>, ln_mean_weight: f64) -> Self {
        let (chain, origins, repeats) = (None, Vec::new(), [0; 2]);
        Self { values, kept, weights, ln_mean_weight: Some(ln_mean_weight), chain, origins, repeats }
    }

    /// Draws of chains of `length` draws each, chain after chain.
    pub fn chained(values: Vec<f64>, kept: usize, count: usize, length: usize) -> Self {
        let weights = vec![1.0 / count as f64; count];
        let draws = Self::of_weights(values, kept, weights, f64::NAN);
        Self { ln_mean_weight: None, chain: Some(length), ..draws }
    }

    /// The same draws, of which those of one origin are not independent.
    pub fn of_origins(mut self, origins: Vec<u32>) -> Self {
        self.origins.push(origins);
        self
    }

    /// The same draws with the values of independent repeats, of equal lengths.
    pub(crate) fn with_repeats(mut self, repeats: Vec<&[f64]>) -> Self {
        self.repeats = [repeats.len(), repeats.first().map_or(0, |values| values.len() / self.kept)];
        repeats.into_iter().for_each(|values| self.values.extend(values));
        self
    }

    /// The number of draws.
    pub fn count(&self) -> usize {
        self.weights.len()
    }

    /// The length of each chain, if they are draws of Markov chains, chain after chain.
    pub fn chain(&self) -> Option<usize> {
        self.chain
    }

    /// Whether all weights are zero: no draw met the evidence.
    pub fn is_impossible(&self) -> bool {
        self.ln_mean_weight == Some(f64::NEG_INFINITY)
    }

    /// The weight of a draw; all weights sum to one.
    pub fn weight(&self, draw: usize) -> f64 {
        self.weights[draw]
    }

    /// A kept slot of a draw.
    pub fn value(&self, draw: usize, position: usize) -> f64 {
        self.values[draw * self.kept + position]
    }

    /// ln P(evidence), and its standard error; `None` for Markov chains.
    pub fn ln_evidence(&self) -> Option<[f64; 2]> {
        let count = self.count() as f64;
        let spread: f64 = self.weights.iter().map(|weight| (weight - 1.0 / count).powi(2)).sum();
        Some([self.ln_mean_weight?, spread.sqrt()])
    }

    /// The effective sample size.
    pub fn effective(&self) -> f64 {
        match self.chain {
            None => {
                let alone = 1.0 / self.weights.iter().map(|weight| weight * weight).sum::<f64>();
                let together = |origins: &Vec<u32>| {
                    let mut shares = vec![0.0; origins.len()];
                    origins.iter().zip(&self.weights).for_each(|(at, weight)| shares[*at as usize] += weight);
                    1.0 / shares.iter().map(|share| share * share).sum::<f64>()
                };
                let least = self.origins.iter().map(together).fold(alone, f64::min);
                match self.repeats {
                    [0, _] => least,
                    _ => (0..self.kept).map(|position| self.worth(position)).fold(least, f64::min),
                }
            }
            Some(length) => (0..self.kept)
                .map(|position| chains::effective(&self.column(position), length))
                .fold(self.count() as f64, f64::min),
        }
    }

    /// The largest split R-hat of the slots, near 1 for converged chains; `None` for independent draws.
    pub fn r_hat(&self) -> Option<f64> {
        let of = |length: usize| {
            (0..self.kept).map(|position| chains::r_hat(&self.column(position), length)).fold(1.0, f64::max)
        };
        self.chain.map(of)
    }

    /// The number of independent draws whose mean of a slot would have the same error.
    fn worth(&self, position: usize) -> f64 {
        let x = |draw: usize| self.value(draw, position);
        let [mean, error] = self.mean(x);
        let unit = unit_of((0..self.count()).map(|draw| x(draw) - mean));
        let square = |draw: usize| self.weights[draw] * ((x(draw) - mean) / unit).powi(2);
        (0..self.count()).map(square).sum::<f64>() / (error / unit).powi(2)
    }

    fn column(&self, position: usize) -> Vec<f64> {
        (0..self.count()).map(|draw| self.value(draw, position)).collect()
    }

    /// Σ W f, and its standard error.
    pub fn mean(&self, f: impl Fn(usize) -> f64) -> [f64; 2] {
        if let Some(length) = self.chain {
            let values: Vec<f64> = (0..self.count()).map(f).collect();
            return [chains::mean(&values), chains::error(&values, length)];
        }
        let weighted = (0..self.count()).filter(|draw| self.weights[*draw] > 0.0);
        // Exactly 1 where f is 1 for all.
        let total: f64 = weighted.clone().map(|draw| self.weights[draw]).sum();
        let mean = weighted.clone().map(|draw| self.weights[draw] * f(draw)).sum::<f64>() / total;
        let parts = weighted.map(|draw| (draw, self.weights[draw] * (f(draw) - mean)));
        let unit = unit_of(parts.clone().map(|(_, part)| part));
        let parts = parts.map(|(draw, part)| (draw, part / unit));
        let error = match self.origins.as_slice() {
            [] => error_of_sum(parts, None),
            all => all.iter().map(|own| error_of_sum(parts.clone(), Some(own))).fold(0.0, f64::max),
        };
        [mean, (error * unit).max(self.scatter(f, mean))]
    }

    /// The error that repeats show: the deviation of their means, which is that of fewer draws, and the distance of these from the
    /// mean of all, which shows a bias that falls with the number of draws.
    fn scatter(&self, f: impl Fn(usize) -> f64, mean: f64) -> f64 {
        let [repeats, size] = self.repeats;
        if repeats < 2 {
            return 0.0;
        }
        let of = |repeat: usize| {
            let first = self.count() + repeat * size;
            (first..first + size).map(&f).sum::<f64>() / size as f64
        };
        let means: Vec<f64> = (0..repeats).map(of).collect();
        let centre = means.iter().sum::<f64>() / repeats as f64;
        let unit = unit_of(means.iter().map(|own| own - centre).chain([centre - mean]));
        let squares: f64 = means.iter().map(|own| ((own - centre) / unit).powi(2)).sum();
        let share = size as f64 / self.count() as f64;
        let bias = if share < 1.0 { (centre - mean) / unit * share / (1.0 - share) } else { 0.0 };
        (squares / (repeats as f64 - 1.0) * share + bias * bias).sqrt() * unit
    }

    /// Estimates about a real slot.
    pub fn moments(&self, position: usize) -> Moments {
        let x = |draw: usize| self.value(draw, position);
        let mean = self.mean(x);
        let drawn = (0..self.count()).filter(|draw| self.weights[*draw] > 0.0);
        let unit = unit_of(drawn.map(|draw| x(draw) - mean[0]));
        let square = self.mean(|draw| ((x(draw) - mean[0]) / unit).powi(2));
        let deviation = square[0].sqrt() * unit;
        let error = if square[0] > 0.0 { square[1] / (2.0 * square[0].sqrt()) * unit } else { 0.0 };
        let variance = square.map(|square| square * unit * unit);
        let quantiles = self.quantiles(position, &Moments::LEVELS);
        let quantiles = [quantiles[0], quantiles[1], quantiles[2]];
        Moments { mean, deviation: [deviation, error], variance, quantiles }
    }

    /// The quantiles of a real slot, and their standard errors.
    pub fn quantiles(&self, position: usize, levels: &[f64]) -> Vec<[f64; 2]> {
        let x = |draw: usize| self.value(draw, position);
        let mut order: Vec<usize> = (0..self.count()).filter(|draw| self.weights[*draw] > 0.0).collect();
        order.sort_by(|one, other| x(*one).total_cmp(&x(*other)));
        let at = |level: f64| {
            let mut sum = 0.0;
            let reached = order.iter().find(|draw| {
                sum += self.weights[**draw];
                sum >= level
            });
            reached.or(order.last()).map_or(f64::NAN, |draw| x(*draw))
        };
        let below = |quantile: f64| self.mean(|draw| if x(draw) <= quantile { 1.0 } else { 0.0 });
        levels.iter().map(|level| error_of_quantile(at, below, *level)).collect()
    }

    /// The half-sample mode of a real slot: half of the weight in the shortest interval, again and again (Bickel and
    /// Frühwirth, *Computational Statistics & Data Analysis* 50:3500-3530, 2006).
    pub fn mode(&self, position: usize) -> f64 {
        let mut sorted: Vec<(f64, f64)> = (0..self.count())
            .filter(|draw| self.weights[*draw] > 0.0)
            .map(|draw| (self.value(draw, position), self.weights[draw]))
            .collect();
        sorted.sort_by(|one, other| one.0.total_cmp(&other.0));
        let mut half = sorted.as_slice();
        while half.len() > 2 {
            let shorter = shortest_half(half);
            if shorter.len() == half.len() {
                break;
            }
            half = shorter;
        }
        let total: f64 = half.iter().map(|(_, weight)| weight).sum();
        half.iter().map(|(value, weight)| value * weight).sum::<f64>() / total
    }
}

/// The shortest interval of ascending values that has half of their weight.
fn shortest_half(sorted: &[(f64, f64)]) -> &[(f64, f64)] {
    let wanted = 0.5 * sorted.iter().map(|(_, weight)| weight).sum::<f64>() * (1.0 - 1e-12);
    let (mut best, mut width) = (sorted, f64::INFINITY);
    let (mut end, mut sum) = (0, 0.0);
    for start in 0..sorted.len() {
        while sum < wanted && end < sorted.len() {
            sum += sorted[end].1;
            end += 1;
        }
        if sum < wanted {
            break;
        }
        let own = sorted[end - 1].0 - sorted[start].0;
        if own < width {
            (best, width) = (&sorted[start..end], own);
        }
        sum -= sorted[start].1;
    }
    best
}
