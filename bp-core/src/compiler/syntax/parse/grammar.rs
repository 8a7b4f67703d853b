//! The parser that pest derives from `grammar.pest`.
//!
//! In: text. Out: pairs named by [`Rule`]. Invariant: the names of rules never leave this folder.

#![allow(missing_docs)] // The derive generates the rules' names, and the grammar documents them.

/// The derived parser.
#[derive(pest_derive::Parser)]
#[grammar = "compiler/syntax/grammar.pest"]
pub(super) struct Grammar;
