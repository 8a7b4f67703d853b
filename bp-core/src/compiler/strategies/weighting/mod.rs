//! Likelihood weighting: draws from the prior, each weighted by the likelihood of the evidence.
//!
//! In: a program, and asks without an exact answer. Out: weighted draws, and estimates with their standard errors.
//! Invariant: observations weigh draws; none is rejected for missing an observed value.

mod answer;
mod draw;
mod offer;
mod preferred;
mod refusal;

pub(crate) use answer::{FEW, part, rows};
pub(crate) use draw::{Step, contexts, draw_or_weigh, instances, solve, weigh};
pub(crate) use offer::{Engine, drawn};
pub use offer::{Sampled, Treatment};
pub(crate) use refusal::refused_factor;
