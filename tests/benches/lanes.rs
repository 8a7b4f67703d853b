//! The gallery loaded at run time, compared with the compiled programs: `cargo bench --bench lanes`.
//!
//! In: programs of `examples/`. Out: the least time of each question by emitted Rust and by lanes, and their ratio.
//! Invariant: both give the same numbers, and alternate, so that disturbances affect both.

use bp_core::compiler::answer::link;
use bp_core::compiler::exec::compiled::Value;
use bp_core::compiler::exec::{Inputs, Lanes, Outputs};
use bp_core::compiler::lower::lower;
use bp_core::compiler::model::Model;
use bp_core::compiler::plan::{Options, Route, plan};
use bp_macros::bayesian_program;
use std::hint::black_box;
use std::time::{Duration, Instant};

bayesian_program!("examples/asia.bp");
bayesian_program!("examples/boat.bp");
bayesian_program!("examples/boat_relaxed.bp");
bayesian_program!("examples/categorisation.bp");
bayesian_program!("examples/homing.bp");
bayesian_program!("examples/inverse_programming.bp");
bayesian_program!("examples/layered_network.bp");
bayesian_program!("examples/log_coding.bp");
bayesian_program!("examples/phototaxy.bp");
bayesian_program!("examples/rain_umbrella.bp");
bayesian_program!("examples/spam.bp");
bayesian_program!("examples/sprinkler.bp");
bayesian_program!("examples/sum_of_dice.bp");
bayesian_program!("examples/water_unit.bp");

/// The kernel of a question that a single kernel answers.
fn lanes(model: &Model, question: &str) -> Lanes {
    let model = link(model).expect("its subroutines have answers");
    let question = model.question(question).expect("it is declared");
    let plan = plan(&model, question, Options::default()).expect("a plan");
    let [Route::Exact(exact)] = plan.routes.as_slice() else { panic!("{} is one kernel", question.name) };
    Lanes::new(lower(&model, exact, &question.name).expect("a kernel").kernel)
}

/// The least time of a run of each, in turns until `patience` ends; each turn is long enough for the resolution of the
/// clock.
fn race(patience: Duration, tasks: [&mut dyn FnMut(); 2]) -> [f64; 2] {
    let begin = Instant::now();
    let mut least = [f64::INFINITY; 2];
    let mut times = [1u32; 2];
    while begin.elapsed() < patience || least[1].is_infinite() {
        for (task, run) in [0, 1].into_iter().zip([0, 1]) {
            let start = Instant::now();
            (0..times[task]).for_each(|_| tasks[run]());
            let spent = start.elapsed();
            match spent < Duration::from_micros(200) {
                true => times[task] *= 2,
                false => least[task] = least[task].min(spent.as_secs_f64() / f64::from(times[task])),
            }
        }
    }
    least
}

/// Times one question, and prints a line. Inputs have the same names in both interfaces.
macro_rules! row {
    ($patience:expr, $program:ident, $question:ident, $output:ident $(, $name:ident = $value:expr)*) => {{
        let compiled = $program::$question()$(.$name($value))*;
        let inputs = Inputs::<f64>::new()$(.number(stringify!($name), Value::number($value)))*;
        let loaded = lanes(&$program::model(), stringify!($question));
        let mut emitted = $program::$question::Answer::<f64>::default();
        let mut found = Outputs::default();
        compiled.run_into(&mut emitted).expect("it fits");
        loaded.run_into(&inputs, &mut found).expect("it fits");
        let same = |cells: &[f64]| {
            let close = |(p, q): (&f64, &f64)| (p - q).abs() <= 1e-12 * p.abs().max(1e-3);
            cells.len() == emitted.$output().len() && cells.iter().zip(emitted.$output()).all(close)
        };
        assert!(found.arrays.iter().any(|(_, cells)| same(cells)), "{}", stringify!($program));
        let cells = emitted.$output().len();
        let [one, other] = race($patience, [
            &mut || {
                black_box(compiled).run_into(black_box(&mut emitted)).expect("it fits");
            },
            &mut || loaded.run_into(black_box(&inputs), black_box(&mut found)).expect("it fits"),
        ]);
        let name = concat!(stringify!($program), ", ", stringify!($question));
        println!("{name:<32}{cells:>9}{:>12.2}{:>12.2}{:>8.2}", one * 1e6, other * 1e6, other / one);
    }};
}

fn main() {
    // `cargo test --benches` only checks that it runs.
    let timed = std::env::args().any(|argument| argument == "--bench");
    let patience = Duration::from_millis(if timed { 500 } else { 0 });
    let degrees = 1f64.to_degrees();
    println!("{:<32}{:>9}{:>12}{:>12}{:>8}", "f64, one thread", "numbers", "emitted µs", "lanes µs", "ratio");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    pool.install(|| {
        row!(patience, asia, before, distribution_dyspnoea);
        row!(patience, boat, bearings, distribution, degrees = degrees);
        row!(patience, boat, all, distribution, degrees = degrees);
        row!(patience, boat_relaxed, along, distribution, degrees = degrees);
        row!(patience, categorisation, category, distribution);
        row!(patience, homing, choice, distribution, alpha = 7.0, beta = 0.5);
        row!(patience, inverse_programming, belief, distribution);
        row!(patience, layered_network, effect, distribution, a1 = false, a2 = true, a3 = true, a4 = false);
        row!(patience, log_coding, code_of_bell, distribution);
        row!(patience, phototaxy, turn, distribution);
        row!(patience, phototaxy, seen, distribution);
        row!(patience, rain_umbrella, rain, distribution);
        row!(patience, spam, spam, distribution);
        row!(patience, sprinkler, rain, distribution);
        row!(patience, sum_of_dice, sum, distribution);
        row!(patience, sum_of_dice, last, distribution);
        row!(patience, water_unit, output, distribution);
        row!(patience, water_unit, filter, distribution);
    });
}
