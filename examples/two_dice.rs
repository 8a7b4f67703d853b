//! A program without text: the builder makes the model of a sum of two dice, and a question is asked of it.
//!
//! If the sum is 9, the first die shows 3, 4, 5 or 6, each with probability ¼.

use bp_core::compiler::model::{Domain, Form, ModelBuilder};
use bp_core::compiler::operators::Binary;
use bp_core::prelude::*;

fn main() -> Result<(), bp_core::Error> {
    let mut model = ModelBuilder::new("TwoDice");
    let first = model.variable("First", Domain::integers(1, 6));
    let second = model.variable("Second", Domain::integers(1, 6));
    let sum = model.variable("Sum", Domain::integers(2, 12));
    model.factor([first], [], Form::Uniform);
    model.factor([second], [], Form::Uniform);
    let (x, y) = (model.value(first), model.value(second));
    let both = model.binary(Binary::Add, x, y);
    model.factor([sum], [first, second], Form::Dirac(both));
    let model = model.build().expect("each variable has one distribution");

    let first = Program::from(model).ask("P(First | Sum = 9)")?;
    println!("{first}");
    for (face, expected) in [(1, 0.0), (2, 0.0), (3, 0.25), (4, 0.25), (5, 0.25), (6, 0.25)] {
        assert!((first.p(face)? - expected).abs() < 1e-12);
    }
    Ok(())
}
