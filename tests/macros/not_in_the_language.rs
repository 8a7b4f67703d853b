//! Constructs of Rust that the language lacks.

use bp_macros::bayesian_program;

bayesian_program! {
    #[allow(unused)]
    program Occupancy {
        variables { O : bool; }
        decomposition { P(O) }
        forms { P(O) = uniform; }
        question state { P(O) }
    }
}
bayesian_program! {
    program Range {
        variables { C : 1..6; }
        decomposition { P(C) }
        forms { P(C) = uniform; }
        question state { P(C) }
    }
}

fn main() {}
