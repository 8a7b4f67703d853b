//! The cell program on small grids, checked by hand.
//!
//! In: `tests/programs/cell.bp`, marginals of the last step, likelihoods. Out: P(O V | Z), entropies. Invariant:
//! expected values are those of the published hand-checkable step, or of a loop over cells written here.

use crate::support::{model_of, near, program};
use bp_core::compiler::exec::{Inputs, interpret};
use bp_core::compiler::lower::lower;
use bp_core::compiler::model::{Model, Statistic};
use bp_core::compiler::plan::{Options, Rewrites, Route, plan};
use bp_core::compiler::space::{Edge, Space};

/// The cell program, with its marginals and its entropy.
fn model() -> Model {
    let asks = "question all { P(O V | Z); P(O | Z); P(V | Z); entropy P(O V | Z); P(O = true | Z) }";
    model_of(&program("cell").replace("question state { P(O V | Z) }", asks))
}

struct State {
    /// \[o\]\[v\]\[cell\]
    joint: Vec<f64>,
    /// \[o\]\[cell\]
    occupied: Vec<f64>,
    /// \[v\]\[cell\]
    velocity: Vec<f64>,
    /// \[cell\]
    entropy: Vec<f64>,
    wanted: Vec<f64>,
}

struct World<'w> {
    space: &'w Space,
    moves: &'w [[i32; 3]],
    epsilon: f64,
    /// \[o\]\[cell\]
    previous_o: Vec<f64>,
    /// \[v\]\[cell\]
    previous_v: Vec<f64>,
    /// \[sensor\]\[v\]\[o\]\[cell\]
    likelihood: Vec<f64>,
    sensors: usize,
}

impl World<'_> {
    fn step(&self, rewrites: Rewrites) -> State {
        let model = model();
        let options = Options { rewrites, ..Options::default() };
        let plan = plan(&model, model.question("all").unwrap(), options).unwrap();
        let [Route::Exact(exact)] = plan.routes.as_slice() else { panic!("the asks share a pass") };
        let lowered = lower(&model, exact, "cell").unwrap();
        let moves = self.space.antecedents(self.moves);
        let inputs = Inputs::new()
            .grid("Grid", self.space)
            .displacements("Velocity", &moves)
            .size("Sensors", self.sensors)
            .number("epsilon", self.epsilon)
            .array("previous O", &self.previous_o)
            .array("previous V", &self.previous_v)
            .array("Sensors[i].reading", &self.likelihood);
        // Sizes and arrays that no kernel reads may be given.
        let outputs = interpret(&lowered.kernel, &inputs).unwrap_or_else(|error| panic!("{error}"));
        let of = |statistic: &Statistic, names: &[&str], at: bool| {
            let found = lowered.outputs.iter().find(|output| {
                output.ask.as_ref().is_some_and(|ask| {
                    let searched: Vec<_> =
                        ask.searched.iter().map(|s| model.variable_name(s.variable)).collect();
                    ask.statistic == *statistic && searched == names && ask.searched[0].at.is_some() == at
                })
            });
            outputs.get(found.unwrap().key).to_vec()
        };
        let p = Statistic::Distribution;
        State {
            joint: of(&p, &["O", "V"], false),
            occupied: of(&p, &["O"], false),
            velocity: of(&p, &["V"], false),
            entropy: of(&Statistic::Entropy, &["O", "V"], false),
            wanted: of(&p, &["O"], true),
        }
    }
}

#[test]
fn the_hand_checkable_step() {
    let space = Space::new([5, 1, 1], [Edge::Open; 3]).unwrap();
    let occupied = [0.5, 0.5, 0.9, 0.2, 0.5];
    let third = 1.0 / 3.0;
    let mut world = World {
        space: &space,
        moves: &[[-1, 0, 0], [0, 0, 0], [1, 0, 0]],
        epsilon: 0.1,
        previous_o: occupied.iter().map(|p| 1.0 - p).chain(occupied).collect(),
        previous_v: [
            [third, third, 0.1, third, third],
            [third, third, 0.2, third, third],
            [third, third, 0.7, third, third],
        ]
        .concat(),
        likelihood: vec![1.0; 3 * 2 * 5],
        sensors: 1,
    };
    let predicted = world.step(Rewrites::default());
    // The reference numbers cells from 0.
    near(predicted.occupied[5 + 3], 0.6053658536585366, 1e-9);
    near(predicted.occupied[5 + 2], 0.4815384615384616, 1e-9);
    for (v, expected) in [0.24390244, 0.24390244, 0.51219512].into_iter().enumerate() {
        near(predicted.velocity[v * 5 + 3], expected, 1e-8);
    }
    world.likelihood = (0..30).map(|position| if position / 5 % 2 == 1 { 0.8 } else { 0.2 }).collect();
    let estimated = world.step(Rewrites::default());
    near(estimated.occupied[5 + 3], 0.8598648882729949, 1e-9);
    near(estimated.entropy[3], 1.2526545790440644, 1e-9);
    near(estimated.occupied[5 + 2], 0.7879169288860919, 1e-9);
    near(estimated.entropy[2], 1.5426503226262418, 1e-9);
    for (v, expected) in [0.2165252, 0.15416594, 0.62930885].into_iter().enumerate() {
        near(estimated.velocity[v * 5 + 3], expected, 1e-8);
    }
    near(estimated.wanted[3], estimated.occupied[5 + 3], 1e-15);
    // Two sensors with equal readings: their likelihoods multiply.
    let twice = [world.likelihood.clone(), world.likelihood.clone()].concat();
    world.likelihood = world.likelihood.iter().map(|p| p * p).collect();
    let squared = world.step(Rewrites::default());
    (world.likelihood, world.sensors) = (twice, 2);
    for (p, q) in world.step(Rewrites::default()).joint.iter().zip(&squared.joint) {
        near(*p, *q, 1e-14);
    }
}

/// A repeatable number in ]0, 1[.
fn noise(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    ((*seed >> 11) as f64 + 0.5) / (1u64 << 53) as f64
}

/// The cell whose content `displacement` moves to (depth, row, lane).
fn came_from(
    extents: [usize; 3],
    pole: bool,
    circle: bool,
    cell: [i32; 3],
    displacement: [i32; 3],
) -> Option<usize> {
    let [depths, rows, lanes] = extents.map(|extent| extent as i32);
    let [depth, mut row, mut lane] = [0, 1, 2].map(|axis| cell[axis] - displacement[axis]);
    if pole && row == -1 {
        (row, lane) = (0, lane + lanes / 2);
    } else if pole && row == rows {
        (row, lane) = (rows - 1, lane + lanes / 2);
    }
    if circle {
        lane = (lane + 4 * lanes) % lanes;
    }
    let inside = (0..depths).contains(&depth) && (0..rows).contains(&row) && (0..lanes).contains(&lane);
    inside.then_some(((depth * rows + row) * lanes + lane) as usize)
}

fn against_a_loop(extents: [usize; 3], pole: bool, circle: bool, rewrites: Rewrites) {
    let edges = [
        Edge::Open,
        if pole { Edge::Pole } else { Edge::Open },
        if circle { Edge::Circle } else { Edge::Open },
    ];
    let space = Space::new(extents, edges).unwrap();
    let moves = [[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1], [1, -1, 2]];
    let (n, cells, epsilon) = (moves.len(), space.cells(), 0.05);
    let mut seed = 7;
    let occupied: Vec<f64> = (0..cells).map(|_| noise(&mut seed)).collect();
    let mut velocity: Vec<f64> = (0..n * cells).map(|_| noise(&mut seed)).collect();
    for cell in 0..cells {
        let total: f64 = (0..n).map(|v| velocity[v * cells + cell]).sum();
        (0..n).for_each(|v| velocity[v * cells + cell] /= total);
    }
    let likelihood: Vec<f64> = (0..2 * n * 2 * cells).map(|_| noise(&mut seed)).collect();
    let world = World {
        space: &space,
        moves: &moves,
        epsilon,
        previous_o: occupied.iter().map(|p| 1.0 - p).chain(occupied.iter().copied()).collect(),
        previous_v: velocity.clone(),
        likelihood: likelihood.clone(),
        sensors: 2,
    };
    let state = world.step(rewrites);
    let [_, rows, lanes] = extents.map(|extent| extent as i32);
    for cell in 0..cells {
        let place = [cell as i32 / (rows * lanes), cell as i32 / lanes % rows, cell as i32 % lanes];
        let mut weights = vec![[0.0; 2]; n];
        for (v, displacement) in moves.iter().enumerate() {
            // Outside the grid P(O) is ½, and all velocities are equally probable.
            let (p, q) = match came_from(extents, pole, circle, place, *displacement) {
                Some(from) => (occupied[from], velocity[v * cells + from]),
                None => (0.5, 1.0 / n as f64),
            };
            let now = [epsilon * p + (1.0 - epsilon) * (1.0 - p), (1.0 - epsilon) * p + epsilon * (1.0 - p)];
            for o in 0..2 {
                let seen = |sensor: usize| likelihood[((sensor * n + v) * 2 + o) * cells + cell];
                weights[v][o] = q * now[o] * seen(0) * seen(1);
            }
        }
        let total: f64 = weights.iter().flatten().sum();
        let mut entropy = 0.0;
        for (v, o) in (0..n).flat_map(|v| [(v, 0), (v, 1)]) {
            let p = weights[v][o] / total;
            entropy -= p * p.ln();
            near(state.joint[(o * n + v) * cells + cell], p, 1e-12);
        }
        near(state.entropy[cell], entropy, 1e-12);
        near(state.wanted[cell], weights.iter().map(|pair| pair[1]).sum::<f64>() / total, 1e-12);
    }
}

#[test]
fn cells_of_a_grid_with_a_circle_and_poles() {
    against_a_loop([3, 4, 6], true, true, Rewrites::default());
    against_a_loop([3, 4, 6], false, true, Rewrites::default());
    against_a_loop([2, 3, 5], false, false, Rewrites::default());
    against_a_loop([1, 1, 4], true, true, Rewrites::default());
}

#[test]
fn rules_change_nothing_for_a_cell() {
    let all = Rewrites::default();
    for rewrites in [
        Rewrites { barren: false, ..all },
        Rewrites { cancel: false, ..all },
        Rewrites { order: false, ..all },
        Rewrites { scan: false, ..all },
    ] {
        against_a_loop([3, 2, 4], true, true, rewrites);
    }
}
