//! Bayesian Programs, declared as the formalism prints them, and answered by compiled kernels.
//!
//! Six values, six verbs: `Source` → parse → `ast::Program` → check → [`model::Model`] → plan → `Plan` → lower →
//! `Kernel` → run → `Answer`.

pub mod diagnostic;
pub mod ids;
pub mod model;
pub mod operators;
pub mod source;
pub mod syntax;
