//! The next of several sorted draws of a law.
//!
//! In: a law, how many draws are left, and the last one before them. Out: ln of the density of the smallest of these, or a
//! draw of it. Invariant: it is larger than the one before it.
//!
//! Of k draws above a: P(X > x) = (S(x)/S(a))ᵏ, f(x) = k f(x) S(x)^(k−1) / S(a)ᵏ, with S = 1 − F. The product over all components
//! is n! Π f(xᵢ) for x₁ < … < xₙ (David and Nagaraja, *Order Statistics*, 3rd ed., section 2.2).

use super::law::{exactly, ln_density};
use crate::law::{Law, Parameters};
use rand::Rng;
use rand::RngExt;

/// The smallest of some draws.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Least {
    /// The law of a draw.
    pub law: Law,
    /// Its parameters.
    pub parameters: Parameters,
    /// How many draws there are.
    pub draws: usize,
    /// All of them are larger than this.
    pub above: Option<f64>,
}

impl Least {
    /// 1 − F(x)
    fn beyond(&self, x: f64) -> f64 {
        self.law.tails(x, exactly(self.law, &self.parameters)).1
    }

    /// ln of the density; −∞ where it is not larger than the one before it.
    pub fn ln_density(&self, x: f64) -> f64 {
        if self.above.is_some_and(|above| x <= above) {
            return f64::NEG_INFINITY;
        }
        let (draws, others) = (self.draws as f64, self.draws as f64 - 1.0);
        let others = if others > 0.0 { others * self.beyond(x).ln() } else { 0.0 };
        let all = self.above.map_or(0.0, |above| draws * self.beyond(above).ln());
        let ln = ln_density(self.law, x, &self.parameters) + draws.ln() + others - all;
        if ln.is_nan() { f64::NEG_INFINITY } else { ln }
    }

    /// A draw: S(x) = S(a) U^(1/k), by bisection. `None` where nothing lies above.
    pub fn draw(&self, by: &mut impl Rng) -> Option<f64> {
        let Some(above) = self.above else {
            let parameters = exactly(self.law, &self.parameters);
            return (0..self.draws).map(|_| self.law.draw(by, parameters)).min_by(f64::total_cmp);
        };
        let target = self.beyond(above) * by.random::<f64>().powf(1.0 / self.draws as f64);
        let (mut low, mut step) = (above, above.abs().max(1.0) * 1e-3);
        while self.beyond(low + step) > target {
            (low, step) = (low + step, 2.0 * step);
        }
        let mut high = low + step;
        if !(target > 0.0 && high.is_finite()) {
            return None;
        }
        loop {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                return Some(high);
            }
            (low, high) = if self.beyond(middle) > target { (middle, high) } else { (low, middle) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::seeded;

    const SORTED: Least =
        Least { law: Law::Exponential, parameters: [2.0, 0.0, 0.0], draws: 3, above: Some(0.5) };

    #[test]
    fn the_least_of_exponential_draws_is_exponential() {
        // By hand: above 0.5 the least of three draws of rate 2 waits with rate 6.
        for x in [0.5001, 0.6, 1.0, 3.0] {
            let expected = 6f64.ln() - 6.0 * (x - 0.5);
            assert!((SORTED.ln_density(x) - expected).abs() < 1e-12, "{x}");
        }
        assert_eq!(SORTED.ln_density(0.5), f64::NEG_INFINITY);
    }

    #[test]
    fn draws_follow_it() {
        // Kolmogorov–Smirnov: sup |F̂ − F| < 1.95/√n with probability 0.999.
        let mut random = seeded(3, "least");
        let mut drawn: Vec<f64> = (0..4000).map(|_| SORTED.draw(&mut random).unwrap()).collect();
        drawn.sort_by(f64::total_cmp);
        for (position, x) in drawn.iter().enumerate() {
            let cumulative = 1.0 - (-6.0 * (x - 0.5)).exp();
            assert!(((position + 1) as f64 / 4000.0 - cumulative).abs() < 1.95 / 4000f64.sqrt(), "{x}");
        }
    }
}
