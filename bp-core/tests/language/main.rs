//! The language: parsing, checking, asking and printing.
//!
//! In: programs and questions as text. Out: models, diagnostics, pages and answers. Invariant: an expected answer is
//! computed by hand or enumerated.

#[path = "../support/arithmetic.rs"]
mod arithmetic;
mod ask;
mod batches;
mod check;
mod corners;
mod course;
mod derived;
mod door;
mod doors;
mod forms;
mod functions;
mod gallery_page;
#[path = "../support/help.rs"]
mod help;
#[path = "../support/kinds.rs"]
mod kinds;
mod lists;
mod matches;
mod messages;
mod options;
mod overflow;
mod pages;
mod posteriors;
mod print;
mod quantiles;
mod questions;
mod reference;
mod rewrites;
#[path = "../support/shown.rs"]
mod shown;
mod subroutines;
#[path = "../support/mod.rs"]
mod support;
mod syntax;
mod trees;
