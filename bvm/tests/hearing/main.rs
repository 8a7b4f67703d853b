//! Hearing: filters, correlations, files and posteriors.
//!
//! In: impulses, tones, noise; files written by hand, and those of `shared` where they are. Out: closed forms, series at 40
//! digits, densities multiplied by hand. Invariant: no expected value is an answer of this project.

mod ears;
mod files;
mod places;
mod turning;
mod voices;

use bp_core::compiler::random::seeded;
use rand_distr::{Distribution, StandardNormal};

/// White noise of deviation 0.1.
pub(crate) fn noise(seed: u64, length: usize, name: &str) -> Vec<f64> {
    let mut random = seeded(seed, name);
    let value = |_| {
        let value: f64 = StandardNormal.sample(&mut random);
        0.1 * value
    };
    (0..length).map(value).collect()
}
