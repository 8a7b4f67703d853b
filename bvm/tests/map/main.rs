//! The map, its senses and the gaze.
//!
//! In: the simulated world and cells written here. Out: posteriors, compared with the true world, enumeration, or
//! hand-written loops.

mod agreement;
mod exploration;
mod frames;
mod kernels;
mod population;
mod senses;
mod turning;
