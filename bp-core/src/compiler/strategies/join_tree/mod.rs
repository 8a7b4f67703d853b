//! All marginals at once: the join tree of a network.
//!
//! In: a model whose variables are finite. Out: the posterior of every variable, ln P(evidence), the most probable
//! assignment, joint posteriors, the value of observations. Invariant: exact up to rounding; powers of two are kept
//! separately, so that evidence may be arbitrarily improbable; where f64 may lose a cell, all cells are recomputed with
//! separate exponents.
//!
//! Lauritzen and Spiegelhalter 1988; Shenoy 1997 (binary join trees); Darwiche 2003 (derivatives). See
//! docs/networks.md.

mod absorb;
mod answer;
mod batch;
mod cell;
mod compile;
mod contraction;
mod cost;
mod evidence;
mod groups;
mod inform;
mod layout;
mod most_probable;
mod names;
mod network;
mod offer;
mod pair;
mod plan;
mod problem;
mod propagate;
mod reading;
mod refused;
mod session;
mod table;

pub(crate) use absorb::{Absorbed, absorb};
pub use batch::{Posterior, answer_cases};
pub use compile::Tree;
pub use cost::Cost;
pub use evidence::NetworkEvidence;
use inform::entropy;
pub use inform::{Joint, Observation, joint, observations};
pub use most_probable::most_probable;
pub use names::Named;
pub use network::{FactorTable, Network};
pub(crate) use offer::Engine;
pub use offer::JoinTree;
pub use plan::{Marginals, MarginalsSession};
pub use refused::Refused;
pub use session::Session;
#[cfg(test)]
pub(crate) use session::propagations;
