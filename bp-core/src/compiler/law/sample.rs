//! A sample: numbers with weights.
//!
//! In: numbers and weights. Out: weighted means. Invariant: equal numbers are one entry, and sums are computed in the
//! order of the entries, so that with integer weights the result does not depend on the order of observations.
//!
//! E\[g\] = Σ wᵢ g(xᵢ) / Σ wᵢ

use std::collections::BTreeMap;

/// Numbers and their weights.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Sample {
    /// Keyed by the bits of the number: any fixed order will do.
    weights: BTreeMap<u64, f64>,
}

impl Sample {
    /// Adds a number with a weight.
    pub fn add(&mut self, number: f64, weight: f64) {
        // −0 is 0.
        *self.weights.entry((number + 0.0).to_bits()).or_default() += weight;
    }

    /// Adds another sample.
    pub fn add_all(&mut self, other: &Sample) {
        other.iter().for_each(|(number, weight)| self.add(number, weight));
    }

    /// The numbers with their weights.
    pub fn iter(&self) -> impl Iterator<Item = (f64, f64)> {
        self.weights.iter().map(|(bits, weight)| (f64::from_bits(*bits), *weight))
    }

    /// Σ wᵢ
    pub fn total(&self) -> f64 {
        self.weights.values().sum()
    }

    /// Whether it is empty.
    pub fn is_empty(&self) -> bool {
        self.total() <= 0.0
    }

    /// Σ wᵢ g(xᵢ) / Σ wᵢ; numbers of weight 0 are skipped.
    pub fn mean_of(&self, g: impl Fn(f64) -> f64) -> f64 {
        let seen = self.iter().filter(|(_, weight)| *weight > 0.0);
        seen.map(|(number, weight)| weight * g(number)).sum::<f64>() / self.total()
    }

    /// Σ wᵢ xᵢ / Σ wᵢ, within the range of the values; exact for equal values. Sums do not overflow.
    pub fn mean(&self) -> f64 {
        let (low, high) = self.ends();
        if low >= high {
            return low;
        }
        let unit = power_of_two(low.abs().max(high.abs()));
        let first = self.mean_of(|x| x / unit);
        ((first + self.mean_of(|x| x / unit - first)) * unit).clamp(low, high)
    }

    /// The root of the mean squared distance from the mean, without the rounding of the mean.
    pub fn deviation(&self) -> f64 {
        let mean = self.mean();
        let distance = self.distance(mean);
        if distance == 0.0 {
            return 0.0;
        }
        let off = self.mean_of(|x| (0.5 * x - 0.5 * mean) / (0.5 * distance));
        distance * (1.0 - off * off).max(0.0).sqrt()
    }

    /// The root of the mean squared distance from a number: √(Σ wᵢ (xᵢ − m)² / Σ wᵢ). Squares neither overflow nor
    /// underflow.
    pub fn distance(&self, from: f64) -> f64 {
        let (low, high) = self.ends();
        let half = (0.5 * low - 0.5 * from).abs().max((0.5 * high - 0.5 * from).abs());
        if !(half > 0.0 && half.is_finite()) {
            return if half == 0.0 { 0.0 } else { f64::NAN };
        }
        let unit = power_of_two(half);
        let square = |x: f64| (0.5 * x - 0.5 * from) / unit;
        2.0 * self.mean_of(|x| square(x) * square(x)).sqrt() * unit
    }

    /// The smallest and the largest number.
    pub fn ends(&self) -> (f64, f64) {
        let seen = self.iter().filter(|(_, weight)| *weight > 0.0);
        seen.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (number, _)| {
            (low.min(number), high.max(number))
        })
    }

    /// The number with half of the weight on each side; the middle of two where they have half each.
    pub fn median(&self) -> f64 {
        let mut seen: Vec<(f64, f64)> = self.iter().filter(|(_, weight)| *weight > 0.0).collect();
        seen.sort_by(|(one, _), (other, _)| one.total_cmp(other));
        let (half, mut below) = (0.5 * self.total(), 0.0);
        for (position, (number, weight)) in seen.iter().enumerate() {
            below += weight;
            if below == half {
                return seen.get(position + 1).map_or(*number, |(next, _)| 0.5 * number + 0.5 * next);
            }
            if below > half {
                return *number;
            }
        }
        seen.last().map_or(f64::NAN, |(number, _)| *number)
    }

    /// The same weights on other numbers.
    pub fn map(&self, g: impl Fn(f64) -> f64) -> Sample {
        let mut mapped = Sample::default();
        self.iter().for_each(|(number, weight)| mapped.add(g(number), weight));
        mapped
    }
}

/// The largest power of two not above a positive number; at least 2⁻¹⁰²².
fn power_of_two(number: f64) -> f64 {
    f64::from_bits(number.max(f64::MIN_POSITIVE).to_bits() & f64::INFINITY.to_bits())
}

impl FromIterator<f64> for Sample {
    fn from_iter<I: IntoIterator<Item = f64>>(numbers: I) -> Self {
        let mut sample = Sample::default();
        numbers.into_iter().for_each(|number| sample.add(number, 1.0));
        sample
    }
}
