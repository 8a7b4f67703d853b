//! The Bayesian Volumetric Map: sight, hearing and balance fused into an egocentric map, and a gaze that explores.
//!
//! Ferreira, Pinho and Dias, *Active exploration using Bayesian models for multimodal perception*, ICIAR 2008.
//! Every probability of the map is written in `models/*.bp`; this crate moves data between them.

pub mod audition;
pub mod error;
pub mod exploration;
pub mod grid;
pub mod map;
pub mod programs;
pub mod recording;
pub mod report;
pub mod vestibular;
pub mod vision;
pub mod world;
