//! Weighted draws, and the settings of sampling.
//!
//! In: the number of draws and a seed; evidence. Out: [`Draws`], and estimates with their standard errors. Invariant:
//! each particle or chain has its own stream of random numbers, and sums are computed in the order of the particles:
//! the same seed gives the same answer on any number of threads.

mod chains;
mod draws;
mod evidence;
mod normals;

pub use chains::MOST_R_HAT;
pub(crate) use draws::error_of_quantile;
pub use draws::{Draws, Moments};
pub use evidence::Observations;
pub use normals::Normals;

use crate::random::{Random, seeded};
use rand::{RngExt, SeedableRng};

/// The settings of an estimate.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Sampling {
    /// The number of draws.
    pub particles: usize,
    /// Random seed.
    pub seed: u64,
}

impl Default for Sampling {
    fn default() -> Self {
        Self { particles: 100_000, seed: 1 }
    }
}

/// The streams of random numbers for one purpose under one seed.
#[derive(Clone, Copy, Debug)]
pub struct Streams(u64);

impl Streams {
    /// The streams of a purpose.
    pub fn new(seed: u64, purpose: &str) -> Self {
        Self(seeded(seed, purpose).random())
    }

    /// The stream of one particle. Multiplying by an odd constant gives each number a different seed.
    pub fn stream(self, number: usize) -> Random {
        Random::seed_from_u64(self.0.wrapping_add((number as u64).wrapping_mul(0xd134_2543_de82_ef95)))
    }
}
