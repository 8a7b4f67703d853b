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

/// A map whose probabilities are those of a wall that fades over 0.6 m, 3 m ahead.
fn wall_ahead(mut map: Map) -> Map {
    let grid = map.grid().clone();
    let cells = grid.cells();
    let mut numbers = map.numbers();
    for at in 0..cells {
        let p = wall_at(grid.centre(grid.cell(at).unwrap()).to_cartesian());
        (numbers[at], numbers[cells + at]) = ((1.0 - p) as f32, p as f32);
    }
    map = map.with_numbers(&numbers).unwrap();
    map
}

fn wall_at([x, _, _]: [f64; 3]) -> f64 {
    0.1 + 0.8 * (-((x - 3.0) / 0.6).powi(2)).exp()
}

/// Of the cells whose content was in the grid: mean and largest error of P(O = 1) beside the wall itself, and the occupied volume
/// beside that of the wall.
fn errors_of(map: &Map, place: [f64; 3], known: impl Fn([f64; 3]) -> bool) -> [f64; 3] {
    let grid = map.grid();
    let solid = shift::solid_angles(grid);
    let [mut sum, mut largest, mut count, mut own, mut right] = [0.0f64; 5];
    for at in 0..grid.cells() {
        let cell = grid.cell(at).unwrap();
        let centre = grid.centre(cell).to_cartesian();
        if !known(centre) {
            continue;
        }
        let here: [f64; 3] = std::array::from_fn(|axis| centre[axis] + place[axis]);
        let (p, expected) = (f64::from(map.occupancy()[at]), wall_at(here));
        let [near, far] = [grid.edges_m()[cell.rho], grid.edges_m()[cell.rho + 1]];
        let volume = solid[at % solid.len()] * (far.powi(3) - near.powi(3));
        (sum, largest, count) = (sum + (p - expected).abs(), largest.max((p - expected).abs()), count + 1.0);
        (own, right) = (own + volume * p, right + volume * expected);
    }
    [sum / count, largest, own / right - 1.0]
}

#[test]
fn a_map_follows_a_head_that_goes_ahead() {
    let configuration = GridConfiguration {
        cells_rho: 16,
        rho_min_m: 0.8,
        rho_max_m: 8.0,
        azimuth_cells: 120,
        elevation_cells: 60,
    };
    let grid = Grid::new(configuration).unwrap();
    let mut map = wall_ahead(Map::new(grid.clone()).unwrap());
    let length = |point: [f64; 3]| point.iter().map(|part| part * part).sum::<f64>().sqrt();
    let step = [0.25, -0.1, 0.05];
    let was_inside = |place: [f64; 3]| {
        move |centre: [f64; 3]| {
            let before: [f64; 3] = std::array::from_fn(|axis| centre[axis] + place[axis]);
            (0.8..8.0).contains(&length(before))
        }
    };
    let before = errors_of(&map, [0.0; 3], |_| true);
    assert!(before[1] < 1e-6);
    map.translate(step);
    let [mean, largest, volume] = errors_of(&map, step, was_inside(step));
    println!("one move: mean {mean:.4}, largest {largest:.3}, volume {volume:.4}");
    // Linear interpolation between points that are h apart is off by at most h² |f''| / 8; |f''| is at most 1.6 / 0.36 here. At
    // the wall, seen at up to 8 m, shells are 15.5 % wide and columns and rows 3°.
    let bound = |h: f64| h * h * (1.6 / 0.36) / 8.0;
    let reach = 3.0 + 1.5;
    let shell = (grid.base() - 1.0) * reach;
    assert!(largest < bound(shell) + 2.0 * bound(reach * 3f64.to_radians()) + 1e-6, "{largest}");
    assert!(mean < 0.02 && volume.abs() < 0.05, "{mean} {volume}");
    // What was outside is unknown.
    let outside =
        (0..grid.cells()).find(|at| !was_inside(step)(grid.centre(grid.cell(*at).unwrap()).to_cartesian()));
    assert_eq!(map.occupancy()[outside.unwrap()], 0.5);
    // There and back again: smoothed twice.
    map.translate(step.map(|part| -part));
    let inside = |centre: [f64; 3]| (1.2..7.0).contains(&length(centre));
    let [mean, largest, volume] = errors_of(&map, [0.0; 3], inside);
    println!("there and back: mean {mean:.4}, largest {largest:.3}, volume {volume:.4}");
    assert!(mean < 0.03 && volume.abs() < 0.05, "{mean} {largest} {volume}");
    // The velocities of a cell still sum to 1, also where O and V are carried together.
    let mut joint = wall_ahead(Map::with_joint(grid).unwrap());
    joint.translate(step);
    let cells = joint.grid().cells();
    let sum = |cell: usize| joint.velocity().iter().skip(cell).step_by(cells).sum::<f32>();
    assert!((0..cells).step_by(97).all(|cell| (sum(cell) - 1.0).abs() < 1e-5));
    joint.observe(&[]).unwrap();
    assert!(joint.occupancy().iter().all(|p| (0.0..=1.0).contains(p)));
}
