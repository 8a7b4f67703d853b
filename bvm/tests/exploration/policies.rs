//! Gaze policies on maps whose best gaze is known.
//!
//! In: maps seen in part. Out: gazes. Invariant: what each policy should prefer follows from its definition.

use bvm::error::Error;
use bvm::exploration::{Gazer, PolicyKind};
use bvm::frame::{great_circle, wrap_angle};
use bvm::grid::{Grid, GridConfiguration};
use bvm::head::depth::MOST_TILT;
use bvm::head::{Attitude, Coverage, Gaze, Neck, Policy, Turned};
use bvm::map::{Heading, Likelihood, Map};
use bvm::programs::readable;
use bvm::world::sensors::DepthCamera;

fn grid() -> Grid {
    Grid::new(GridConfiguration::default_exploration()).unwrap()
}

fn gazer(kind: PolicyKind, grid: &Grid) -> Gazer {
    Gazer::new(kind, &DepthCamera::default(), grid, MOST_TILT, 1)
}

/// A map after observations that say of each direction where its first surface is (a depth), or nothing.
fn seen(first: impl Fn((f64, f64)) -> Option<usize>) -> Map {
    let grid = grid();
    let (cells, directions) = (grid.cells(), grid.directions());
    let mut likelihood: Likelihood = vec![1.0; 2 * cells];
    for (at, direction) in grid.all_directions().enumerate() {
        let Some(first) = first(grid.direction_centre(direction)) else { continue };
        for rho in 0..=first {
            let index = rho * directions + at;
            likelihood[if rho == first { index } else { cells + index }] = 1e-4;
        }
    }
    let mut map = Map::new(grid).unwrap();
    map.observe(&[&likelihood]).unwrap();
    map
}

#[test]
fn every_policy_has_a_name_and_gives_gazes_within_the_neck() {
    let map = seen(|(azimuth, _)| (azimuth > 0.0).then_some(9));
    for kind in PolicyKind::ALL {
        assert_eq!(PolicyKind::of_name(kind.name()), Some(kind));
        let mut gazer = gazer(kind, map.grid());
        let mut heading = Heading::default();
        for _ in 0..6 {
            let gaze = gazer.choose(&map, &heading).unwrap();
            assert!(gaze.azimuth.is_finite() && gaze.elevation.abs() <= 1.1, "{kind:?}: {gaze:?}");
            gazer.turned(&gaze);
            heading.yaw = gaze.azimuth;
        }
    }
    assert_eq!(PolicyKind::of_name("entropy"), None);
}

#[test]
fn policies_that_use_the_map_look_where_nothing_is_known() {
    // Known but for the right side.
    let is_unknown = |azimuth: f64| (-2.4..-0.8).contains(&azimuth);
    let map = seen(|(azimuth, _)| (!is_unknown(azimuth)).then_some(9));
    for kind in [PolicyKind::Inhibited, PolicyKind::View, PolicyKind::InformationGain] {
        let gaze = gazer(kind, map.grid()).choose(&map, &Heading::default()).unwrap();
        assert!(is_unknown(gaze.azimuth), "{kind:?}: {gaze:?}");
        // The 80° of the camera fit into the 92° of the unknown, wherever the sum is largest.
        assert!(great_circle((gaze.azimuth, 0.0), (-1.6, 0.0)) < 0.4, "{kind:?}: {gaze:?}");
    }
}

#[test]
fn the_printed_rule_has_no_candidate_where_nothing_is_known() {
    let unknown = Map::new(grid()).unwrap();
    let heading = Heading { yaw: 0.7 };
    let gaze = gazer(PolicyKind::Paper, unknown.grid()).choose(&unknown, &heading).unwrap();
    assert_eq!((gaze.azimuth, gaze.elevation, gaze.score), (0.7, 0.0, 0.0), "straight ahead");
    // Where some of it is known, the choice is there, although the rest is unknown: why it stalls.
    let map = seen(|(azimuth, elevation)| (azimuth.abs() < 0.5 && elevation.abs() < 0.4).then_some(9));
    let gaze = gazer(PolicyKind::Paper, map.grid()).choose(&map, &heading).unwrap();
    assert!(gaze.azimuth.abs() < 0.5 && gaze.range_m.is_some(), "{gaze:?}");
    let cured = gazer(PolicyKind::Inhibited, map.grid()).choose(&map, &heading).unwrap();
    assert!(great_circle((cured.azimuth, cured.elevation), (0.0, 0.0)) > 0.7, "{cured:?}");
}

#[test]
fn without_a_map_the_null_policy_goes_around() {
    // It looks away from what it saw: the first gazes share no direction with the ones before.
    let map = Map::new(grid()).unwrap();
    let mut gazer = gazer(PolicyKind::Null, map.grid());
    let (mut heading, mut gazes) = (Heading::default(), vec![(0.0, 0.0)]);
    for _ in 0..4 {
        let gaze = gazer.choose(&map, &heading).unwrap();
        let nearest = gazes.iter().map(|seen| great_circle(*seen, (gaze.azimuth, gaze.elevation)));
        assert!(nearest.fold(f64::MAX, f64::min) > 55f64.to_radians(), "{gaze:?} after {gazes:?}");
        gazes.push((gaze.azimuth, gaze.elevation));
        gazer.turned(&gaze);
        heading.yaw = gaze.azimuth;
    }
}

#[test]
fn a_direction_that_gave_no_reading_is_left() {
    // Two looks without a reading, by hand: .9 · .03² + .05 · .75² = .028935 for the kinds that give readings, .05 · .99² =
    // .049005 for the one that gives none. Before any look .9 + .05.
    let question = readable::readable::<f64>().directions(2);
    let answer = question.readings(&[0.0, 0.0]).silent(&[2.0, 0.0]).ask().unwrap();
    assert!(
        (answer.p()[0] - 0.028935 / 0.07794).abs() < 1e-9 && (answer.p()[1] - 0.95).abs() < 1e-9,
        "{:?}",
        answer.p()
    );
    // The right side was in view five times, and gave nothing; the left side never was.
    let map = Map::new(grid()).unwrap();
    let mut coverage = Coverage::of(map.grid(), &Free);
    let is_right = |direction| (-2.4..-0.5).contains(&map.grid().direction_centre(direction).0);
    let view = map.grid().all_directions().map(|direction| is_right(direction).then_some(false)).collect();
    (0..5).for_each(|_| coverage.add(&view));
    let mut gazer = gazer(PolicyKind::Inhibited, map.grid());
    let mut heading = Heading { yaw: -0.2 };
    for _ in 0..3 {
        gazer.covered(&coverage);
        let gaze = gazer.choose(&map, &heading).unwrap();
        assert!(!(-2.2..-0.7).contains(&gaze.azimuth), "{gaze:?}");
        gazer.turned(&gaze);
        heading.yaw = gaze.azimuth;
    }
}

/// A neck without limits.
struct Free;

impl Neck for Free {
    fn turn(&mut self, gaze: Gaze, _: &Attitude) -> Result<Turned, Error> {
        Ok(Turned { gaze, seconds: 0.0, travel_rad: 0.0 })
    }

    fn reaches(&self, _: (f64, f64)) -> bool {
        true
    }

    fn time_s(&self) -> f64 {
        0.0
    }
}

#[test]
fn attention_turns_to_a_sound_and_leaves_what_it_saw() {
    let map = seen(|(azimuth, _)| (azimuth.abs() < 2.0).then_some(9));
    let (grid, cells) = (map.grid(), map.grid().cells());
    let there = grid.direction_index(grid.direction_of(1.2, 0.1).unwrap());
    let mut likelihood: Likelihood = vec![1.0; 2 * cells];
    (0..grid.cells_rho()).for_each(|rho| likelihood[cells + rho * grid.directions() + there] = 3.0);
    let mut gazer = gazer(PolicyKind::Attention, grid);
    gazer.sensed("hearing", &likelihood);
    // What is behind is unknown, and would be more uncertain; the sound is more salient.
    let gaze = gazer.choose(&map, &Heading { yaw: -1.2 }).unwrap();
    assert!(great_circle((gaze.azimuth, gaze.elevation), (1.2, 0.1)) < 0.1, "{gaze:?}");
    gazer.turned(&gaze);
    // After the look it has seen the place, and inhibition of return turns it away.
    let next = gazer.choose(&map, &Heading { yaw: gaze.azimuth }).unwrap();
    assert!(great_circle((next.azimuth, next.elevation), (1.2, 0.1)) > 0.5, "{next:?}");
}

#[test]
fn random_gazes_are_uniform_on_the_sphere_and_repeatable() {
    let map = Map::new(grid()).unwrap();
    let draw = |count: usize| {
        let mut gazer = gazer(PolicyKind::Random, map.grid());
        (0..count).map(|_| gazer.choose(&map, &Heading::default()).unwrap()).collect::<Vec<_>>()
    };
    let gazes = draw(600);
    assert_eq!(gazes[..20], draw(20)[..]);
    // Half of the sphere is within 30° of the horizon; a standard error is 2 %.
    let low = gazes.iter().filter(|gaze| gaze.elevation.abs() < 30f64.to_radians()).count();
    assert!((low as f64 / 600.0 - 0.5).abs() < 0.07, "{low}");
    let left = gazes.iter().filter(|gaze| wrap_angle(gaze.azimuth) > 0.0).count();
    assert!((left as f64 / 600.0 - 0.5).abs() < 0.07, "{left}");
}

#[test]
fn a_sweep_covers_the_sphere_in_fifteen_looks() {
    let map = Map::new(grid()).unwrap();
    let mut gazer = gazer(PolicyKind::Sweep, map.grid());
    let mut gazes = vec![(0.0, 0.0)];
    for _ in 0..15 {
        let gaze = gazer.choose(&map, &Heading::default()).unwrap();
        gazes.push((gaze.azimuth.to_degrees().round(), gaze.elevation.to_degrees().round()));
    }
    assert_eq!(gazes[..6], [(0., 0.), (80., 0.), (160., 0.), (240., 0.), (320., 0.), (0., 60.)]);
    assert_eq!((gazes[10], gazes[15]), ((0.0, -60.0), (0.0, 0.0)));
}
