//! The Bayesian Volumetric Map.
pub mod grid;
pub mod world;
