//! The cell program over 10 × 360 × 90 cells and 7 velocities, one sensor, f32.
//!
//! In: a smooth state without certain cells. Out: `step` and `observe` by hand, emitted, by lanes and by the
//! interpreter. Invariant: emitted code and the loop written by hand agree before they are timed.

use crate::clock::{Task, Work, race_on, table};
use crate::hand;
use bp_core::compiler::exec::{Inputs, Lanes, Outputs, interpret};
use bp_core::compiler::kernel::OutputKey;
use bp_core::compiler::lower::lower;
use bp_core::compiler::plan::{Options, Route, plan};
use bp_core::compiler::space::{Edge, Space};
use bvm::map::VELOCITIES;
use bvm::programs::cell;
use rayon::prelude::*;
use std::hint::black_box;

const EXTENTS: [usize; 3] = [10, 90, 360];

/// Floats read and written by `step` for each cell: P(O) and P(V) before, the likelihood; P(O) and P(V) after.
const FLOATS: usize = 2 + 7 + 2 + 2 + 7;

/// Arbitrary numbers in ]0, 1[.
pub(crate) fn numbers(count: usize, seed: f32) -> Vec<f32> {
    (0..count).map(|i| 0.5 + 0.45 * ((i as f32 * 0.37 + seed).sin())).collect()
}

fn close(one: &[f32], other: &[f32], what: &str) {
    assert_eq!(one.len(), other.len(), "{what}");
    for (x, y) in one.iter().zip(other) {
        assert!((x - y).abs() <= 2e-5, "{what}: {x} is not {y}");
    }
}

/// Runs a loop written by hand over rows, on all threads; with as many rows in a piece as emitted code.
fn by_hand(question: hand::Question, cells: &hand::Cells<'_>, planes: &mut [Vec<f32>]) {
    let [_, _, lanes] = cells.extents;
    let run = |first: usize, made: &mut [&mut [f32]]| {
        pulp::Arch::new().dispatch(hand::Rows { question, cells, first, made });
    };
    if rayon::current_num_threads() == 1 {
        let mut made: Vec<&mut [f32]> = planes.iter_mut().map(Vec::as_mut_slice).collect();
        return run(0, &mut made);
    }
    let rows = 22;
    let pieces = planes[0].len().div_ceil(rows * lanes);
    let mut parts: Vec<Vec<&mut [f32]>> = (0..pieces).map(|_| Vec::new()).collect();
    for plane in planes {
        plane.chunks_mut(rows * lanes).zip(&mut parts).for_each(|(part, parts)| parts.push(part));
    }
    parts.par_iter_mut().enumerate().for_each(|(piece, made)| run(piece * rows, made));
}

/// The emitted step over grids of many sizes: time for each cell.
pub(crate) fn scale(seconds: f64) {
    println!("\nscale: the emitted step, f32; {} bytes of state and likelihood for each cell", 4 * FLOATS);
    println!("  {:<20}{:>12}{:>16}{:>18}", "cells", "MB", "ns a cell", "two threads");
    for extents in [[10, 16, 64], [10, 50, 200], [10, 160, 630], [10, 500, 2000], [10, 1580, 6330]] {
        let space = Space::new(extents, [Edge::Open, Edge::Pole, Edge::Circle]).expect("a grid");
        let (moves, plane) = (space.antecedents(&VELOCITIES), space.cells());
        if seconds == 0.0 && plane > 1_000_000 {
            continue;
        }
        let (occupancy, likelihood) = (vec![0.5f32; 2 * plane], vec![0.5f32; 2 * plane]);
        let velocity = vec![1.0f32 / 7.0; 7 * plane];
        let inputs = cell::step(&space, &moves)
            .sensors(1)
            .epsilon(0.01)
            .motion(&[0.4, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1])
            .previous_o(&occupancy)
            .previous_v(&velocity)
            .sensors_i_reading(&likelihood);
        let mut made = cell::step::Answer::default();
        let times = [1, 2].map(|threads| {
            let mut tasks: Vec<Task<'_>> = vec![(
                "step",
                Box::new(|| {
                    inputs.run_into(black_box(&mut made)).expect("fits");
                }),
            )];
            race_on(threads, 0.3 * seconds, &mut tasks)[0].least * 1e9 / plane as f64
        });
        let bytes = 4.0 * (FLOATS * plane) as f64 / 1e6;
        println!("  {plane:<20}{bytes:>12.1}{:>16.2}{:>18.2}", times[0], times[1]);
    }
}

/// Fills the rows of the table.
pub(crate) fn run(seconds: f64) {
    let space = Space::new(EXTENTS, [Edge::Open, Edge::Pole, Edge::Circle]).expect("a grid");
    let moves = space.antecedents(&VELOCITIES);
    let plane = space.cells();
    let (occupied, likelihood) = (numbers(plane, 0.0), numbers(2 * plane, 1.0));
    let occupancy: Vec<f32> = occupied.iter().map(|p| 1.0 - p).chain(occupied.iter().copied()).collect();
    let mut velocity = numbers(7 * plane, 2.0);
    for at in 0..plane {
        let total: f32 = (0..7).map(|v| velocity[v * plane + at]).sum();
        (0..7).for_each(|v| velocity[v * plane + at] /= total);
    }
    let motion = [0.4f32, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1];
    let epsilon = 0.01f32;
    let cells = hand::Cells {
        extents: EXTENTS,
        moves: &moves,
        epsilon,
        motion: &motion,
        occupancy: &occupancy,
        velocity: &velocity,
        likelihood: &likelihood,
    };
    let program = cell::model();
    let kernel = |name: &str| {
        let question = program.question(name).expect("a question of the program");
        let plan = plan(&program, question, Options::default()).expect("a plan");
        let [Route::Exact(exact)] = plan.routes.as_slice() else { panic!("one pass answers all") };
        lower(&program, exact, name).expect("a kernel").kernel
    };
    let inputs = Inputs::new()
        .grid("Grid", &space)
        .displacements("Velocity", &moves)
        .size("Sensors", 1)
        .number("epsilon", epsilon)
        .array("motion", &motion)
        .array("previous O", &occupancy)
        .array("previous V", &velocity)
        .array("Sensors[i].reading", &likelihood);
    let double = |values: &[f32]| values.iter().map(|x| f64::from(*x)).collect::<Vec<f64>>();
    let (motion_64, occupancy_64, velocity_64, likelihood_64) =
        (double(&motion), double(&occupancy), double(&velocity), double(&likelihood));
    let inputs_64 = Inputs::new()
        .grid("Grid", &space)
        .displacements("Velocity", &moves)
        .size("Sensors", 1)
        .number("epsilon", f64::from(epsilon))
        .array("motion", &motion_64)
        .array("previous O", &occupancy_64)
        .array("previous V", &velocity_64)
        .array("Sensors[i].reading", &likelihood_64);
    macro_rules! emitted_inputs {
        ($question:ident) => {
            cell::$question(&space, &moves)
                .sensors(1)
                .epsilon(f64::from(epsilon))
                .motion(&motion)
                .previous_o(&occupancy)
                .previous_v(&velocity)
                .sensors_i_reading(&likelihood)
        };
    }
    let (step, observe) = (emitted_inputs!(step), emitted_inputs!(observe));
    let mut planes: Vec<Vec<f32>> = vec![vec![0.0; plane]; 9];
    let mut more: Vec<Vec<f32>> = vec![vec![0.0; plane]; 11];
    let (mut stepped, mut observed) = (cell::step::Answer::default(), cell::observe::Answer::default());
    let (step_lanes, observe_lanes) = (Lanes::new(kernel("step")), Lanes::new(kernel("observe")));
    let mut by_lanes = [Outputs::default(), Outputs::default()];
    let mut seven = planes.clone();
    by_hand(hand::Question::StepOfSeven, &cells, &mut seven);
    by_hand(hand::Question::Step, &cells, &mut planes);
    close(&seven.concat(), &planes.concat(), "the loop for seven velocities");
    step.run_into(&mut stepped).expect("it fits");
    close(&planes[..2].concat(), stepped.distribution_o(), "P(O)");
    close(&planes[2..].concat(), stepped.distribution_v(), "P(V)");
    by_hand(hand::Question::Observe, &cells, &mut more);
    observe.run_into(&mut observed).expect("it fits");
    close(&more[..2].concat(), observed.distribution_o(), "P(O) of observe");
    close(&more[9], observed.entropy_o_v(), "H(O V)");
    close(&more[10], observed.entropy_o(), "H(O)");
    let mut tasks: Vec<Task<'_>> = vec![
        (
            "by hand, for 7 velocities",
            Box::new(|| by_hand(hand::Question::StepOfSeven, &cells, black_box(&mut seven))),
        ),
        (
            "by hand, for any number",
            Box::new(|| by_hand(hand::Question::Step, &cells, black_box(&mut planes))),
        ),
        (
            "emitted Rust",
            Box::new(|| {
                step.run_into(black_box(&mut stepped)).expect("fits");
            }),
        ),
        ("lanes", Box::new(|| step_lanes.run_into(&inputs, black_box(&mut by_lanes[0])).expect("fits"))),
    ];
    let title = format!("step: P(O), P(V) of {plane} cells, 7 velocities");
    let work = Work { title: &title, bytes: 4 * FLOATS * plane, unit: ("ms", 1e3) };
    table(&work, 4.0 * seconds, &mut tasks);
    drop(tasks);
    crate::layouts::run(&cells, stepped.p_o(true), seconds);
    #[cfg(feature = "gpu")]
    on_a_device(&[kernel("step"), kernel("observe")], &inputs, seconds);
    let mut tasks: Vec<Task<'_>> = vec![
        ("by hand", Box::new(|| by_hand(hand::Question::Observe, &cells, black_box(&mut more)))),
        (
            "emitted Rust",
            Box::new(|| {
                observe.run_into(black_box(&mut observed)).expect("fits");
            }),
        ),
        ("lanes", Box::new(|| observe_lanes.run_into(&inputs, black_box(&mut by_lanes[1])).expect("fits"))),
    ];
    let title = "observe: step, H(O V) and H(O)";
    table(&Work { title, bytes: 4 * (FLOATS + 2) * plane, unit: ("ms", 1e3) }, 4.0 * seconds, &mut tasks);
    let interpreted = kernel("step");
    let start = std::time::Instant::now();
    let answer = interpret(&interpreted, &inputs_64).expect("it fits");
    println!("  {:<32}{:>10.0}  (once, f64, step)", "interpreter", start.elapsed().as_secs_f64() * 1e3);
    let single: Vec<f32> = answer.get(OutputKey::Ask(1)).iter().map(|x| *x as f32).collect();
    close(&single, stepped.distribution_v(), "P(V) of the interpreter");
}

/// The same kernels as shaders, with their inputs already on the device.
#[cfg(feature = "gpu")]
fn on_a_device(kernels: &[bp_core::compiler::kernel::Kernel], inputs: &Inputs<'_, f32>, seconds: f64) {
    let Some(gpu) = bp_core::compiler::gpu::Gpu::open() else {
        println!("  WGSL: skipped: no adapter");
        return;
    };
    for kernel in kernels {
        let ready = gpu.prepare(kernel.clone());
        let run = ready.load(inputs).expect("it fits");
        let mut tasks: Vec<Task<'_>> = vec![("WGSL", Box::new(|| run.dispatch()))];
        let time = crate::clock::race(seconds, &mut tasks)[0];
        let what = format!("WGSL: {}, on the device", kernel.name);
        println!("  {what:<32}{:>10.3}{:>10.3}  ({})", time.least * 1e3, time.median * 1e3, gpu.name());
    }
}
