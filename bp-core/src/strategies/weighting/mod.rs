//! Likelihood weighting: draws of the prior, each weighed by the evidence.
//!
//! In: a program and asks that are not answered exactly. Out: weighted draws, and estimates with their standard errors. Invariant:
//! what is observed is weighed, never waited for.

mod answer;
mod draw;
mod offer;

pub(crate) use answer::{FEW, answers, part, rows};
pub use draw::weigh;
pub(crate) use draw::{Step, draw_one, draw_or_weigh, instances, solve};
pub use offer::{Sampled, Treatment};
pub(crate) use offer::{has_point, offer, refused_factor};
