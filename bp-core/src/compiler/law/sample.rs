//! A sample: numbers with weights.
//!
//! In: numbers and weights. Out: weighted means. Invariant: equal numbers are one entry, and sums are computed in the
//! order of the entries, so that with integer weights the result does not depend on the order of observations.
//!
//! E\[g\] = Σ wᵢ g(xᵢ) / Σ wᵢ

use std::sync::OnceLock;

/// A number, by its bits, and its weight.
type Entry = (u64, f64);

/// Numbers and their weights.
#[derive(Clone, Debug, Default)]
pub struct Sample {
    /// In the order in which they were added, but for those that are merged already.
    added: Vec<Entry>,
    /// The number of entries above which equal numbers are merged.
    most: usize,
    /// In the order of the bits (any fixed order will do), each number once; made when the sample is read.
    merged: OnceLock<Vec<Entry>>,
}

impl Sample {
    /// Adds a number with a weight.
    pub fn add(&mut self, number: f64, weight: f64) {
        if let Some(merged) = self.merged.take() {
            self.added = merged;
        }
        if self.added.len() > self.most.max(64) {
            self.added = merged(std::mem::take(&mut self.added));
            self.most = 2 * self.added.len();
        }
        // −0 is 0.
        self.added.push(((number + 0.0).to_bits(), weight));
    }

    /// Adds another sample.
    pub fn add_all(&mut self, other: &Sample) {
        other.iter().for_each(|(number, weight)| self.add(number, weight));
    }

    /// The numbers with their weights.
    pub fn iter(&self) -> impl Iterator<Item = (f64, f64)> {
        let merged = self.merged.get_or_init(|| merged(self.added.clone()));
        merged.iter().map(|(bits, weight)| (f64::from_bits(*bits), *weight))
    }

    /// Σ wᵢ
    pub fn total(&self) -> f64 {
        self.iter().map(|(_, weight)| weight).sum()
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
        self.iter().map(|(number, weight)| (g(number), weight)).collect()
    }
}

/// Entries in the order of their bits, each number once with the sum of its weights.
fn merged(mut entries: Vec<Entry>) -> Vec<Entry> {
    if !entries.is_sorted_by_key(|(bits, _)| *bits) {
        entries.sort_by_key(|(bits, _)| *bits);
    }
    entries.dedup_by(|next, kept| {
        let equal = next.0 == kept.0;
        kept.1 += if equal { next.1 } else { 0.0 };
        equal
    });
    entries
}

/// The same numbers with the same weights.
impl PartialEq for Sample {
    fn eq(&self, other: &Self) -> bool {
        self.iter().eq(other.iter())
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

/// Numbers with weights.
impl FromIterator<(f64, f64)> for Sample {
    fn from_iter<I: IntoIterator<Item = (f64, f64)>>(numbers: I) -> Self {
        let bits = |(number, weight): (f64, f64)| ((number + 0.0).to_bits(), weight);
        Self { added: numbers.into_iter().map(bits).collect(), ..Self::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::Sample;
    use std::collections::BTreeMap;

    /// Samples are those of a map from numbers to weights, in whatever order numbers come and however often it is read.
    #[test]
    fn equal_numbers_are_one_entry() {
        let mut sample = Sample::default();
        let mut expected: BTreeMap<u64, f64> = BTreeMap::new();
        for step in 0..5000_u32 {
            let number = f64::from(step * 7919 % 1013) - 500.0;
            let weight = f64::from(step % 5);
            sample.add(number, weight);
            *expected.entry((number + 0.0).to_bits()).or_default() += weight;
            if step % 997 == 0 {
                assert_eq!(sample.iter().count(), expected.len());
            }
        }
        let expected: Vec<(f64, f64)> =
            expected.into_iter().map(|(bits, weight)| (f64::from_bits(bits), weight)).collect();
        assert_eq!(sample.iter().collect::<Vec<_>>(), expected);
        assert_eq!(expected.iter().rev().copied().collect::<Sample>(), sample);
    }
}
