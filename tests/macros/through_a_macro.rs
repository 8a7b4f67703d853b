//! The place of an error survives a macro that writes the program.

use bp_macros::bayesian_program;

macro_rules! coin {
    ($name:ident, $rate:expr) => {
        bayesian_program! {
            program $name {
                variables { Heads : bool; }
                decomposition { P(Heads) }
                forms { P(Heads) = bernoulli($rate); }
                question heads { P(Heads) }
            }
        }
    };
}

coin!(Fair, 0.25 + 0.25);
coin!(Bent, 1.5);

fn main() {}
