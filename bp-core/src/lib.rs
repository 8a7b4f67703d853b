//! Bayesian Programs, declared as the formalism prints them, and answered by compiled kernels.
//!
//! Six values, six verbs: `Source` → parse → `ast::Program` → check → [`model::Model`] → plan → `Plan` → lower →
//! `Kernel` → run → `Answer`.

pub mod diagnostic;
pub mod error;
pub mod exec;
pub mod ids;
pub mod kernel;
pub mod lower;
pub mod model;
pub mod operators;
pub mod plan;
pub mod source;
pub mod space;
pub mod syntax;
