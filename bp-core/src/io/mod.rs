//! Files of other tools: network formats, tables of data.
//!
//! In: a [`Source`](crate::source::Source), or bytes. Out: a [`Model`](crate::model::Model) and what was mended on the way,
//! or a table, or what is wrong, under the text or with its row. Invariant: whatever the bytes, an answer comes back;
//! numbers are read as f64, exactly.

pub mod bif;
mod csv;
mod lexer;
mod network;
mod warning;

pub use csv::{Table, read_table};
pub use warning::Warning;
