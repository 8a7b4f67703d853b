//! The map and its program: the published step by hand, and finite numbers in all cases.
//!
//! In: `models/cell.bp` as it is compiled into the crate. Out: P(O), P(V), entropies. Invariant: for any possible
//! readings, every number is finite, and probabilities sum to one.

use bp_core::compiler::exec::scalar::Scalar;
use bp_core::compiler::space::{Edge, Space};
use bvm::grid::{Grid, GridConfiguration};
use bvm::map::Map;
use bvm::programs::cell;
use rand::RngExt;

/// One step of the hand-checkable map; likelihoods of empty and occupied.
fn step<T: Scalar>(empty: f64, occupied: f64) -> cell::observe::Answer<T> {
    let space = Space::new([5, 1, 1], [Edge::Open; 3]).unwrap();
    let moves = space.antecedents(&[[-1, 0, 0], [0, 0, 0], [1, 0, 0]]);
    let numbers = |values: Vec<f64>| values.into_iter().map(T::from_f64).collect::<Vec<T>>();
    let before = [0.5, 0.5, 0.9, 0.2, 0.5];
    let third = 1.0 / 3.0;
    let velocity = [0.1, 0.2, 0.7].map(|p| [third, third, p, third, third]).concat();
    cell::observe(&space, &moves)
        .sensors(1)
        .epsilon(0.1)
        .motion(&numbers(vec![third; 3]))
        .previous_o(&numbers(before.iter().map(|p| 1.0 - p).chain(before).collect()))
        .previous_v(&numbers(velocity))
        .sensors_i_reading(&numbers([[empty; 5], [occupied; 5]].concat()))
        .ask()
        .unwrap()
}

fn check_hand_step<T: Scalar>(tolerance: f64) {
    let near = |found: T, expected: f64| {
        let found = found.to_f64();
        assert!((found - expected).abs() <= tolerance, "{found}, expected {expected}");
    };
    // The reference numbers cells from 0.
    let predicted = step::<T>(1.0, 1.0);
    near(predicted.p_o(true)[3], 0.605_365_853_658_536_6);
    near(predicted.p_o(true)[2], 0.481_538_461_538_461_6);
    let estimated = step::<T>(0.2, 0.8);
    near(estimated.p_o(true)[3], 0.859_864_888_272_994_9);
    near(estimated.p_o(true)[2], 0.787_916_928_886_091_9);
    near(estimated.entropy_o_v()[3], 1.252_654_579_044_064_4);
    near(estimated.entropy_o_v()[2], 1.542_650_322_626_241_8);
    let velocities = [0.216_525_2, 0.154_165_94, 0.629_308_85];
    for (v, expected) in velocities.into_iter().enumerate() {
        // Published to eight digits.
        let found = estimated.p_v(v)[3].to_f64();
        assert!((found - expected).abs() <= tolerance.max(1e-8), "{found}, expected {expected}");
    }
}

#[test]
fn the_hand_checkable_step_in_both_precisions() {
    check_hand_step::<f64>(1e-9);
    check_hand_step::<f32>(1e-6);
}

#[track_caller]
fn is_sound(map: &Map, when: &str) {
    let cells = map.grid().cells();
    let most = (14f32).ln() * 1.000_01;
    for (name, values) in [("H(O V)", map.entropy()), ("H(O)", map.occupancy_entropy())] {
        assert_eq!(values.len(), cells);
        let wrong = values.iter().find(|value| !(-1e-5..=most).contains(*value));
        assert!(wrong.is_none(), "{when}: {name} is {wrong:?}");
    }
    let possible = |values: &[f32]| values.iter().all(|p| (0.0..=1.000_01).contains(p));
    assert!(possible(map.occupancy()) && possible(map.velocity()), "{when}: a probability is outside [0, 1]");
    for cell in 0..cells {
        let sum: f32 = map.velocity().chunks_exact(cells).map(|plane| plane[cell]).sum();
        assert!((sum - 1.0).abs() < 1e-5, "{when}: P(V) of cell {cell} sums to {sum}");
    }
}

#[test]
fn figures_stay_figures() {
    let grid = Grid::new(GridConfiguration {
        cells_rho: 5,
        rho_min_m: 0.5,
        rho_max_m: 3.0,
        azimuth_cells: 12,
        elevation_cells: 6,
    })
    .unwrap();
    let mut random = bvm::world::seeded(5, "map");
    let cells = grid.cells();
    let mut map = Map::new(grid).unwrap();
    is_sound(&map, "before the first step");
    for step in 0..60 {
        // Ordinary numbers, zeros, subnormals, and densities far above one; never impossible in both states.
        let mut likelihood = vec![1.0f32; 2 * cells];
        for cell in 0..cells {
            let mut number = || match random.random_range(0..6) {
                0 => 0.0,
                1 => 1e-40 * (1.0 + random.random::<f32>()),
                2 => 1e20 * (1.0 + random.random::<f32>()),
                _ => random.random::<f32>(),
            };
            let (empty, occupied) = (number(), number());
            likelihood[cell] = if empty == 0.0 && occupied == 0.0 { 1.0 } else { empty };
            likelihood[cells + cell] = occupied;
        }
        map.observe(&[&likelihood]).unwrap();
        is_sound(&map, &format!("after step {step}"));
    }
    for step in 0..5 {
        map.observe(&[]).unwrap();
        is_sound(&map, &format!("{step} steps in the dark"));
    }
    assert!(map.observe(&[&vec![1.0; cells]]).is_err(), "a likelihood of the wrong length is refused");
}

#[test]
fn sensors_that_contradict_one_another_leave_figures() {
    let grid = Grid::new(GridConfiguration::default_exploration()).unwrap();
    let cells = grid.cells();
    let likelihood = |empty: f32, occupied: f32| [vec![empty; cells], vec![occupied; cells]].concat();
    for (first, second) in [
        (likelihood(1.0, 0.0), likelihood(0.0, 1.0)),
        (likelihood(1e-30, 1e-32), likelihood(1e-30, 1e-32)),
        (likelihood(1e30, 1e30), likelihood(1e30, 1e32)),
    ] {
        let mut map = Map::new(grid.clone()).unwrap();
        map.observe(&[&first, &second]).unwrap();
        is_sound(&map, "contradiction");
        map.observe(&[]).unwrap();
        is_sound(&map, "after it");
    }
}
