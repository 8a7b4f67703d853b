//! Learning a coin's bias toss by toss: from ½, the predicted probability of the next toss approaches the true value.
//!
//! Three runs of 500 tosses of a coin that gives 1 with probability ⅓. After n tosses the error is about √(⅓ · ⅔ / n).
//! Writes `target/gallery/learning_curve.png`. Chapter 15 of Bessière et al. (2013).

#[path = "plots/mod.rs"]
mod plots;

use bp_core::prelude::*;

const TRUTH: f64 = 1.0 / 3.0;
const TOSSES: usize = 500;

/// The coin that is tossed.
const COIN: &str = "program Coin {
    variables { O : 0..=1; }
    decomposition { P(O) }
    forms { P(O) = categorical(2/3, 1/3); }
}";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let learner = Program::open(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/coin_learning.bp"))?;
    let mut panels = Vec::new();
    for (seed, title) in [(1, "first run"), (2, "second run"), (3, "third run")] {
        let tosses = Program::parse(COIN)?.seed(seed).ask(&format!("draw({TOSSES}) P(O)"))?.listed()?;
        let tosses: Vec<f64> = tosses.iter().filter_map(|toss| toss["O"].as_f64()).collect();
        // The prediction after the first n tosses.
        let predicted = |n: usize| {
            let learned = learner.learn(Learning::new().column("O", &tosses[..n]))?;
            learned.program().ask("next")?.p(1)
        };
        panels.push((title, (0..=TOSSES).map(predicted).collect::<Result<Vec<f64>, Error>>()?));
    }
    let across = ("tosses", 0.0, TOSSES as f64);
    println!("{}", plots::curves("learning_curve", &panels, across, "P(O = 1)", Some(TRUTH))?.display());

    for (title, believed) in &panels {
        let last = believed[TOSSES];
        println!("{title}: {last:.4} after {TOSSES} tosses");
        assert_eq!(believed[0], 0.5);
        assert!((last - TRUTH).abs() < 4.0 * (TRUTH * (1.0 - TRUTH) / TOSSES as f64).sqrt());
    }
    Ok(())
}
