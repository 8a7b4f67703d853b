//! The language: parsing, checking, asking and printing.
//!
//! In: programs and questions as text. Out: models, diagnostics, pages and answers. Invariant: an expected answer is
//! computed by hand or enumerated.

mod ask;
mod check;
mod corners;
mod derived;
mod door;
mod doors;
mod forms;
mod functions;
mod gallery_page;
mod lists;
mod messages;
mod overflow;
mod pages;
mod posteriors;
mod print;
mod quantiles;
mod questions;
mod reference;
mod rewrites;
mod subroutines;
#[path = "../support/mod.rs"]
mod support;
mod syntax;
mod trees;
