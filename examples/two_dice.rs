//! A program without text: the builder makes the model of a sum of two dice, and a question is asked of it.
//!
//! If the sum is 9, the first die shows 3, 4, 5 or 6, each with probability ¼.

use bp_core::answer::ask;
use bp_core::exec::Inputs;
use bp_core::model::{
    Ask, Domain, Evidence, Form, Known, ModelBuilder, Question, Reduction, Searched, Value,
};
use bp_core::operators::Binary;

fn main() {
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

    // 9 is the eighth value of 2..=12.
    let nine = Known { variable: sum, evidence: Evidence::Hard(Value::Ordinal(7)) };
    let searched = vec![Searched { variable: first, at: None }];
    let asked = Ask { reduction: Reduction::Probability, searched, known: vec![nine] };
    let question = Question { name: "first".into(), asks: vec![asked] };
    let answer = ask(&model, &question, &Inputs::new()).expect("a sum of 9 is possible").remove(0);

    println!("{}", answer.question);
    for row in &answer.answer {
        println!("  {} {}  {:.4}", row.values[0].0, row.values[0].1, row.p().unwrap_or(0.0));
    }
    let found: Vec<f64> = answer.answer.iter().filter_map(|row| row.p()).collect();
    let expected = [0.0, 0.0, 0.25, 0.25, 0.25, 0.25];
    assert!(found.iter().zip(expected).all(|(p, q)| (p - q).abs() < 1e-12), "{found:?}");
}
