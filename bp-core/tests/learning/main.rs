//! Learning from data: counts, hidden variables, sequences, plates.
//!
//! In: programs and tables of cases. Out: learned parameters, compared with maxima computed by hand or by another tool.

mod hidden;
mod learned;
mod no_value;
mod observed;
mod over_time;
mod rows;
#[path = "../support/mod.rs"]
mod support;
