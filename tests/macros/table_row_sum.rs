//! A row of a table that does not sum to one: the span covers several tokens.

use bp_macros::bayesian_program;

bayesian_program! {
    program WetGrass {
        variables { Rain, Wet : bool; }
        decomposition { P(Rain) P(Wet | Rain) }
        forms {
            P(Rain) = bernoulli(0.3);
            P(Wet | Rain) = table { false: 0.9, 0.1; true: 0.8, 0.1 + 0.05; };
        }
        question rain { P(Rain | Wet) }
    }
}

fn main() {}
