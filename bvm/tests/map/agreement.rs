//! The map's programs through every back end and both doors: interpreter, lanes, and the Rust that the macro wrote.
//!
//! In: seeded inputs. Out: the same answers to 1e-12. Invariant: the compiled function and the kernel made at run time
//! from the same text are two ways to one answer.

use bp_core::answer::argmax;
use bp_core::exec::{Inputs, Lanes, interpret};
use bp_core::model::Model;
use bp_core::plan::{Options, Route, plan};
use bp_core::space::{Edge, Moves, Space};
use bvm::programs::{binaural, cell, gaze, line_of_sight, population_code, range_code, view};

/// A small generator, so that the inputs are the same everywhere (Knuth's MMIX constants).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn take(&mut self, count: usize) -> Vec<f64> {
        (0..count).map(|_| self.next()).collect()
    }
}

/// Runs a question by the interpreter and by lanes, checks that they agree, and gives the outputs in order.
fn by_kernel(model: &Model, question: &str, inputs: &Inputs<'_, f64>) -> Vec<Vec<f64>> {
    let plan = plan(model, model.question(question).unwrap(), Options::default()).unwrap();
    let [Route::Exact(exact)] = plan.routes.as_slice() else { panic!("one exact route") };
    let lanes = Lanes::new(bp_core::lower::lower(model, exact, question).unwrap().kernel);
    let truth = interpret(lanes.kernel(), inputs).unwrap();
    let found = lanes.run(inputs).unwrap();
    for ((key, truth), (_, found)) in truth.arrays.iter().zip(&found.arrays) {
        assert_same(&format!("{key:?}"), truth, found);
    }
    truth.arrays.into_iter().map(|(_, cells)| cells).collect()
}

fn assert_same(name: &str, truth: &[f64], found: &[f64]) {
    assert_eq!(truth.len(), found.len(), "{name}");
    for (position, (truth, found)) in truth.iter().zip(found).enumerate() {
        let close = (truth - found).abs() <= 1e-12 * truth.abs().max(1.0);
        assert!(close && found.is_finite(), "{name}[{position}]: {found}, but it is {truth}");
    }
}

const VELOCITIES: [[i32; 3]; 7] =
    [[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]];

fn grid() -> (Space, Moves) {
    let space = Space::new([4, 6, 130], [Edge::Open, Edge::Pole, Edge::Circle]).unwrap();
    let moves = space.antecedents(&VELOCITIES);
    (space, moves)
}

#[test]
fn the_cell_program_agrees() {
    let (space, moves) = grid();
    let (cells, mut numbers) = (space.cells(), Numbers(1));
    let occupied = numbers.take(cells);
    let previous_o: Vec<f64> = occupied.iter().map(|p| 1.0 - p).chain(occupied.iter().copied()).collect();
    let mut previous_v = numbers.take(7 * cells);
    for place in 0..cells {
        let total: f64 = (0..7).map(|v| previous_v[v * cells + place]).sum();
        (0..7).for_each(|v| previous_v[v * cells + place] /= total);
    }
    let readings = numbers.take(2 * 2 * cells);
    let motion = [0.4, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1];
    let inputs = Inputs::new()
        .grid("Grid", &space)
        .displacements("Velocity", &moves)
        .size("Sensors", 2)
        .number("epsilon", 0.02)
        .array("motion", &motion)
        .array("previous O", &previous_o)
        .array("previous V", &previous_v)
        .array("Sensors[i].reading", &readings);
    let truth = by_kernel(&cell::model(), "observe", &inputs);
    let mut found = cell::observe::Answer::default();
    let given = cell::observe(&space, &moves)
        .sensors(2)
        .epsilon(0.02)
        .motion(&motion)
        .previous_o(&previous_o)
        .previous_v(&previous_v)
        .sensors_i_reading(&readings);
    given.run_into(&mut found).unwrap();
    let found = [found.distribution_o(), found.distribution_v(), found.entropy_o_v(), found.entropy_o()];
    truth.iter().zip(found).for_each(|(truth, found)| assert_same("observe", truth, found));
}

#[test]
fn the_range_sensor_agrees() {
    let (rays, mut numbers) = (300, Numbers(2));
    let z: Vec<f64> = numbers.take(rays).iter().map(|x| (x * 11.0).floor()).collect();
    let lambda: Vec<f64> = numbers.take(rays).iter().map(|x| 0.05 + 0.95 * x).collect();
    let rho: Vec<f64> = numbers.take(rays).iter().map(|x| 1.0 + 1.5 * x).collect();
    let inputs = Inputs::new()
        .size("Rays", rays)
        .size("N", 10)
        .number("sigma_min", 0.01)
        .number("ln_b", 0.0916)
        .array("lambda", &lambda)
        .array("rho", &rho)
        .array("z", &z);
    let truth = by_kernel(&line_of_sight::model(), "reading", &inputs);
    let mut found = line_of_sight::reading::Answer::default();
    let given = line_of_sight::reading()
        .rays(rays)
        .n(10)
        .sigma_min(0.01)
        .ln_b(0.0916)
        .lambda(&lambda)
        .rho(&rho)
        .z(&z);
    given.run_into(&mut found).unwrap();
    assert_same("reading", &truth[0], found.distribution());
}

#[test]
fn the_range_sensor_that_spreads_its_reading_agrees() {
    let (rays, mut numbers) = (300, Numbers(12));
    let lambda: Vec<f64> = numbers.take(rays).iter().map(|x| 0.05 + 0.95 * x).collect();
    let rho: Vec<f64> = numbers.take(rays).iter().map(|x| 0.9 + 1.9 * x).collect();
    let inputs = Inputs::new()
        .size("Rays", rays)
        .size("N", 10)
        .number("N", 10.0)
        .number("rho_min", 1.0)
        .number("sigma_min", 0.01)
        .number("ln_b", 0.0916)
        .array("lambda", &lambda)
        .array("rho", &rho);
    let truth = by_kernel(&range_code::model(), "reading", &inputs);
    let question = range_code::reading().rays(rays).n(10).rho_min(1.0).sigma_min(0.01).ln_b(0.0916);
    let found = question.lambda(&lambda).rho(&rho).ask().unwrap();
    assert_same("reading", &truth[0], found.distribution());
}

#[test]
fn the_range_sensor_that_hears_codes_agrees() {
    let (rays, bins, mut numbers) = (300, 6, Numbers(7));
    let rho: Vec<f64> = numbers.take(rays).iter().map(|x| 1.0 + 1.5 * x).collect();
    let lambda: Vec<f64> = numbers.take(rays).iter().map(|x| 0.05 + 0.95 * x).collect();
    let (hidden, code) = (numbers.take(bins * rays), numbers.take((bins + 1) * rays));
    let inputs = Inputs::new()
        .size("Rays", rays)
        .size("N", bins)
        .number("sigma_min", 0.05)
        .number("ln_b", 0.0916)
        .array("lambda", &lambda)
        .array("rho", &rho)
        .array("hidden", &hidden)
        .array("code", &code);
    let truth = by_kernel(&population_code::model(), "heard", &inputs);
    let mut found = population_code::heard::Answer::default();
    let given = population_code::heard()
        .rays(rays)
        .n(bins)
        .sigma_min(0.05)
        .ln_b(0.0916)
        .lambda(&lambda)
        .rho(&rho)
        .hidden(&hidden)
        .code(&code);
    given.run_into(&mut found).unwrap();
    assert_same("heard", &truth[0], found.distribution());
}

#[test]
fn the_ears_agree() {
    let (cells, mut numbers) = (500, Numbers(3));
    let mu_tau: Vec<f64> = numbers.take(cells).iter().map(|x| x * 1e-3 - 5e-4).collect();
    let mu_l: Vec<f64> = numbers.take(4 * cells).iter().map(|x| x * 20.0 - 10.0).collect();
    let (tau, l) = ([1e-4], [1.0, -2.0, 3.0, 4.0]);
    let inputs = Inputs::new()
        .size("Grid", cells)
        .size("Channels", 4)
        .number("rate", 0.1)
        .number("tau_max", 1e-3)
        .number("l_max", 40.0)
        .number("sigma_tau", 1e-4)
        .number("sigma_l", 6.0)
        .array("mu_tau", &mu_tau)
        .array("mu_l", &mu_l)
        .array("tau", &tau)
        .array("l", &l);
    let truth = by_kernel(&binaural::model(), "source", &inputs);
    let mut found = binaural::source::Answer::default();
    let given = binaural::source()
        .grid(cells)
        .channels(4)
        .rate(0.1)
        .tau_max(1e-3)
        .l_max(40.0)
        .sigma_tau(1e-4)
        .sigma_l(6.0)
        .mu_tau(&mu_tau)
        .mu_l(&mu_l)
        .tau(&tau)
        .l(&l);
    given.run_into(&mut found).unwrap();
    assert_same("source", &truth[0], found.distribution());
}

#[test]
fn the_gaze_agrees_and_is_that_of_steps_1_to_3() {
    let (space, _) = grid();
    let (cells, mut numbers) = (space.cells(), Numbers(4));
    let [depths, rows, lanes] = space.extents();
    let (mut occupied, entropy) = (numbers.take(cells), numbers.take(cells));
    // Of every third line of sight nothing is known; in some of these the innermost cell is all but unknown.
    for line in (0..rows * lanes).step_by(3) {
        (0..depths).for_each(|depth| occupied[depth * rows * lanes + line] = 0.5);
        occupied[line] = [0.5, 0.4995, 0.502][line % 9 / 3];
    }
    let inputs = Inputs::new()
        .grid("Grid", &space)
        .number("eta", 0.001)
        .array("map.P(O | C)", &occupied)
        .array("map.H", &entropy);
    let truth = by_kernel(&gaze::model(), "look", &inputs);
    let mut found = gaze::look::Answer::default();
    let given = gaze::look(&space).eta(0.001).map_p_o_c(&occupied).map_h(&entropy);
    given.run_into(&mut found).unwrap();
    assert_same("look", &truth[0], found.scores());
    // The same by hand: walk each direction outwards, then Eq. 6 at the last close-to-empty cell.
    let at = |depth: usize, row: usize, lane: usize| (depth * rows + row) * lanes + lane;
    let mut scores = vec![0.0; cells];
    for row in 0..rows {
        for lane in 0..lanes {
            let empty = (0..depths).take_while(|depth| occupied[at(*depth, row, lane)] < 0.499).last();
            // A14: the gap is empty and certain, so that an innermost cell of which nothing is known is a frontier.
            let unknown = empty.is_none() && (occupied[at(0, row, lane)] - 0.5).abs() <= 0.001;
            let Some(depth) = empty.or(unknown.then_some(0)) else { continue };
            let here = entropy[at(depth, row, lane)];
            let nearer = here - if depth > 0 { entropy[at(depth - 1, row, lane)] } else { 0.0 };
            let left = here - entropy[at(depth, row, (lane + lanes - 1) % lanes)];
            let below = if row > 0 { here - entropy[at(depth, row - 1, lane)] } else { 0.0 };
            let norm = (nearer * nearer + left * left + below * below).sqrt();
            scores[at(depth, row, lane)] = (1.0 - occupied[at(depth, row, lane)]) * norm;
        }
    }
    assert_same("by hand", &scores, &truth[0]);
    assert_eq!(argmax(&scores, None), argmax(found.scores(), None));
}

#[test]
fn the_view_agrees() {
    let gain = Numbers(5).take(777);
    let inputs = Inputs::new().size("Directions", gain.len()).array("gain", &gain);
    let truth = by_kernel(&view::model(), "look", &inputs);
    let mut found = view::look::Answer::default();
    view::look().directions(gain.len()).gain(&gain).run_into(&mut found).unwrap();
    assert_same("look", &truth[0], found.scores());
    assert_same("weights are the gains", &gain, &truth[0]);
}

#[test]
fn threads_change_no_bit_of_an_emitted_answer() {
    // Rows enough for pieces of another size by 2 threads and by 8.
    let space = Space::new([8, 60, 130], [Edge::Open, Edge::Pole, Edge::Circle]).unwrap();
    let moves = space.antecedents(&VELOCITIES);
    let (cells, mut numbers) = (space.cells(), Numbers(9));
    let single = |values: Vec<f64>| values.into_iter().map(|x| x as f32).collect::<Vec<f32>>();
    let (previous_o, previous_v) = (single(numbers.take(2 * cells)), single(numbers.take(7 * cells)));
    let readings = single(numbers.take(2 * cells));
    let given = cell::observe(&space, &moves)
        .sensors(1)
        .epsilon(0.02)
        .motion(&[0.4, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1])
        .previous_o(&previous_o)
        .previous_v(&previous_v)
        .sensors_i_reading(&readings);
    let [one, two, eight] = [1, 2, 8].map(|threads| {
        let mut found = cell::observe::Answer::default();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| given.run_into(&mut found)).unwrap();
        let all =
            [found.distribution_o(), found.distribution_v(), found.entropy_o_v(), found.entropy_o()].concat();
        all.into_iter().map(f32::to_bits).collect::<Vec<u32>>()
    });
    assert!(one.len() == 11 * cells && one == two && one == eight);
}

#[test]
fn rows_narrower_than_a_tile_agree() {
    // Four rows of six cells: every tile is a part, and poles and the circle turn within it.
    let space = Space::new([3, 4, 6], [Edge::Open, Edge::Pole, Edge::Circle]).unwrap();
    let moves = space.antecedents(&VELOCITIES);
    let (cells, mut numbers) = (space.cells(), Numbers(11));
    let (previous_o, previous_v) = (numbers.take(2 * cells), numbers.take(7 * cells));
    let readings = numbers.take(2 * cells);
    let motion = [0.4, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1];
    let inputs = Inputs::new()
        .grid("Grid", &space)
        .displacements("Velocity", &moves)
        .size("Sensors", 1)
        .number("epsilon", 0.02)
        .array("motion", &motion)
        .array("previous O", &previous_o)
        .array("previous V", &previous_v)
        .array("Sensors[i].reading", &readings);
    let truth = by_kernel(&cell::model(), "step", &inputs);
    let mut found = cell::step::Answer::default();
    let given = cell::step(&space, &moves)
        .sensors(1)
        .epsilon(0.02)
        .motion(&motion)
        .previous_o(&previous_o)
        .previous_v(&previous_v)
        .sensors_i_reading(&readings);
    given.run_into(&mut found).unwrap();
    truth
        .iter()
        .zip([found.distribution_o(), found.distribution_v()])
        .for_each(|(truth, found)| assert_same("step", truth, found));
}
