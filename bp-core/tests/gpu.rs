//! Kernels on a graphics processor, compared with the interpreter. Needs the feature `gpu`; skipped without an adapter.
//!
//! In: the map's programs and a few of the gallery, on small inputs. Out: pass or fail. Invariant: f32 tolerance, since
//! a shader computes in f32 throughout.
#![cfg(feature = "gpu")]

use bp_core::compiler::answer::link;
use bp_core::compiler::exec::{Inputs, interpret};
use bp_core::compiler::gpu::Gpu;
use bp_core::compiler::lower::lower;
use bp_core::compiler::plan::{Options, Route, plan};
use bp_core::compiler::source::Source;
use bp_core::compiler::space::{Edge, Space};
use bp_core::compiler::syntax::compile;
use std::path::Path;

/// Numbers by name.
type Given<'g> = [(&'g str, Vec<f64>)];

/// Arbitrary numbers in ]0, 1[.
fn numbers(count: usize, seed: f64) -> Vec<f64> {
    (0..count).map(|i| 0.5 + 0.45 * (i as f64 * 0.37 + seed).sin()).collect()
}

/// Asks a question of a program on the device and with the interpreter.
fn agree(
    gpu: &Gpu,
    path: &str,
    question: &str,
    sizes: &[(&str, usize)],
    given: &Given<'_>,
    grid: Option<&Space>,
) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path);
    let text = std::fs::read_to_string(root).unwrap();
    let model = compile(&Source::new(path, &text)).unwrap();
    let model = link(&model).unwrap();
    let plan = plan(&model, model.question(question).unwrap(), Options::default()).unwrap();
    let [Route::Exact(exact)] = plan.routes.as_slice() else {
        panic!("{path}: {question} is one exact route")
    };
    let kernel = lower(&model, exact, question).unwrap().kernel;
    let moves = grid.map(|grid| {
        grid.antecedents(&[[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
    });
    let single: Vec<(&str, Vec<f32>)> =
        given.iter().map(|(name, values)| (*name, values.iter().map(|x| *x as f32).collect())).collect();
    let (mut exactly, mut nearly) = (Inputs::<f64>::new(), Inputs::<f32>::new());
    for (name, size) in sizes {
        (exactly, nearly) = (exactly.size(name, *size), nearly.size(name, *size));
    }
    if let (Some(grid), Some(moves)) = (grid, &moves) {
        exactly = exactly.grid("Grid", grid).displacements("Velocity", moves);
        nearly = nearly.grid("Grid", grid).displacements("Velocity", moves);
    }
    for ((name, values), (_, single)) in given.iter().zip(&single) {
        (exactly, nearly) = (exactly.array(name, values), nearly.array(name, single));
    }
    let truth = interpret(&kernel, &exactly).unwrap();
    let found = gpu.prepare(kernel).run(&nearly).unwrap();
    for ((name, truth), (other, found)) in truth.arrays.iter().zip(&found.arrays) {
        assert_eq!((name, truth.len()), (other, found.len()), "{path}");
        for (cell, (truth, found)) in truth.iter().zip(found).enumerate() {
            let apart = (truth - f64::from(*found)).abs();
            assert!(
                apart <= 2e-5 * truth.abs().max(1.0),
                "{path}, {name:?}[{cell}]: {found}, expected {truth}"
            );
        }
    }
}

#[test]
fn the_device_agrees_with_the_interpreter() {
    let Some(gpu) = Gpu::open() else {
        eprintln!("skipped: no adapter");
        return;
    };
    eprintln!("on {}", gpu.name());
    let space = Space::new([4, 6, 50], [Edge::Open, Edge::Pole, Edge::Circle]).unwrap();
    let cells = space.cells();
    let occupied = numbers(cells, 0.0);
    let occupancy: Vec<f64> = occupied.iter().map(|p| 1.0 - p).chain(occupied.iter().copied()).collect();
    let mut velocity = numbers(7 * cells, 2.0);
    for cell in 0..cells {
        let total: f64 = (0..7).map(|v| velocity[v * cells + cell]).sum();
        (0..7).for_each(|v| velocity[v * cells + cell] /= total);
    }
    let cell = [
        ("epsilon", vec![0.02]),
        ("motion", vec![0.4, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1]),
        ("previous O", occupancy),
        ("previous V", velocity),
        ("Sensors[i].reading", numbers(4 * cells, 1.0)),
    ];
    agree(&gpu, "bvm/models/cell.bp", "observe", &[("Sensors", 2)], &cell, Some(&space));
    let gaze = [("eta", vec![0.01]), ("map.P(O | C)", numbers(cells, 3.0)), ("map.H", numbers(cells, 5.0))];
    agree(&gpu, "bvm/models/gaze.bp", "look", &[], &gaze, Some(&space));
    let rays = 300;
    let line = [
        ("z", (0..rays).map(|ray| (ray * 7 % 11) as f64).collect()),
        ("lambda", numbers(rays, 0.0)),
        ("rho", numbers(rays, 3.0)),
        ("sigma_min", vec![0.05]),
        ("ln_b", vec![0.2]),
    ];
    // Cells of a ray that are unrolled, looped over, and too many to be private to an invocation.
    for cells in [10, 100, 300] {
        let sizes = [("Rays", rays), ("N", cells)];
        agree(&gpu, "bvm/models/line_of_sight.bp", "reading", &sizes, &line, None);
    }
    // One reading for all rays.
    let mut once = line.clone();
    once[0].1 = vec![3.0];
    agree(&gpu, "bvm/models/line_of_sight.bp", "reading", &[("Rays", rays), ("N", 10)], &once, None);
    for (program, question) in
        [("water_unit", "output"), ("asia", "before"), ("sum_of_dice", "last"), ("spam", "spam")]
    {
        agree(&gpu, &format!("examples/{program}.bp"), question, &[], &[], None);
    }
}
