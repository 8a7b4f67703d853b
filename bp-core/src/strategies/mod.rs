//! Strategies: one folder for each way to answer, with what it offers, its engine, and its answers.
//!
//! In: a model, and asks that know the same. Out: what a strategy offers for them, and what it answers. Invariant: strategies are
//! chosen by the planner, never by each other; one asks another for a potential at most.

pub mod chain;
pub mod gaussian;
pub mod gibbs;
pub mod join_tree;
pub mod over_time;
pub mod particles;
pub(crate) mod sums;
pub mod weighting;
