//! Inverse programming: the heading of a robot, given an attracting and a repelling object.
//!
//! Both at 270 degrees: the most probable heading is 217, neither towards the objects nor directly away from them.
//! Writes `target/gallery/heading.png`. Chapter 7 of Bessière et al. (2013).

#[path = "plots/mod.rs"]
mod plots;

use bp_core::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let objects = Program::open(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/inverse_programming.bp"))?;
    let mut panels = Vec::new();
    for (title, question) in [
        ("attracted at 270", "P(H | B1 = 270)"),
        ("repelled at 270", "P(H | B0 = 270)"),
        ("both", "P(H | B0 = 270, B1 = 270)"),
    ] {
        let headings = objects.ask(question)?.values()?;
        panels.push((title, headings.into_iter().map(|(_, p)| p).collect::<Vec<f64>>()));
    }
    println!(
        "{}",
        plots::curves("heading", &panels, ("heading, degrees", 0.0, 359.0), "probability", None)?.display()
    );
    let best = objects.ask("argmax P(H | B0 = 270, B1 = 270)")?.mode()?["H"].clone();
    println!("head {best}");
    assert_eq!(best, 217);
    Ok(())
}
