//! Evidence of the right type outside its domain, and below zero.

use bp_macros::bayesian_program;

bayesian_program! {
    program Die {
        variables { Face : 1..=6; Even : bool; }
        decomposition { P(Face) P(Even | Face) }
        forms {
            P(Face) = uniform;
            P(Even | Face) = dirac(Face == 2 or Face == 4 or Face == 6);
        }
        question seven { P(Even | Face = 7) }
        question below { P(Even | Face = -1) }
    }
}

fn main() {}
