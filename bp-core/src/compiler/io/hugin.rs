//! Hugin NET, the format of Hugin and of SamIam.
//!
//! In: a text, or a model. Out: a model, or a text. Invariant: written text reads back the same. Names of variables
//! are identifiers there; any other name is written as the attribute `bp_name`, which other tools ignore.
//!
//! `net {} node X { states = ("a" "b"); } potential (X | Y) { data = ((0.1 0.9)(0.5 0.5)); }`: X changes fastest, the
//! first parent slowest (Hugin Expert, *Hugin API Reference Manual*, chapter 13, The NET language).

mod expressions;
mod read;
mod write;

pub use read::read;
pub(super) use write::write;
