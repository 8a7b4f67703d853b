//! A mixture of named distributions of some slots.
//!
//! In: weights, and a named law of each slot in each component, with covariances. Out: moments, cumulative probabilities, quantiles.
//! Invariant: the weights sum to one; tails are sums of tails, never differences from one.

use super::Figure;
use super::named_law::NamedLaw;
use crate::random::Random;
use crate::sample::Moments;
use rand::RngExt;

/// One component.
#[derive(Clone, PartialEq, Debug)]
pub struct NamedComponent {
    /// Its weight.
    pub weight: f64,
    /// The law of each slot.
    pub laws: Vec<NamedLaw>,
    /// Covariances, row by row.
    pub covariance: Vec<f64>,
}

/// A mixture of named distributions.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct NamedMixture(pub Vec<NamedComponent>);

impl NamedMixture {
    /// The distribution of the slots at some positions.
    pub(crate) fn marginal(&self, places: &[usize]) -> Self {
        let of = |own: &NamedComponent| NamedComponent {
            weight: own.weight,
            laws: places.iter().map(|place| own.laws[*place]).collect(),
            covariance: (places.iter())
                .flat_map(|row| places.iter().map(|column| own.covariance[*row * own.laws.len() + *column]))
                .collect(),
        };
        Self(self.0.iter().map(of).collect())
    }

    fn average(&self, f: impl Fn(&NamedComponent) -> f64) -> f64 {
        self.0.iter().filter(|own| own.weight > 0.0).map(|own| own.weight * f(own)).sum()
    }

    /// The mean of a slot.
    pub fn mean(&self, place: usize) -> f64 {
        self.average(|own| own.laws[place].mean())
    }

    /// The covariance of two slots: the mean covariance, and the covariance of the means.
    pub(crate) fn covariance(&self, one: usize, other: usize) -> f64 {
        let means = [self.mean(one), self.mean(other)];
        self.average(|own| {
            let inside = own.covariance[one * own.laws.len() + other];
            inside + (own.laws[one].mean() - means[0]) * (own.laws[other].mean() - means[1])
        })
    }

    /// Values of all slots drawn at random, which are independent in each component.
    pub(crate) fn draw(&self, random: &mut Random) -> Vec<f64> {
        let mut left: f64 = random.random();
        let passed = |own: &&NamedComponent| {
            left -= own.weight;
            left < 0.0
        };
        let last = || self.0.iter().rfind(|own| own.weight > 0.0);
        let own = self.0.iter().find(passed).or_else(last).expect("internal: a mixture has components");
        own.laws.iter().map(|law| law.draw(random)).collect()
    }

    /// The density of a slot at a real.
    pub fn density(&self, place: usize, x: f64) -> f64 {
        self.average(|own| own.laws[place].density(x))
    }

    /// The density at a value of each slot, where the slots are independent in each component.
    pub(crate) fn density_at(&self, at: &[f64]) -> f64 {
        self.average(|own| own.laws.iter().zip(at).map(|(law, x)| law.density(*x)).product())
    }

    /// The smallest value of a slot that is not exceeded with this probability, by bisection between the quantiles of the components.
    pub fn quantile(&self, place: usize, level: f64) -> f64 {
        // In the tail that is smaller.
        let is_below = |x: f64| match level <= 0.5 {
            true => self.average(|own| own.laws[place].tails(x).0) < level,
            false => self.average(|own| own.laws[place].tails(x).1) > 1.0 - level,
        };
        let of = self.0.iter().filter(|own| own.weight > 0.0).map(|own| own.laws[place].quantile(level));
        let (mut from, mut to) =
            of.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (x.min(low), x.max(high)));
        if !is_below(from) {
            return from;
        }
        loop {
            let middle = from + 0.5 * (to - from);
            if !(from < middle && middle < to) {
                return to;
            }
            if is_below(middle) { from = middle } else { to = middle }
        }
    }

    /// The moments and quantiles of a slot; of a single component its name too.
    pub(crate) fn figure(&self, place: usize) -> Figure {
        if let [only] = self.0.as_slice() {
            return Figure::of_law(only.laws[place]);
        }
        let quantiles = Moments::LEVELS.map(|level| self.quantile(place, level));
        let deviation = self.covariance(place, place).max(0.0).sqrt();
        Figure::Mixture { mean: self.mean(place), deviation, quantiles }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::Law;

    /// Two exponential distributions of rates 1 and 2 in equal parts: E = 3/4, E x² = 5/4, and P(X > x) = (e⁻ˣ + e⁻²ˣ)/2, so that with
    /// u = e⁻ˣ the median has u² + u = 1.
    #[test]
    fn moments_and_quantiles_of_two_waiting_times() {
        let component = |rate: f64| NamedComponent {
            weight: 0.5,
            laws: vec![NamedLaw { law: Law::Exponential, parameters: [rate, 0.0, 0.0] }],
            covariance: vec![1.0 / (rate * rate)],
        };
        let mixture = NamedMixture(vec![component(1.0), component(2.0)]);
        assert!((mixture.mean(0) - 0.75).abs() < 1e-15);
        assert!((mixture.covariance(0, 0) - (1.25 - 0.5625)).abs() < 1e-15);
        let median = -(0.5 * (5f64.sqrt() - 1.0)).ln();
        assert!((mixture.quantile(0, 0.5) - median).abs() < 1e-15, "{}", mixture.quantile(0, 0.5));
        assert!((mixture.density(0, 1.0) - 0.5 * ((-1f64).exp() + 2.0 * (-2f64).exp())).abs() < 1e-15);
    }
}
