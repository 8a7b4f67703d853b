//! Evidence that is not a value of its variable.

use bp_macros::bayesian_program;

bayesian_program! {
    program WetGrass {
        variables { Rain, Wet : bool; }
        decomposition { P(Rain) P(Wet | Rain) }
        forms {
            P(Rain) = bernoulli(0.3);
            P(Wet | Rain) = dirac(Rain);
        }
        question rain { P(Rain | Wet = 3) }
    }
}

fn main() {}
