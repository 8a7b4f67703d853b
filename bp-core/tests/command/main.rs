//! The command `bp`, run as a process.
//!
//! In: arguments, files and pipes. Out: its output, its exit status, and the files that it leaves.

mod apart;
mod cases;
mod columns;
#[cfg(feature = "serve")]
mod connections;
mod data;
mod elements;
mod emit;
mod explained;
mod general;
#[cfg(feature = "serve")]
mod instants;
mod javascript;
mod learn;
mod lsp;
mod mistakes;
mod networks;
#[path = "../support/node.rs"]
mod node;
mod notes;
mod page_answers;
mod plots;
mod rows;
#[cfg(feature = "serve")]
mod serve;
mod several;
mod start;
mod streams;
#[cfg(feature = "serve")]
mod typed;
