//! A path without a file, and a path followed by other tokens.

use bp_macros::bayesian_program;

bayesian_program!("models/no_such_program.bp");
bayesian_program!("models/cell.bp", 3 + 4);
bayesian_program!(r"models/no_such_program.bp",);

fn main() {}
