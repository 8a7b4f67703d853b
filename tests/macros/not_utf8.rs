//! A file that is not text.

use bp_macros::bayesian_program;

bayesian_program!("not_utf8.bp");

fn main() {}
