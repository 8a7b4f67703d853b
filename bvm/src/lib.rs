//! The Bayesian Volumetric Map.

pub mod grid;
pub mod report;
pub mod vision;
pub mod world;
