//! A variable that the decomposition distributes twice.

use bp_macros::bayesian_program;

bayesian_program! {
    program WetGrass {
        variables { Rain, Wet : bool; }
        decomposition { P(Rain) P(Wet | Rain) P(Wet) }
        forms {
            P(Rain) = bernoulli(0.3);
            P(Wet | Rain) = dirac(Rain);
            P(Wet) = uniform;
        }
        question rain { P(Rain | Wet) }
    }
}

fn main() {}
