//! An error that another place explains: its source is quoted.

use bp_macros::bayesian_program;

bayesian_program! {
    program WetGrass {
        parameters { rate : probability = 0.3; }
        variables { Rain, Wet : bool; rate : 1..=3; }
        decomposition { P(Rain) P(Wet | Rain) }
        forms {
            P(Rain) = bernoulli(rate);
            P(Wet | Rain) = dirac(Rain);
            P(Wet | Rain) = uniform;
        }
        question rain { P(Rain | Wet) }
        question rain { P(Wet) }
    }
}

fn main() {}
