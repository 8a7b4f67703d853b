//! A program that ends too early, and one that never starts.

use bp_macros::bayesian_program;

bayesian_program! { program WetGrass }
bayesian_program! { programme WetGrass {} }
bayesian_program! { program A {} program B {} }
bayesian_program! {}

fn main() {}
