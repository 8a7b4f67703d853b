//! A question whose answer is its evidence.

use bp_macros::bayesian_program;

bayesian_program! {
    program WetGrass {
        variables { Rain, Wet : bool; }
        decomposition { P(Rain) P(Wet | Rain) }
        forms {
            P(Rain) = bernoulli(0.3);
            P(Wet | Rain) = dirac(Rain);
        }
        question rain { P(Rain | Rain Wet) }
    }
}

fn main() {}
