//! The linear-Gaussian strategy: closed form where all variables are real, linear and normal.
//!
//! In: a linear-Gaussian program and its observations. Out: a normal [`Belief`]. Invariant: linearity is a property of
//! the program, checked by the offer; the numbers come when it runs.

mod answer;
mod derivation;
mod equations;
mod extended;
mod filter;
mod frontier;
mod law;
mod offer;
mod predicate;
mod slots;
mod smooth;

pub(crate) use answer::{Named, conditioned, divergences, part, rows, whether};
pub(crate) use equations::Slots;
pub(crate) use extended::{Extended, is_normal, not_linearised};
pub use filter::{Belief, Filter};
pub(crate) use frontier::Conditioned;
pub(crate) use law::NormalLaw;
pub(crate) use offer::{Engine, ExtendedEngine};
pub use offer::{Gaussian, LinearEquation, Noise};
pub(crate) use offer::{applies, is_linear, offer};
pub(crate) use predicate::{by_counts, by_intervals, of_normal, probabilities};
pub(crate) use slots::SlotLaw;
