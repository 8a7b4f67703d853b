//! The language from outside: its messages, its gallery, and hostile input.
//!
//! In: the wrong programs of `tests/errors`, the programs of `examples`, and mutations of both. Out: diagnostics
//! and answers.

mod errors;
mod fuzz;
mod gallery;
