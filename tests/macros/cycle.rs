//! Variables that depend on one another.

use bp_macros::bayesian_program;

bayesian_program! {
    program WetGrass {
        variables { Rain, Wet : bool; }
        decomposition { P(Rain | Wet) P(Wet | Rain) }
        forms {
            P(Rain | Wet) = bernoulli(if Wet { 0.5 } else { 0.3 });
            P(Wet | Rain) = dirac(Rain);
        }
        question rain { P(Rain | Wet) }
    }
}

fn main() {}
