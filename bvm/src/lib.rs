//! The Bayesian Volumetric Map.
pub mod grid;
