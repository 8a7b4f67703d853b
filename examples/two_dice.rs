//! The sum of two dice: a Dirac form makes a variable a function of others.
//!
//! If the sum is 9, the first die shows 3, 4, 5 or 6, each with probability ¼.

use bp_core::prelude::*;

fn main() -> Result<(), Error> {
    let dice = Program::parse(
        "program TwoDice {
            variables { First, Second : 1..=6; Sum : 2..=12; }
            decomposition { P(First) P(Second) P(Sum | First Second) }
            forms {
                P(First) = uniform; P(Second) = uniform;
                P(Sum | First Second) = dirac(First + Second);
            }
        }",
    )?;
    let first = dice.ask("P(First | Sum = 9)")?;
    println!("{first}");
    for (face, expected) in [(1, 0.0), (2, 0.0), (3, 0.25), (4, 0.25), (5, 0.25), (6, 0.25)] {
        assert!((first.p(face)? - expected).abs() < 1e-12);
    }
    Ok(())
}
