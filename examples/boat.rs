//! Where is the boat? Three landmarks are observed by bearing and distance; each answer is a heat map of 101 · 101
//! positions.
//!
//! Bearings alone give a broad posterior, all six readings a narrow one, two distances two modes. A wrong distance
//! shifts the posterior. Writes `target/gallery/boat.png`. Chapter 7 of Bessière et al. (2013).

#[path = "plots/mod.rs"]
mod plots;

use bp_core::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let boat = Program::open(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/boat.bp"))?;
    let (mut panels, mut entropies) = (Vec::new(), Vec::new());
    for (name, title) in [
        ("bearings", "three bearings"),
        ("all", "bearings and distances"),
        ("two_distances", "two distances"),
        ("wrong_distance", "one distance is wrong"),
        ("outlier", "one bearing is wrong"),
    ] {
        let place = boat.ask(name)?;
        println!("{title:24} {:.4} nats", place.entropy()?);
        entropies.push(place.entropy()?);
        panels.push((title, place.values()?.into_iter().map(|(_, p)| p).collect::<Vec<f64>>()));
    }
    println!("{}", plots::heat_maps("boat", &panels, ("X", -50, 50), ("Y", -50, 50))?.display());

    let (bearings, all, two_distances) = (entropies[0], entropies[1], entropies[2]);
    assert!(all < bearings && bearings < two_distances);
    let place =
        boat.ask("argmax P(X Y | B1 = 225, B2 = 180, B3 = 270, D1 = 71, D2 = 50, D3 = 50)")?.mode()?;
    assert_eq!((place["X"].as_f64(), place["Y"].as_f64()), (Some(0.0), Some(0.0)));
    Ok(())
}
