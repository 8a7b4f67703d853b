//! The Bayesian Volumetric Map.
