//! Files: network formats of other tools, and tables of cases.
//!
//! In: a [`Source`](crate::source::Source), or a path. Out: a [`Model`](crate::model::Model) and what was mended on the
//! way, or rows of cells; or what is wrong, under the text or with file, row and column. Invariant: whatever the bytes, an
//! answer comes back; numbers are read as f64, exactly.

pub mod bif;
mod csv;
mod lexer;
mod network;
mod warning;

pub use csv::{MISSING, Table, read_table};
pub use warning::Warning;
