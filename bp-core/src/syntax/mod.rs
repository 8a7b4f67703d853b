//! The front end: text to tree, tree to text, tree to [`Model`](crate::model::Model).
//!
//! In: a [`Source`](crate::source::Source). Out: a model, or every mistake of the program at once. Invariant: nothing to
//! the right of the model knows this folder.

pub mod ast;
mod check;
mod graft;
mod parse;
mod print;

pub use check::{check, compile, parse_question};
pub use graft::graft;
pub use parse::parse;
