//! Where is the boat? Three landmarks are observed by bearing and distance; each answer is a heat map of 101 · 101
//! positions.
//!
//! Bearings alone give a broad posterior, all six readings a narrow one, two distances two modes. A wrong distance
//! shifts the posterior. Writes `target/gallery/boat.png`. Chapter 7 of Bessière et al. (2013).

#[path = "plots/mod.rs"]
mod plots;

use bp_core::compiler::answer::ask;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::compile;

fn entropy(p: &[f64]) -> f64 {
    -p.iter().filter(|p| **p > 0.0).map(|p| p * p.ln()).sum::<f64>()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/boat.bp");
    let model = compile(&Source::new("boat", std::fs::read_to_string(path)?)).expect("it compiles");
    let mut panels = Vec::new();
    for (name, title) in [
        ("bearings", "three bearings"),
        ("all", "bearings and distances"),
        ("two_distances", "two distances"),
        ("wrong_distance", "one distance is wrong"),
        ("outlier", "one bearing is wrong"),
    ] {
        let question = model.question(name).expect("it is declared");
        let answer = ask(&model, question, &Inputs::new())?.remove(0);
        let places: Vec<f64> = answer.answer.iter().filter_map(|row| row.p()).collect();
        println!("{title:24} {:.4} nats", entropy(&places));
        panels.push((title, places));
    }
    println!("{}", plots::heat_maps("boat", &panels, ("X", -50, 50), ("Y", -50, 50))?.display());

    let [bearings, all, two, ..] = panels.as_slice() else { unreachable!("five panels") };
    assert!(entropy(&all.1) < entropy(&bearings.1) && entropy(&bearings.1) < entropy(&two.1));
    let here = 50 * 101 + 50;
    assert!(all.1.iter().all(|p| *p <= all.1[here]), "the boat is at (0, 0)");
    Ok(())
}
