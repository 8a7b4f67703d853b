//! Laws and numbers: densities, distributions, special functions, and the range of f64.
//!
//! In: forms with their parameters. Out: probabilities, densities and draws, compared with constants of 50 digits,
//! quadrature, or calculation by hand. Invariant: no expected value comes from this crate.

mod bins;
mod coupled;
mod densities;
mod dirichlet;
mod distributions;
mod extremes;
mod invalid_numbers;
mod links;
mod probability;
mod range;
mod range_sensor;
mod special_functions;
#[path = "../support/mod.rs"]
mod support;
