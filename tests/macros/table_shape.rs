//! A table with a row too few and a row too long.

use bp_macros::bayesian_program;

bayesian_program! {
    program WetGrass {
        variables { Rain, Wet : bool; Sky : { Blue, Grey }; }
        decomposition { P(Rain) P(Sky | Rain) P(Wet | Rain) }
        forms {
            P(Rain) = bernoulli(0.3);
            P(Sky | Rain) = table { false: 0.9, 0.1; };
            P(Wet | Rain) = table { false: 0.9, 0.1; true: 0.8, 0.1, 0.1; };
        }
        question rain { P(Rain | Wet) }
    }
}

fn main() {}
