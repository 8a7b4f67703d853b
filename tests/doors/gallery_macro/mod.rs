//! The gallery by every back end: emitted Rust, lanes and interpreter give the same numbers, and emitted Rust answers
//! again without allocating.
//!
//! In: programs of `examples/`, by the macro. Out: pass or fail. Invariant: 1e-12 between any two.

use bp_core::compiler::answer::link;
use bp_core::compiler::exec::{Inputs, Lanes, Outputs, interpret};
use bp_core::compiler::lower::lower;
use bp_core::compiler::model::Model;
use bp_core::compiler::plan::{Options, Route, plan};

mod enumeration;

/// The programs, each a module of its own.
mod programs {
    use bp_macros::bayesian_program;

    bayesian_program!("examples/asia.bp");
    bayesian_program!("examples/categorisation.bp");
    bayesian_program!("examples/homing.bp");
    bayesian_program!("examples/inverse_programming.bp");
    bayesian_program!("examples/layered_network.bp");
    bayesian_program!("examples/log_coding.bp");
    bayesian_program!("examples/phototaxy.bp");
    bayesian_program!("examples/pseudo_kalman.bp");
    bayesian_program!("examples/rain_umbrella.bp");
    bayesian_program!("examples/spam.bp");
    bayesian_program!("examples/sprinkler.bp");
    bayesian_program!("examples/sum_of_dice.bp");
    bayesian_program!("examples/water_unit.bp");

    // More cells than are computed one by one: rows of lanes, next to a table and in two orders.
    bayesian_program! {
        program Bearing {
            variables { S : bool; X : 0..=40; Y : 1..=32; B : 0..=23; }
            decomposition { P(S) P(X) P(Y | S) P(B | X Y) }
            forms {
                P(S) = bernoulli(0.3);
                P(X) = uniform;
                P(Y | S) = table {
                    false: 0.02, 0.0425, 0.02, 0.0425, 0.02, 0.0425, 0.02, 0.0425, 0.02, 0.0425, 0.02, 0.0425, 0.02, 0.0425, 0.02, 0.0425, 0.02, 0.0425, 0.02, 0.0425, 0.02, 0.0425, 0.02, 0.0425, 0.02, 0.0425, 0.02, 0.0425, 0.02, 0.0425, 0.02, 0.0425;
                    true: 0.0425, 0.02, 0.0425, 0.02, 0.0425, 0.02, 0.0425, 0.02, 0.0425, 0.02, 0.0425, 0.02, 0.0425, 0.02, 0.0425, 0.02, 0.0425, 0.02, 0.0425, 0.02, 0.0425, 0.02, 0.0425, 0.02, 0.0425, 0.02, 0.0425, 0.02, 0.0425, 0.02, 0.0425, 0.02;
                };
                P(B | X Y) = normal(mod(atan2(Y, X - 20) * 4, 24), 2);
            }
            question place { P(X Y | B = 7) }
            question turned { P(Y X | B = 7) }
            question sorted { P(S X Y | B = 7) }
            question split { P(X S Y | B = 7) }
        }
    }

    // Integers that f32 cannot represent.
    bayesian_program! {
        program Residue {
            variables { X : 0..=4999; Y : 0..=39; }
            decomposition { P(X) P(Y | X) }
            forms { P(X) = uniform; P(Y | X) = weights(1 + mod(X * X + Y, 7)); }
            question both { P(X Y) }
        }
    }

    // Rows of many tiles, and one row that is divided among threads.
    bayesian_program! {
        program Wide {
            variables { X : 0..=3; Y : 0..=39999; }
            decomposition { P(X) P(Y | X) }
            forms { P(X) = weights(1 + X); P(Y | X) = normal(10000 * X + 3, 9000); }
            question both { P(X Y) }
            question alone { P(Y) }
        }
    }
}
use programs::*;

/// Compares the named output of emitted Rust with the outputs of lanes and interpreter.
fn agree(model: &Model, question: &str, inputs: &Inputs<'_, f64>, emitted: &[f64]) {
    let model = link(model).unwrap();
    let question = model.question(question).unwrap();
    let mut matched = false;
    for route in &plan(&model, question, Options::default()).unwrap().routes {
        let Route::Exact(exact) = route else { panic!("{} has a closed form", question.name) };
        let kernel = lower(&model, exact, &question.name).unwrap().kernel;
        let truth: Outputs<f64> = interpret(&kernel, inputs).unwrap();
        let lanes = Lanes::new(kernel).run(inputs).unwrap();
        for ((name, truth), (_, lanes)) in truth.arrays.iter().zip(&lanes.arrays) {
            assert_eq!(truth.len(), lanes.len());
            let close = |(p, q): (&f64, &f64)| (p - q).abs() <= 1e-12 * p.abs().max(1e-3);
            assert!(truth.iter().zip(lanes).all(close), "{name:?} of {}: lanes", model.name);
            matched |= truth.len() == emitted.len() && truth.iter().zip(emitted).all(close);
        }
    }
    assert!(matched, "{}, {}: no output is that of emitted Rust", model.name, question.name);
}

/// One question of a program without inputs.
macro_rules! same {
    ($program:ident, $question:ident) => { same!($program, $question, distribution) };
    ($program:ident, $question:ident, $read:ident) => {{
        let answer = $program::$question().ask().unwrap();
        agree(&$program::model(), stringify!($question), &Inputs::new(), answer.$read());
        // Values that are not along a plate are computed in f64 and rounded when stored: a logarithm of −25 by 1e-6.
        let single = $program::$question::Question::<f32>::new().ask().unwrap();
        for (cell, (single, truth)) in single.$read().iter().zip(answer.$read()).enumerate() {
            let apart = (f64::from(*single) - truth).abs();
            assert!(apart <= 1e-5 * truth.abs() + 1e-35, "{}[{cell}]: {single}", stringify!($question));
        }
    }};
}

#[test]
fn every_door_gives_the_same_answer() {
    same!(asia, before, distribution_dyspnoea);
    same!(categorisation, category);
    same!(inverse_programming, belief);
    same!(log_coding, code_of_bell);
    same!(phototaxy, seen);
    same!(rain_umbrella, rain);
    same!(spam, spam);
    same!(sprinkler, rain);
    same!(sum_of_dice, last);
    same!(water_unit, output);
    same!(bearing, place);
    same!(bearing, turned);
    same!(bearing, sorted);
    same!(bearing, split);
    same!(residue, both);
    same!(wide, both);
    same!(wide, alone);
    let answer = homing::choice().alpha(7.0).beta(0.5).ask().unwrap();
    let inputs = Inputs::new().number("alpha", 7.0).number("beta", 0.5);
    agree(&homing::model(), "choice", &inputs, answer.distribution());
}

#[test]
fn threads_change_no_bit_of_answers_with_a_plate_of_their_own() {
    let [one, two, eight] = [1, 2, 8].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let both = pool.install(|| wide::both::Question::<f32>::new().ask()).unwrap();
        let alone = pool.install(|| wide::alone().ask()).unwrap();
        let bits = both.distribution().iter().map(|p| u64::from(p.to_bits()));
        bits.chain(alone.distribution().iter().map(|p| p.to_bits())).collect::<Vec<u64>>()
    });
    assert!(one.len() == 200_000 && one == two && one == eight);
}

#[test]
fn a_filter_is_the_same_through_every_door() {
    let before: Vec<f64> = (1..=20).map(|bin| f64::from(bin) / 210.0).collect();
    let question = pseudo_kalman::place().degrees(1f64.to_degrees()).previous_x(&before).previous_y(&before);
    let answer = question.b1(225).b2(180).b3(270).ask().unwrap();
    let inputs = Inputs::new().array("previous X", &before).array("previous Y", &before);
    let inputs = inputs.number("b1", 225.0).number("b2", 180.0).number("b3", 270.0);
    agree(&pseudo_kalman::model(), "place", &inputs, answer.distribution_x());
    agree(&pseudo_kalman::model(), "place", &inputs, answer.distribution_y());
}

#[test]
fn a_question_asked_again_allocates_nothing() {
    let mut answer = layered_network::effect::Answer::<f64>::default();
    let mut ask = |number: usize| {
        let [a1, a2, a3, a4] = [0, 1, 2, 3].map(|bit| number >> bit & 1 == 1);
        layered_network::effect().a1(a1).a2(a2).a3(a3).a4(a4).run_into(&mut answer).unwrap();
        answer.p(true)
    };
    let first: Vec<f64> = (0..16).map(&mut ask).collect();
    let mut sum = 0.0;
    let one = allocation_counter::measure(|| drop(std::hint::black_box(vec![1u8; 100])));
    assert_eq!(one.count_total, 1, "the counter counts");
    let counted = allocation_counter::measure(|| sum = (0..100_000).map(&mut ask).sum());
    assert_eq!(counted.count_total, 0);
    assert!((sum - 6250.0 * first.iter().sum::<f64>()).abs() < 1e-6);
}
