//! The rules of the project, checked for its sources and its documentation.
//!
//! In: every source file and page. Out: pass or fail.

mod constants;
mod pages;
mod sources;
