//! Laws over integers and bins, as the programs of the gallery use them; written without the library.
//!
//! In: a range, a mean, a deviation. Out: probabilities. Invariant: they sum to one.

pub(crate) fn normalised(weights: Vec<f64>) -> Vec<f64> {
    let total: f64 = weights.iter().sum();
    weights.into_iter().map(|weight| weight / total).collect()
}

/// A normal law on the integers from `low` to `high`.
pub(crate) fn normal(low: i32, high: i32, mean: f64, deviation: f64) -> Vec<f64> {
    let weight = |x: i32| (-0.5 * ((f64::from(x) - mean) / deviation).powi(2)).exp();
    normalised((low..=high).map(weight).collect())
}

/// The masses of a normal law in equal bins, normalised.
pub(crate) fn in_bins([low, high]: [f64; 2], count: usize, mean: f64, deviation: f64) -> Vec<f64> {
    let below = |x: f64| 0.5 * libm::erfc((mean - x) / (deviation * std::f64::consts::SQRT_2));
    let edge = |bin: usize| low + (high - low) * bin as f64 / count as f64;
    normalised((0..count).map(|bin| below(edge(bin + 1)) - below(edge(bin))).collect())
}

/// In nats.
pub(crate) fn entropy(probabilities: &[f64]) -> f64 {
    -probabilities.iter().filter(|p| **p > 0.0).map(|p| p * p.ln()).sum::<f64>()
}

/// The position of the largest.
pub(crate) fn largest(numbers: &[f64]) -> usize {
    (0..numbers.len()).fold(0, |best, other| if numbers[other] > numbers[best] { other } else { best })
}
