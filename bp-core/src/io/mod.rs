//! Files of other tools: network formats.
//!
//! In: a [`Source`](crate::source::Source). Out: a [`Model`](crate::model::Model) and what was mended on the way, or what
//! is wrong, under the text. Invariant: whatever the bytes, an answer comes back; numbers are read as f64, exactly.

pub mod bif;
mod lexer;
mod network;
mod warning;

pub use warning::Warning;
