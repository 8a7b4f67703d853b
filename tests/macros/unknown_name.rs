//! A name without a declaration.

use bp_macros::bayesian_program;

bayesian_program! {
    program WetGrass {
        variables { Rain, Wet : bool; }
        decomposition { P(Rain) P(Wet | Rain) }
        forms {
            P(Rain) = bernoulli(rate);
            P(Wet | Rain) = dirac(Rian);
        }
        question rain { P(Rain | Wet) }
    }
}

fn main() {}
