//! The project holds to its own rules, and the documentation to the code.
//!
//! In: every source file and page. Out: nothing where all is well.

mod pages;
mod sources;
