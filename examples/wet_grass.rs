//! One program, used in two ways: compiled into Rust by the macro, and read as text at run time. The answers agree.
//!
//! Rain makes the grass wet, and so does the sprinkler, which runs mostly on dry days: P(Rain | Wet) = 0.3 / (0.3 + 0.7
//! · 0.9) = 0.322581.

use bp_core::prelude::*;
use bp_macros::bayesian_program;

bayesian_program! {
    /// Is it the rain or the sprinkler?
    program WetGrass {
        variables { Rain, Sprinkler, Wet : bool; }
        decomposition { P(Rain) P(Sprinkler | Rain) P(Wet | Rain Sprinkler) }
        forms {
            P(Rain)             = bernoulli(0.3);
            P(Sprinkler | Rain) = bernoulli(if Rain { 0.1 } else { 0.9 });
            P(Wet | Rain Sprinkler) = dirac(Rain or Sprinkler);
        }
        question rain { P(Rain | Wet = true) }
    }
}

fn main() -> Result<(), bp_core::Error> {
    // At compile time the question has become a function.
    let compiled = wet_grass::rain().ask().expect("wet grass is possible").p(true);

    // At run time the same text is compiled, and any question can be asked.
    let rain = Program::parse(wet_grass::SOURCE)?.ask("P(Rain | Wet = true)")?;
    println!("{rain}");

    assert!((compiled - 0.3 / 0.93).abs() < 1e-12 && (rain.p(true)? - compiled).abs() < 1e-12);
    Ok(())
}
