//! Learning a coin's bias toss by toss: from ½, the predicted probability of the next toss approaches the true value.
//!
//! Three runs of 500 tosses of a coin that gives 1 with probability ⅓. After n tosses the error is about √(⅓ · ⅔ / n).
//! Writes `target/gallery/learning_curve.png`. Chapter 15 of Bessière et al. (2013).

#[path = "plots/mod.rs"]
mod plots;

use bp_core::compiler::answer::ask;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::law::Law;
use bp_core::compiler::learn::{Case, Learner};
use bp_core::compiler::random::seeded;
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::compile;

const TRUTH: f64 = 1.0 / 3.0;
const TOSSES: usize = 500;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/coin_learning.bp");
    let model = compile(&Source::new("coin", std::fs::read_to_string(path)?)).expect("it compiles");
    let (coin, next) = (model.variable("O").expect("a coin"), model.question("next").expect("a question"));
    let mut panels = Vec::new();
    for (seed, title) in [(1, "first run"), (2, "second run"), (3, "third run")] {
        let (mut generator, mut learner) = (seeded(seed, "coin"), Learner::new(&model)?);
        let mut believed = Vec::new();
        for _ in 0..=TOSSES {
            // The prediction so far, and then one more toss.
            let answer = ask(learner.learned()?.model(), next, &Inputs::new())?.remove(0);
            believed.extend(answer.answer[1].p());
            let toss = Law::Binomial.draw(&mut generator, &[1.0, TRUTH]);
            learner.observe(&Case::new(&model).with(coin, toss))?;
        }
        panels.push((title, believed));
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
