//! The map, its senses and the gaze.
//!
//! In: the embedded world and cells written here. Out: beliefs beside the truth of the world, enumeration, or
//! loops written by hand.

mod agreement;
mod exploration;
mod frames;
mod kernels;
mod population;
mod senses;
