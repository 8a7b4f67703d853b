//! A mixture of named distributions of some slots.
//!
//! In: weights, and a named law of each slot in each component, with covariances. Out: moments, cumulative probabilities, quantiles.
//! Invariant: the weights sum to one; tails are sums of tails, never differences from one.

use super::Figure;
use super::named_law::NamedLaw;
use crate::random::Random;
use crate::sample::Moments;
use crate::special::gauss_legendre;
use rand::RngExt;
use serde::{Deserialize, Serialize};

/// The probabilities at whose quantiles the panels of an integral end; and how often a panel is halved.
const PANELS: [f64; 15] = [
    1e-30,
    1e-20,
    1e-14,
    1e-9,
    1e-5,
    1e-3,
    0.05,
    0.3,
    0.7,
    0.95,
    0.999,
    0.999_99,
    1.0 - 1e-8,
    1.0 - 1e-12,
    1.0 - 1e-15,
];
const MOST_HALVINGS: u32 = 40;

/// The integral over a panel, halved until the halves agree with the whole.
fn halved(integral: &dyn Fn(f64, f64) -> f64, [from, to]: [f64; 2], whole: f64, left: u32) -> f64 {
    let middle = from + 0.5 * (to - from);
    let halves = [integral(from, middle), integral(middle, to)];
    let sum = halves[0] + halves[1];
    match left == 0 || (sum - whole).abs() <= 1e-13 * sum.abs().max(1e-3) {
        true => sum,
        false => {
            halved(integral, [from, middle], halves[0], left - 1)
                + halved(integral, [middle, to], halves[1], left - 1)
        }
    }
}

/// One component.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct NamedComponent {
    /// Its weight.
    pub weight: f64,
    /// The law of each slot.
    pub laws: Vec<NamedLaw>,
    /// Covariances, row by row.
    pub covariance: Vec<f64>,
}

/// A mixture of named distributions.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
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

    /// The entropy of a slot: −∫ f ln f between the quantiles of the components, in panels that are halved until they agree.
    pub(crate) fn entropy(&self, place: usize) -> f64 {
        let used: Vec<&NamedComponent> = self.0.iter().filter(|own| own.weight > 0.0).collect();
        if used.iter().all(|own| own.laws[place] == used[0].laws[place]) {
            return used[0].laws[place].entropy();
        }
        let mut ends: Vec<f64> = used
            .iter()
            .flat_map(|own| PANELS.iter().map(|level| own.laws[place].quantile(*level)))
            .filter(|end| end.is_finite())
            .collect();
        ends.sort_by(f64::total_cmp);
        ends.dedup();
        let surprise = |x: f64| {
            let f = self.density(place, x);
            if f > 0.0 && f.is_finite() { -f * f.ln() } else { 0.0 }
        };
        let whole = |from: f64, to: f64| gauss_legendre(&surprise, from, to);
        let panel = |ends: &[f64]| halved(&whole, [ends[0], ends[1]], whole(ends[0], ends[1]), MOST_HALVINGS);
        ends.windows(2).map(panel).sum()
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
        // −∫ f ln f by the substitution u = e⁻ˣ, f = (u + 2u²)/2, dx = du/u: −∫₀¹ (1 + 2u)/2 ln((u + 2u²)/2) du, by parts.
        // −½ [∫ (1 + 2u)(ln u + ln(1 + 2u) − ln 2) du] with ∫ ln u (1 + 2u) = −3/2, ∫ (1 + 2u) ln(1 + 2u) = (9/4) ln 3 − 1.
        let entropy = -0.5 * (-1.5 + 2.25 * 3f64.ln() - 1.0 - 2.0 * std::f64::consts::LN_2);
        assert!((mixture.entropy(0) - entropy).abs() < 1e-11, "{} {entropy}", mixture.entropy(0));
        assert!((mixture.density(0, 1.0) - 0.5 * ((-1f64).exp() + 2.0 * (-2f64).exp())).abs() < 1e-15);
    }
}
