//! A map in the axes of the head, moved when the head turns.

use bvm::grid::{Grid, GridConfiguration};
use bvm::map::{Map, shift};
use bvm::vestibular::rotation;

/// A map with one wall, after two looks: every number of its state differs from its start.
fn map() -> Map {
    let configuration = GridConfiguration {
        cells_rho: 3,
        rho_min_m: 1.0,
        rho_max_m: 4.0,
        azimuth_cells: 36,
        elevation_cells: 18,
    };
    let mut map = Map::new(Grid::new(configuration).unwrap()).unwrap();
    let cells = map.grid().cells();
    let wall = |at: usize| if at % 36 > 20 && at % 36 < 27 { 0.9 } else { 0.2 };
    let likelihood: Vec<f32> =
        (0..2 * cells).map(|at| if at < cells { 0.5 } else { wall(at - cells) }).collect();
    (0..2).for_each(|_| map.observe(&[&likelihood]).unwrap());
    map
}

fn numbers(map: &Map) -> Vec<u32> {
    let all = [map.occupancy(), map.velocity(), map.entropy(), map.occupancy_entropy()];
    all.into_iter().flatten().map(|number| number.to_bits()).collect()
}

#[test]
fn a_whole_turn_gives_the_map_back_to_the_bit() {
    let mut turned = map();
    let before = numbers(&turned);
    let mut columns = shift::Columns::default();
    for part in 0..50 {
        let whole = columns.turn(turned.grid(), std::f64::consts::TAU / 50.0);
        let from: Vec<_> = shift::by_columns(turned.grid(), whole).into_iter().map(Some).collect();
        turned.shift(&from);
        assert!(part != 24 || numbers(&turned) != before, "half a turn is none");
    }
    assert!(numbers(&turned) == before);
}

#[test]
fn a_column_moves_to_the_right_when_the_head_turns_to_the_left() {
    let before = map();
    let mut turned = before.clone();
    let from: Vec<_> = shift::by_columns(before.grid(), 1).into_iter().map(Some).collect();
    turned.shift(&from);
    for at in 0..before.grid().cells() {
        let (row, column) = (at / 36, at % 36);
        assert_eq!(turned.occupancy()[at], before.occupancy()[row * 36 + (column + 1) % 36]);
    }
    // What passes a pole is unknown in the form of the paper.
    turned.shift(&shift::paper(before.grid(), 0, 2));
    let lost = turned.grid().directions() - 1;
    assert_eq!(turned.occupancy()[lost], 0.5);
    assert_eq!(turned.occupancy_entropy()[lost], 2f32.ln());
}

#[test]
fn rotations_keep_the_occupied_solid_angle_of_the_map() {
    let before = map();
    let mut turned = before.clone();
    let about = rotation::matrix(rotation::from_vector([0.3, -0.5, 1.0]));
    turned.resample(&shift::Resampling::of(before.grid(), &about));
    let solid = shift::solid_angles(before.grid());
    let mass = |map: &Map| {
        map.occupancy().iter().enumerate().map(|(at, p)| f64::from(*p) * solid[at % solid.len()]).sum::<f64>()
    };
    assert!((mass(&turned) / mass(&before) - 1.0).abs() < 1e-6);
    assert!(numbers(&turned) != numbers(&before));
    // The velocities of a cell still sum to 1.
    let cells = turned.grid().cells();
    let sum = |cell: usize| turned.velocity().iter().skip(cell).step_by(cells).sum::<f32>();
    assert!((0..cells).all(|cell| (sum(cell) - 1.0).abs() < 1e-5));
}
