//! Errors in a file are shown with its lines, under its path.

use bp_macros::bayesian_program;

bayesian_program!("wrong.bp");

fn main() {}
