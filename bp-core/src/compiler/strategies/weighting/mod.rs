//! Likelihood weighting: draws of the prior, each weighed by the evidence.
//!
//! In: a program and asks that are not answered exactly. Out: weighted draws, and estimates with their standard errors. Invariant:
//! what is observed is weighed, never waited for.

mod answer;
mod draw;
mod offer;

pub(crate) use answer::{FEW, part, rows};
pub use draw::weigh;
pub(crate) use draw::{Step, draw_one, draw_or_weigh, instances, solve};
pub(crate) use offer::{Engine, drawn, has_point, refused_factor};
pub use offer::{Sampled, Treatment};
