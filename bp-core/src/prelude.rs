//! The names that a program in Rust needs to work with Bayesian Programs: `use bp_core::prelude::*;`.

pub use crate::data::Records;
pub use crate::error::Error;
pub use crate::evidence;
pub use crate::program::{
    Batch, Cases, Evidence, Filter, Learned, Learning, Posterior, Program, Question, Rows, Value,
};
pub use crate::space::{Edge, Space};
