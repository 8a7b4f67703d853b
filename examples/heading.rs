//! Inverse programming: the heading of a robot, given an attracting and a repelling object.
//!
//! Both at 270 degrees: the most probable heading is 217, neither towards the objects nor directly away from them.
//! Writes `target/gallery/heading.png`. Chapter 7 of Bessière et al. (2013).

#[path = "plots/mod.rs"]
mod plots;

use bp_core::compiler::answer::ask;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::{compile, parse_question};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/inverse_programming.bp");
    let model = compile(&Source::new("heading", std::fs::read_to_string(path)?)).expect("it compiles");
    let mut panels = Vec::new();
    for (title, text) in [
        ("attracted at 270", "P(H | B1 = 270)"),
        ("repelled at 270", "P(H | B0 = 270)"),
        ("both", "P(H | B0 = 270, B1 = 270)"),
    ] {
        let question = parse_question(&Source::new("question", text), &model).expect("it is a question");
        let answer = ask(&model, &question, &Inputs::new())?.remove(0);
        panels.push((title, answer.answer.iter().filter_map(|row| row.p()).collect::<Vec<f64>>()));
    }
    println!(
        "{}",
        plots::curves("heading", &panels, ("heading, degrees", 0.0, 359.0), "probability", None)?.display()
    );
    let both = &panels[2].1;
    let best = (0..360).max_by(|a, b| both[*a].total_cmp(&both[*b])).expect("there are headings");
    println!("head {best}");
    assert_eq!(best, 217);
    Ok(())
}
