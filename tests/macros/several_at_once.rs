//! Every error of a program is reported, each at its place.

use bp_macros::bayesian_program;

bayesian_program! {
    /// Is it the rain or the sprinkler?
    program WetGrass {
        variables { Rain, Sprinkler, Wet : bool; }
        decomposition { P(Rain) P(Sprinkelr | Rain) P(Wet | Rain Sprinkler) }
        forms {
            P(Rain) = bernoulli(rate);
            P(Wet | Rain Sprinkler) = table { 0.9, 0.2; };
        }
        question rain { P(Rain | Wett) }
        question rain { P(Wet) }
    }
}

fn main() {}
