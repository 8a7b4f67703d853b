//! The range sensor over all rays, the choice of a gaze, and a question of three variables.
//!
//! In: made-up readings and maps. Out: each emitted, by hand, and by lanes where they can run it. Invariant: as for the
//! cell program, they agree before they are timed.

use crate::cell::numbers;
use crate::clock::{Task, Work, table};
use crate::hand_senses;
use bp_core::compiler::answer::{argmax, compile};
use bp_core::compiler::exec::{Inputs, Lanes, Outputs};
use bp_core::compiler::lower::lower;
use bp_core::compiler::plan::{Options, Route, plan};
use bp_core::compiler::space::{Edge, Space};
use bp_macros::bayesian_program;
use bvm::programs::{gaze, line_of_sight};
use std::hint::black_box;

bayesian_program! {
    /// Is it the rain or the sprinkler? Its numbers come when it runs, as those of the loop by hand do.
    program WetGrass {
        parameters { rain, sprinkler : probability; }
        variables { Rain, Sprinkler, Wet : bool; }
        decomposition { P(Rain) P(Sprinkler | Rain) P(Wet | Rain Sprinkler) }
        forms {
            P(Rain)                 = bernoulli(rain);
            P(Sprinkler | Rain)     = bernoulli(if Rain { 0 } else { sprinkler });
            P(Wet | Rain Sprinkler) = dirac(Rain or Sprinkler);
        }
        question rain { P(Rain | Wet) }
    }
}

/// Prints the tables.
pub(crate) fn run(seconds: f64) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    pool.install(|| {
        range_sensor(seconds);
        gaze_choice(seconds);
        small_question(seconds);
    });
}

fn range_sensor(seconds: f64) {
    let (rays, bins) = (32_400usize, 10usize);
    let z: Vec<f32> = (0..rays).map(|ray| ((ray * 7) % (bins + 1)) as f32).collect();
    let (lambda, rho) = (numbers(rays, 0.0), numbers(rays, 3.0));
    let (sigma_min, ln_b) = (0.05f32, 0.2f32);
    let deviations: Vec<f32> = lambda.iter().zip(&rho).map(|(l, r)| sigma_min / (l * r * ln_b)).collect();
    let inputs = line_of_sight::reading()
        .rays(rays)
        .n(bins)
        .z(&z)
        .sigma_min(f64::from(sigma_min))
        .ln_b(f64::from(ln_b))
        .lambda(&lambda)
        .rho(&rho);
    let mut emitted = line_of_sight::reading::Answer::default();
    inputs.run_into(&mut emitted).expect("it fits");
    let mut made = vec![0.0f32; 2 * bins * rays];
    hand_senses::range_sensor(bins, &z, &deviations, &mut made);
    // The kernel's order is [O][C] or [C][O], as in the question.
    let swapped: Vec<f32> = (0..bins)
        .flat_map(|c| [0, 1].map(|o| (o * bins + c) * rays))
        .flat_map(|at| &made[at..at + rays])
        .copied()
        .collect();
    let far = |other: &[f32]| {
        other.iter().zip(emitted.distribution()).map(|(x, y)| (x - y).abs()).fold(0.0, f32::max)
    };
    let apart = far(&made).min(far(&swapped));
    assert!(apart < 1e-5, "the range sensor by hand is {apart} away");
    let program = line_of_sight::model();
    let question = program.question("reading").expect("a question");
    let plan = plan(&program, question, Options::default()).expect("a plan");
    let [Route::Exact(exact)] = plan.routes.as_slice() else { panic!("one pass answers") };
    let lanes = Lanes::new(lower(&program, exact, "reading").expect("a kernel").kernel);
    let mut by_lanes = Outputs::default();
    let given = Inputs::new()
        .size("Rays", rays)
        .size("N", bins)
        .array("z", &z)
        .number("sigma_min", sigma_min)
        .number("ln_b", ln_b)
        .array("lambda", &lambda)
        .array("rho", &rho);
    let mut tasks: Vec<Task<'_>> = vec![
        (
            "by hand",
            Box::new(|| {
                pulp::Arch::new().dispatch(hand_senses::Rays {
                    bins,
                    readings: black_box(&z),
                    deviations: &deviations,
                    made: black_box(&mut made),
                });
            }),
        ),
        (
            "emitted Rust",
            Box::new(|| {
                inputs.run_into(black_box(&mut emitted)).expect("fits");
            }),
        ),
        ("lanes", Box::new(|| lanes.run_into(&given, black_box(&mut by_lanes)).expect("fits"))),
    ];
    let work = Work {
        title: "range sensor: 32 400 rays of 10 cells",
        bytes: 4 * rays * (3 + 2 * bins),
        unit: ("ms", 1e3),
    };
    table(&work, 2.0 * seconds, &mut tasks);
}

fn gaze_choice(seconds: f64) {
    let extents = [10, 90, 360];
    let space = Space::new(extents, [Edge::Open, Edge::Pole, Edge::Circle]).expect("a grid");
    let (entropy, eta) = (numbers(space.cells(), 5.0), gaze::DEFAULT_ETA as f32);
    // Free up to somewhere between the first cell and the last.
    let plane = extents[1] * extents[2];
    let occupied: Vec<f32> = (0..space.cells())
        .map(|cell| if cell / plane <= (cell % plane * 7) % 12 { 0.1 } else { 0.5 })
        .collect();
    let inputs = gaze::look(&space).eta(f64::from(eta)).map_p_o_c(&occupied).map_h(&entropy);
    let away = numbers(space.cells(), 7.0);
    let mut emitted = gaze::look::Answer::default();
    inputs.run_into(&mut emitted).expect("it fits");
    let mut made = vec![0.0f32; space.cells()];
    hand_senses::gaze(extents, eta, &occupied, &entropy, &mut made);
    for (x, y) in made.iter().zip(emitted.scores()) {
        assert!((x - y).abs() < 1e-5, "the gaze by hand: {x} is not {y}");
    }
    let mut tasks: Vec<Task<'_>> = vec![
        (
            "by hand",
            Box::new(|| {
                let gaze = hand_senses::Gaze {
                    extents,
                    eta,
                    occupied: black_box(&occupied),
                    entropy: &entropy,
                    made: &mut made,
                };
                black_box(pulp::Arch::new().dispatch(gaze));
            }),
        ),
        (
            "emitted Rust",
            Box::new(|| {
                inputs.run_into(black_box(&mut emitted)).expect("fits");
                black_box(argmax(emitted.scores(), Some(&away)));
            }),
        ),
    ];
    let work = Work {
        title: "gaze choice: scores of 324 000 cells, and the best",
        bytes: 4 * 3 * space.cells(),
        unit: ("ms", 1e3),
    };
    table(&work, 2.0 * seconds, &mut tasks);
}

fn small_question(seconds: f64) {
    const TIMES: usize = 1000;
    let inputs = wet_grass::rain().rain(0.3).sprinkler(0.9);
    let mut answer = wet_grass::rain::Answer::<f64>::default();
    // By wetness: dry first. Rain makes wet with certainty, and so does the sprinkler, which is off when it rains.
    let by_hand = |rain: f64, sprinkler: f64| {
        let (dry, sprinkled) = ((1.0 - rain) * (1.0 - sprinkler), (1.0 - rain) * sprinkler);
        let wet = rain + sprinkled;
        let impossible = dry <= 0.0;
        [[if impossible { 0.0 } else { 1.0 }, 0.0], [sprinkled / wet, rain / wet]]
    };
    inputs.run_into(&mut answer).expect("it fits");
    let expected = by_hand(0.3, 0.9);
    let found = answer.distribution().iter().zip(expected.as_flattened());
    assert!(found.into_iter().all(|(found, expected)| (found - expected).abs() < 1e-12), "{answer:?}");
    let model = wet_grass::model();
    let typed = compile(&model, model.question("rain").expect("it is declared")).expect("a plan");
    let given = Inputs::new().number("rain", 0.3).number("sprinkler", 0.9);
    let mut tasks: Vec<Task<'_>> = vec![
        (
            "by hand",
            Box::new(move || {
                for _ in 0..TIMES {
                    black_box(by_hand(black_box(0.3), black_box(0.9)));
                }
            }),
        ),
        (
            "emitted Rust",
            Box::new(move || {
                for _ in 0..TIMES {
                    black_box(inputs).run_into(black_box(&mut answer)).expect("fits");
                }
            }),
        ),
    ];
    tasks.push((
        "asked again, of the text",
        Box::new(move || {
            for _ in 0..TIMES {
                drop(black_box(typed.ask(black_box(&given))));
            }
        }),
    ));
    let unit = ("ns", 1e9 / TIMES as f64);
    table(&Work { title: "a question of three variables, f64", bytes: 0, unit }, 0.5 * seconds, &mut tasks);
}
