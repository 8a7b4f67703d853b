//! The front end: text to tree, tree to text, tree to [`Model`](crate::model::Model).
//!
//! In: a [`Source`](crate::source::Source). Out: a model, or all errors of the program. Invariant: the later stages do
//! not import this folder.

pub mod ast;
mod check;
mod graft;
mod parse;
mod print;

pub use check::{check, compile, parse_question};
pub use graft::{graft, learned_part};
pub use parse::parse;
