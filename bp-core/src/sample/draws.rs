//! Draws, and what they say: probabilities, moments, quantiles, each with its standard error.
//!
//! In: draws with ln weights, or chains of draws. Out: estimates. Invariant: sums are made in order, so that they do not
//! depend on threads; a weight never overflows: the largest is subtracted.
//!
//! With Wₙ = wₙ / Σ w: E f ≈ Σ W f, standard error √Σ W² (f − E f)² (Geweke, *Econometrica* 57:1317-1339, 1989);
//! effective size 1 / Σ W² (Kong, Liu and Wong, JASA 89:278-288, 1994). Of chains, the standard error is that of the
//! means of batches. Of a quantile it is half the distance of the quantiles at one error above and below (Woodruff,
//! JASA 47:635-646, 1952).

use crate::distribution::ln_sum;

/// Draws of some slots.
#[derive(Clone, PartialEq, Debug)]
pub struct Draws {
    /// Draw after draw, the kept slots in order.
    values: Vec<f64>,
    kept: usize,
    weights: Vec<f64>,
    ln_mean_weight: f64,
    /// How many chains they are, where each draw follows from the one before.
    chains: Option<usize>,
}

/// What is said of a real.
#[derive(Clone, Copy, PartialEq, Debug)]
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
    /// At which levels quantiles are told.
    pub const LEVELS: [f64; 3] = [0.05, 0.5, 0.95];
}

/// Into how many batches a chain is cut.
const BATCHES: usize = 32;

impl Draws {
    /// Weighted draws of `kept` slots each.
    pub fn weighted(values: Vec<f64>, kept: usize, ln_weights: &[f64]) -> Self {
        let total = ln_sum(ln_weights);
        let weights = ln_weights.iter().map(|ln| if total.is_finite() { (ln - total).exp() } else { 0.0 });
        let ln_mean_weight = total - (ln_weights.len() as f64).ln();
        Self { values, kept, weights: weights.collect(), ln_mean_weight, chains: None }
    }

    /// Chains of equal length, one after the other.
    pub fn of_chains(values: Vec<f64>, kept: usize, chains: usize) -> Self {
        let count = values.len() / kept.max(1);
        let weights = vec![1.0 / count as f64; count];
        Self { values, kept, weights, ln_mean_weight: 0.0, chains: Some(chains) }
    }

    /// How many draws.
    pub fn count(&self) -> usize {
        self.weights.len()
    }

    /// Whether no draw has a weight: the evidence never happened.
    pub fn is_impossible(&self) -> bool {
        self.ln_mean_weight == f64::NEG_INFINITY
    }

    /// A kept slot of a draw.
    pub fn value(&self, draw: usize, position: usize) -> f64 {
        self.values[draw * self.kept + position]
    }

    /// ln P(evidence), and its standard error; `None` of chains, which do not tell it.
    pub fn ln_evidence(&self) -> Option<[f64; 2]> {
        let count = self.count() as f64;
        let spread: f64 = self.weights.iter().map(|weight| (weight - 1.0 / count).powi(2)).sum();
        self.chains.is_none().then_some([self.ln_mean_weight, spread.sqrt()])
    }

    /// How many draws of the answer itself would say as much.
    pub fn effective(&self) -> f64 {
        match self.chains {
            None => 1.0 / self.weights.iter().map(|weight| weight * weight).sum::<f64>(),
            Some(_) => {
                let of = |position: usize| {
                    let [mean, error] = self.mean(|draw| self.value(draw, position));
                    let [variance, _] = self.mean(|draw| (self.value(draw, position) - mean).powi(2));
                    if error > 0.0 { variance / (error * error) } else { f64::INFINITY }
                };
                (0..self.kept).map(of).fold(self.count() as f64, f64::min)
            }
        }
    }

    /// Σ W f, and its standard error.
    pub fn mean(&self, f: impl Fn(usize) -> f64) -> [f64; 2] {
        let draws = 0..self.count();
        let weighted = draws.clone().filter(|draw| self.weights[*draw] > 0.0);
        let mean: f64 = weighted.clone().map(|draw| self.weights[draw] * f(draw)).sum();
        let square: f64 = match self.chains {
            None => weighted.map(|draw| (self.weights[draw] * (f(draw) - mean)).powi(2)).sum(),
            Some(chains) => {
                let batches = chains * BATCHES.min((self.count() / chains).max(1));
                let length = self.count() / batches;
                let of = |batch: usize| {
                    let sum: f64 = (batch * length..(batch + 1) * length).map(&f).sum();
                    (sum / length as f64 - mean).powi(2)
                };
                (0..batches).map(of).sum::<f64>() / (batches as f64 * (batches as f64 - 1.0).max(1.0))
            }
        };
        [mean, square.sqrt()]
    }

    /// What is said of a real slot.
    pub fn moments(&self, position: usize) -> Moments {
        let x = |draw: usize| self.value(draw, position);
        let mean = self.mean(x);
        let variance = self.mean(|draw| (x(draw) - mean[0]).powi(2));
        let deviation = variance[0].sqrt();
        let error = if deviation > 0.0 { variance[1] / (2.0 * deviation) } else { 0.0 };
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
        let quantiles = Moments::LEVELS.map(|level| {
            let quantile = at(level);
            let [_, error] = self.mean(|draw| if x(draw) <= quantile { 1.0 } else { 0.0 });
            [quantile, 0.5 * (at(level + error) - at(level - error))]
        });
        Moments { mean, deviation: [deviation, error], variance, quantiles }
    }

    /// R̂ of a slot: how much wider all chains are together than each alone; near 1 where they have mixed (Gelman and
    /// Rubin, *Statistical Science* 7:457-472, 1992). `None` of a single chain, or of weighted draws.
    pub fn potential_reduction(&self, position: usize) -> Option<f64> {
        let chains = self.chains.filter(|chains| *chains > 1)?;
        let length = self.count() / chains;
        let (n, m) = (length as f64, chains as f64);
        let mean_of = |chain: usize| {
            (chain * length..(chain + 1) * length).map(|draw| self.value(draw, position)).sum::<f64>() / n
        };
        let means: Vec<f64> = (0..chains).map(mean_of).collect();
        let all = means.iter().sum::<f64>() / m;
        let between = means.iter().map(|mean| (mean - all).powi(2)).sum::<f64>() / (m - 1.0);
        let within = (0..chains)
            .map(|chain| {
                let square = |draw: usize| (self.value(draw, position) - means[chain]).powi(2);
                (chain * length..(chain + 1) * length).map(square).sum::<f64>() / (n - 1.0)
            })
            .sum::<f64>()
            / m;
        match within > 0.0 {
            true => Some(((n - 1.0) / n + between / within).sqrt()),
            // Chains that never move agree only where they stand at the same value.
            false => Some(if between > 0.0 { f64::MAX } else { 1.0 }),
        }
    }
}
