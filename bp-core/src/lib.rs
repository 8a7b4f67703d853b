//! Bayesian Programs, declared as the formalism prints them, and answered by compiled kernels.
//!
//! Six values, six verbs: [`source::Source`] → parse → [`syntax::ast::Program`] → check → [`model::Model`] → plan →
//! [`plan::Plan`] → lower → [`kernel::Kernel`] → run → [`answer::Answer`].

pub mod answer;
pub mod bins;
pub mod data;
pub mod diagnostic;
pub mod distribution;
pub mod draw;
pub mod emit;
pub mod error;
pub mod exec;
pub mod files;
#[cfg(feature = "gpu")]
pub mod gpu;
mod guess;
pub mod ids;
pub mod io;
pub mod kernel;
pub mod latex;
pub mod law;
pub mod learn;
pub mod lower;
mod memory;
pub mod model;
pub mod operators;
pub mod plan;
mod potential;
pub mod progress;
pub mod random;
pub mod sample;
pub mod source;
pub mod space;
pub mod special;
pub mod spelling;
pub mod syntax;
pub mod time;
pub mod tree;
pub mod xml;
