//! A question that no exact route answers: the program compiles, and the caller gets the reason.

use bp_macros::bayesian_program;

bayesian_program! {
    program Turn over t in Time {
        parameters { sigma, tau : real; }
        variables { Omega, C, V : real; }
        decomposition { P(Omega) P(C | C^-1 Omega) P(V | Omega C) }
        forms {
            P(Omega) = normal(0, sigma);
            P(C | C^-1 Omega) = dirac(C^-1 * Omega / tau);
            P(V | Omega C) = normal(Omega - C, sigma);
        }
        question estimate { P(Omega | V) }
    }
}

fn main() {
    assert_eq!(turn::model().name, "Turn");
    turn::estimate().ask();
}
