//! One program, two doors: compiled into Rust by the macro, and read as text at run time. They agree.
//!
//! Rain makes the grass wet, and so does the sprinkler, which mostly runs on dry days:
//! P(Rain | Wet) = 0.3 / (0.3 + 0.7 · 0.9) = 0.322581.

use bp_core::answer::ask;
use bp_core::exec::Inputs;
use bp_core::source::Source;
use bp_core::syntax::{compile, parse_question};
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

fn main() {
    // At compile time the question has become a function.
    let mut compiled = wet_grass::rain::Outputs::<f64>::default();
    let nothing = wet_grass::rain::Inputs {};
    wet_grass::rain::run(&nothing, &mut compiled).expect("it needs no input");
    let compiled = compiled.p_rain[1];

    // At run time the same text is compiled, and any question can be asked.
    let model = compile(&Source::new("wet_grass", wet_grass::SOURCE)).expect("it compiled above");
    let typed = Source::new("question", "P(Rain | Wet = true)");
    let question = parse_question(&typed, &model).expect("it is a question to this program");
    let answers = ask(&model, &question, &Inputs::new()).expect("wet grass is possible");
    let asked = answers[0].answer[1].p().expect("a probability");

    println!("compiled {compiled:.6}, asked {asked:.6}");
    assert!((compiled - 0.3 / 0.93).abs() < 1e-12 && (asked - compiled).abs() < 1e-12);
}
