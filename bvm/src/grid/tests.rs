//! Tests of the grid against calculations by hand: edges, intervals, wrap-around, poles, refusals; and properties over
//! random points.

use super::*;
use proptest::prelude::*;

fn personal() -> Grid {
    Grid::new(GridConfiguration::personal_space()).unwrap()
}

fn exploration() -> Grid {
    Grid::new(GridConfiguration::default_exploration()).unwrap()
}

fn at(rho_m: f64, azimuth_degrees: f64, elevation_degrees: f64) -> Spherical {
    Spherical { rho_m, azimuth: azimuth_degrees.to_radians(), elevation: elevation_degrees.to_radians() }
}

#[test]
fn radial_edges_of_the_follow_up_papers() {
    let grid = personal();
    assert_eq!(grid.cells(), 324_000);
    assert!((grid.base() - 1.095_958_2).abs() < 5e-8);
    let millimetres =
        [1000.0, 1096.0, 1201.1, 1316.4, 1442.7, 1581.1, 1732.9, 1899.1, 2081.4, 2281.1, 2500.0];
    for (edge, expected) in grid.edges_m().iter().zip(millimetres) {
        assert!((edge * 1000.0 - expected).abs() < 0.05, "{edge} m against {expected} mm");
    }
    assert_eq!(grid.log_coordinate(1.0), 0.0);
    assert!((grid.log_coordinate(2.5) - 10.0).abs() < 1e-12);
}

#[test]
fn a_cell_owns_its_far_edge() {
    let grid = personal();
    for k in 0..10 {
        assert_eq!(grid.rho_of(grid.edges_m()[k + 1]), Some(k));
        assert_eq!(grid.rho_of(grid.edges_m()[k] * (1.0 + 1e-12)), Some(k));
    }
    assert_eq!(grid.rho_of(1.0), Some(0), "u = 0 belongs to cell 1 of the paper");
    for outside in [0.999_999, 2.500_001, f64::NAN, f64::INFINITY, -1.0] {
        assert_eq!(grid.rho_of(outside), None);
    }
}

#[test]
fn azimuth_wraps_and_elevation_is_closed_below() {
    let grid = personal();
    let column = |degrees: f64| grid.direction_of(degrees.to_radians(), 0.0).unwrap().azimuth;
    assert_eq!(column(-179.5), 0);
    assert_eq!(column(180.0), 359);
    assert_eq!(column(-180.0), 359);
    assert_eq!(column(540.0), 359);
    assert_eq!(column(0.0), 179, "]-1; 0] is the 180th column");
    assert_eq!(column(0.5), 180);
    let row =
        |degrees: f64| grid.direction_of(0.0, degrees.to_radians()).map(|direction| direction.elevation);
    assert_eq!(row(-90.0), Some(0));
    assert_eq!(row(-88.0 + 1e-9), Some(1));
    assert_eq!(row(90.0), Some(89));
    assert_eq!(row(90.1), None);
    assert_eq!(grid.direction_of(f64::NAN, 0.0), None);
}

#[test]
fn centre_and_corners_by_hand() {
    let grid = personal();
    let cell = Cell { rho: 0, elevation: 45, azimuth: 180 };
    let centre = grid.centre(cell);
    assert!((centre.rho_m - 2.5_f64.powf(0.05)).abs() < 1e-12);
    assert!((centre.azimuth.to_degrees() - 0.5).abs() < 1e-12);
    assert!((centre.elevation.to_degrees() - 1.0).abs() < 1e-12);
    let far = grid.far_corner(cell);
    assert!((far.azimuth.to_degrees() - 1.0).abs() < 1e-12);
    assert!((far.elevation.to_degrees() - 2.0).abs() < 1e-12);
    let last = grid.far_corner(Cell { rho: 9, elevation: 89, azimuth: 359 });
    assert_eq!((last.rho_m, last.azimuth, last.elevation), (2.5, PI, FRAC_PI_2));
}

#[test]
fn columns_run_counter_clockwise() {
    let grid = exploration();
    let column = |point: [f64; 3]| grid.cell_of_point(point).unwrap().azimuth;
    // 4° each, from behind: ]-92; -88] on the right, ]-4; 0] ahead, ]88; 92] on the left.
    assert_eq!(column([0.0, -1.0, 0.0]), 22);
    assert_eq!(column([1.0, 0.0, 0.0]), 44);
    assert_eq!(column([0.0, 1.0, 0.0]), 67);
    assert_eq!(column([-1.0, 0.0, 0.0]), 89);
    let row = |point: [f64; 3]| grid.cell_of_point(point).unwrap().elevation;
    assert!(row([1.0, 0.0, -1.0]) < row([1.0, 0.0, 0.0]) && row([1.0, 0.0, 0.0]) < row([1.0, 0.0, 1.0]));
}

#[test]
fn neighbours_wrap_and_cross_the_poles() {
    let grid = personal();
    let top = Cell { rho: 3, elevation: 89, azimuth: 10 };
    assert_eq!(grid.neighbour(top, 0, 0, 1), Some(Cell { rho: 3, elevation: 89, azimuth: 190 }));
    assert_eq!(grid.neighbour(top, 0, -11, 2), Some(Cell { rho: 3, elevation: 88, azimuth: 179 }));
    let bottom = Cell { rho: 0, elevation: 0, azimuth: 200 };
    assert_eq!(grid.neighbour(bottom, 1, 0, -1), Some(Cell { rho: 1, elevation: 0, azimuth: 20 }));
    assert_eq!(grid.neighbour(bottom, -1, 0, 0), None);
    assert_eq!(grid.neighbour(Cell { rho: 9, ..bottom }, 1, 0, 0), None);
}

#[test]
fn refusals_name_the_key_and_the_value() {
    let good = GridConfiguration::personal_space();
    let cases = [
        (GridConfiguration { rho_min_m: 3.0, ..good }, ["rho_min_m", "3", "2.5"]),
        (GridConfiguration { rho_min_m: 2.5, ..good }, ["rho_min_m", "2.5", "no reach"]),
        (GridConfiguration { rho_min_m: 0.0, ..good }, ["rho_min_m", "0", "greater"]),
        (GridConfiguration { rho_max_m: f64::NAN, ..good }, ["rho_max_m", "NaN", "finite"]),
        (GridConfiguration { rho_max_m: f64::INFINITY, ..good }, ["rho_max_m", "inf", "finite"]),
        (GridConfiguration { cells_rho: 0, ..good }, ["cells_rho", "0", "at least one"]),
        (GridConfiguration { azimuth_cells: 0, ..good }, ["azimuth_cells", "0", "at least one"]),
        (GridConfiguration { azimuth_cells: 361, ..good }, ["azimuth_cells", "361", "even"]),
        (GridConfiguration { elevation_cells: 0, ..good }, ["elevation_cells", "0", "at least one"]),
        (GridConfiguration { cells_rho: usize::MAX, ..good }, ["cells_rho", "more than", "134217728"]),
        (GridConfiguration { rho_max_m: 1.0 + 4e-16, ..good }, ["cells_rho", "10", "too thin"]),
    ];
    for (configuration, fragments) in cases {
        let message = Grid::new(configuration).unwrap_err().to_string();
        for fragment in fragments {
            assert!(message.contains(fragment), "`{message}` should name `{fragment}`");
        }
    }
}

#[test]
fn storage_is_azimuth_first() {
    let grid = exploration();
    assert_eq!(grid.index(Cell { rho: 2, elevation: 3, azimuth: 4 }), (2 * 45 + 3) * 90 + 4);
    assert_eq!(grid.cell(grid.cells()), None);
    for index in 0..grid.cells() {
        assert_eq!(grid.index(grid.cell(index).unwrap()), index);
    }
}

proptest! {
    #[test]
    fn a_point_is_inside_its_cell(
        rho in 0.5_f64..=6.0, azimuth in -720.0_f64..720.0, elevation in -90.0_f64..=90.0,
    ) {
        let grid = exploration();
        let point = at(rho, azimuth, elevation);
        let cell = grid.cell_of(point).unwrap();
        let (near, far) = (grid.near_corner(cell), grid.far_corner(cell));
        let wrapped = wrap_angle(point.azimuth);
        prop_assert!((near.rho_m < rho || rho == 0.5) && rho <= far.rho_m);
        prop_assert!(near.azimuth < wrapped && wrapped <= far.azimuth);
        prop_assert!(near.elevation < point.elevation || elevation == -90.0);
        prop_assert!(point.elevation <= far.elevation);
    }

    #[test]
    fn a_cell_holds_its_centre_and_its_far_corner(index in 0_usize..64_800) {
        let grid = exploration();
        let cell = grid.cell(index).unwrap();
        prop_assert_eq!(grid.cell_of(grid.centre(cell)), Some(cell));
        prop_assert_eq!(grid.cell_of(grid.far_corner(cell)), Some(cell));
        prop_assert_eq!(grid.cell_of_point(grid.centre(cell).to_cartesian()), Some(cell));
    }

    #[test]
    fn cartesian_and_back(x in -5.0_f64..5.0, y in -5.0_f64..5.0, z in -5.0_f64..5.0) {
        let back = Spherical::from_cartesian([x, y, z]).to_cartesian();
        for (found, expected) in back.iter().zip([x, y, z]) {
            prop_assert!((found - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn neighbours_are_mutual(index in 0_usize..64_800, azimuth in -100_isize..100, rho in -3_isize..3) {
        let grid = exploration();
        let cell = grid.cell(index).unwrap();
        if let Some(other) = grid.neighbour(cell, rho, azimuth, 0) {
            prop_assert_eq!(grid.neighbour(other, -rho, -azimuth, 0), Some(cell));
        }
        let over = grid.neighbour(cell, 0, 0, 40).unwrap();
        let crossed = cell.elevation + 40 >= 45;
        prop_assert_eq!(grid.neighbour(over, 0, 0, if crossed { 40 } else { -40 }), Some(cell));
    }
}
