//! Tests of pictures: colours, reductions by hand, pixels in their places, files complete or absent.

use super::*;
use crate::grid::{Cell, Grid, GridConfiguration};

fn small() -> Grid {
    let configuration = GridConfiguration {
        cells_rho: 3,
        rho_min_m: 1.0,
        rho_max_m: 8.0,
        azimuth_cells: 8,
        elevation_cells: 4,
    };
    Grid::new(configuration).unwrap()
}

#[test]
fn occupancy_is_white_grey_black_and_lightness_is_monotone() {
    assert_eq!(ColourMap::Occupancy.colour(0.0), [255, 255, 255]);
    assert_eq!(ColourMap::Occupancy.colour(-3.0), [255, 255, 255]);
    let lightness = |map: ColourMap, value: f64| {
        let [red, green, blue] = map.colour(value).map(f64::from);
        0.2126 * red + 0.7152 * green + 0.0722 * blue
    };
    for i in 0..100 {
        let (value, next) = (f64::from(i) / 100.0, f64::from(i + 1) / 100.0);
        assert!(lightness(ColourMap::Sequential, next) > lightness(ColourMap::Sequential, value));
        assert!(lightness(ColourMap::Occupancy, next) < lightness(ColourMap::Occupancy, value));
    }
    assert_ne!(ColourMap::Occupancy.colour(f64::NAN), ColourMap::Occupancy.colour(0.5));
}

#[test]
fn reductions_by_hand() {
    let grid = small();
    let mut occupancy = vec![0.1_f32; grid.cells()];
    let hit = Cell { rho: 1, elevation: 2, azimuth: 5 };
    occupancy[grid.index(hit)] = 0.9;
    occupancy[grid.index(Cell { rho: 2, ..hit })] = 0.5;
    let ray = grid.direction_index(hit.direction());
    let range = first_occupied_range(&grid, &occupancy, 0.01).unwrap();
    assert!((range[ray] - 8.0_f64.sqrt()).abs() < 1e-12, "edges are 1, 2, 4, 8 m");
    assert_eq!(range.iter().filter(|range| range.is_finite()).count(), 1);
    assert!((mean(&grid, &occupancy).unwrap()[ray] - 0.5).abs() < 1e-6);
    let slice = slice_around_horizon(&grid, &occupancy, 0.1).unwrap();
    assert_eq!(slice.len(), 24);
    assert!((slice[8 + 5] - 0.9).abs() < 1e-6, "row 2 starts at the horizon");
    assert!((slice[16 + 5] - 0.3).abs() < 1e-6, "unknown and empty: their mean");
    let error = mean(&grid, &occupancy[1..]).unwrap_err().to_string();
    assert_eq!(error, "`values` has 95 values, expected 96");
}

#[test]
fn left_is_left_and_up_is_up() {
    let grid = small();
    let mut values = vec![0.0; grid.directions()];
    values[grid.direction_index(grid.direction_of(1.0, 1.0).unwrap())] = 1.0;
    let what = Panorama {
        title: "one direction",
        quantity: "occupancy",
        values: &values,
        colours: ColourMap::Occupancy,
        limits: Some([0.0, 1.0]),
        window: Window::default(),
        gaze_path: &[],
    };
    let picture = panorama(&grid, &what).unwrap();
    let (width, _) = picture.size();
    let pixel = |azimuth: f64, elevation: f64| {
        let (x, y) = (90.0 + 3.0 * (180.0 - azimuth), 50.0 + 3.0 * (90.0 - elevation));
        let at = 3 * (y as usize * width as usize + x as usize);
        [picture.pixels()[at], picture.pixels()[at + 1], picture.pixels()[at + 2]]
    };
    assert_eq!(pixel(57.0, 57.0), ColourMap::Occupancy.colour(1.0));
    for (azimuth, elevation) in [(-57.0, 57.0), (57.0, -57.0), (100.0, 57.0), (57.0, 40.0)] {
        assert_eq!(pixel(azimuth, elevation), [255, 255, 255]);
    }
    let wrong = Panorama { values: &values[1..], ..what.clone() };
    assert!(panorama(&grid, &wrong).is_err());
    for azimuth_degrees in [[10.0, 10.0], [f64::NAN, 10.0], [200.0, 0.0], [-10.0, 10.0]] {
        let window = Window { azimuth_degrees, ..Window::default() };
        let message = panorama(&grid, &Panorama { window, ..what.clone() }).err().unwrap().to_string();
        assert!(message.contains("`occupancy`") && message.contains("window"), "{message}");
    }
}

#[test]
fn the_top_view_has_ahead_on_top() {
    let grid = small();
    let mut occupancy = vec![0.0_f32; grid.cells()];
    for rho in 0..3 {
        for elevation in 0..4 {
            for azimuth in [4, 5] {
                occupancy[grid.index(Cell { rho, elevation, azimuth })] = 1.0;
            }
        }
    }
    let what = TopView { occupancy: &occupancy, truth: None, heading: 0.0, field: 0.0, band: 0.2 };
    let picture = top_view(&grid, &what).unwrap();
    let (width, _) = picture.size();
    let pixel = |x: f64, y: f64| {
        let scale = 540.0 / (2.0 * 1.04 * 8.0);
        let (column, row) = (95.0 + 270.0 - scale * y, 50.0 + 270.0 - scale * x);
        picture.pixels()[3 * (row as usize * width as usize + column as usize)]
    };
    assert!(pixel(3.0, 3.0) < 40, "azimuth 0 to 90 degrees is ahead and to the left");
    assert_eq!([pixel(-3.0, 3.0), pixel(3.0, -3.0), pixel(-3.0, -3.0)], [255; 3]);
}

#[test]
fn curves_that_cannot_be_normalised_are_refused() {
    let series = |values: &[f64]| Series { name: "random gaze".into(), values: values.to_vec(), band: None };
    let refused = |series: Series| entropy_curves("", &[series]).err().unwrap().to_string();
    assert!(refused(series(&[])).contains("`random gaze`"));
    assert!(refused(series(&[0.0, 1.0])).contains("above zero"));
    assert!(refused(series(&[1.0, f64::NAN])).contains("not finite"));
    let band = Some((vec![1.0], vec![1.0, 1.0]));
    assert!(refused(Series { band, ..series(&[2.0, 1.0]) }).contains("lower bound of random gaze"));
    assert!(entropy_curves("one point", &[series(&[3.0])]).is_ok());
    assert!(entropy_curves("none", &[]).is_ok());
}

#[test]
fn files_are_whole_or_absent() {
    let folder = tempfile::tempdir().unwrap();
    let picture = entropy_curves("", &[]).unwrap();
    let path = folder.path().join("curves.png");
    picture.write(&path).unwrap();
    let decoder = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(&path).unwrap()));
    assert_eq!(decoder.read_info().unwrap().info().size(), picture.size());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "nothing else is left behind");
    let missing = folder.path().join("missing").join("curves.png");
    let error = picture.write(&missing).unwrap_err().to_string();
    assert!(error.contains("missing") && error.contains("curves.png"), "{error}");
    std::fs::create_dir(folder.path().join("taken.png")).unwrap();
    assert!(picture.write(&folder.path().join("taken.png")).is_err());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
}

#[test]
fn pictures_compose() {
    let picture = entropy_curves("", &[]).unwrap();
    let (width, height) = picture.size();
    assert_eq!(Picture::side_by_side(&[picture.clone(), picture.clone()]).size(), (2 * width, height));
    assert_eq!(Picture::stacked(&[picture.clone(), picture]).size(), (width, 2 * height));
}

#[test]
fn ticks_are_round() {
    let found = super::frame::ticks([0.0, 1.0]);
    assert!(
        found.iter().zip([0.0, 0.2, 0.4, 0.6, 0.8, 1.0]).all(|(tick, round)| (tick - round).abs() < 1e-12)
    );
    assert_eq!(super::frame::ticks([6.24, -6.24]), [-6.0, -4.0, -2.0, 0.0, 2.0, 4.0, 6.0]);
    assert_eq!(super::frame::ticks([2.0, 2.0]), [2.0]);
}
