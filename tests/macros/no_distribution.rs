//! A variable that the decomposition lacks.

use bp_macros::bayesian_program;

bayesian_program! {
    program WetGrass {
        variables { Rain, Sprinkler, Wet : bool; }
        decomposition { P(Rain) P(Wet | Rain) }
        forms {
            P(Rain) = bernoulli(0.3);
            P(Wet | Rain) = dirac(Rain);
        }
        question rain { P(Rain | Wet) }
    }
}

fn main() {}
