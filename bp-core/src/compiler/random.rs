//! Seeded random generators. In: a random seed and the name of the consumer. Out: a generator.
//!
//! The generator is xoshiro256++ (Blackman and Vigna 2021), so that a seed gives the same numbers on every machine and
//! in every later version. Invariant: two names with one seed give unrelated streams, so that a sensor that draws more
//! numbers does not change the world and the other sensors.

use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

/// The generator of all random numbers.
pub type Random = Xoshiro256PlusPlus;

/// The generator for one purpose under one seed.
pub fn seeded(seed: u64, purpose: &str) -> Random {
    // FNV-1a: a fixed, documented hash of the name (the standard library's may change).
    let name = purpose.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    Random::seed_from_u64(seed ^ name)
}
