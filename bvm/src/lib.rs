//! The Bayesian Volumetric Map.

pub mod vision;
