//! Tests of the world and its senses against geometry: hits computed by hand, labels, cues, and the size of the noise.

use super::sensors::*;
use super::*;
use crate::grid::{Grid, GridConfiguration};
use crate::map::Heading;
use std::f64::consts::{FRAC_PI_2, PI};

fn degrees(azimuth: f64, elevation: f64) -> (f64, f64) {
    (azimuth.to_radians(), elevation.to_radians())
}

fn bare() -> World {
    World { things: Vec::new(), room: [[-3.0, -3.0, -1.0], [4.0, 2.0, 1.5]], ..World::embedded(1) }
}

fn close(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found} against {expected}");
}

#[test]
fn walls_by_hand() {
    let mut world = bare();
    world.bodies[0].shape = Shape::Cylinder { axis: [0.0; 2], radius: 0.24, height: [-0.9, -0.8] };
    close(world.range(degrees(0.0, 0.0), 0.0), 4.0, 1e-12);
    close(world.range(degrees(-90.0, 0.0), 0.0), 3.0, 1e-12);
    close(world.range(degrees(180.0, 0.0), 0.0), 3.0, 1e-12);
    close(world.range(degrees(90.0, 0.0), 0.0), 2.0, 1e-12);
    close(world.range(degrees(0.0, 90.0), 0.0), 1.5, 1e-12);
    close(world.range(degrees(0.0, -30.0), 0.0), 2.0, 1e-12);
    close(world.range(degrees(-45.0, 0.0), 0.0), 3.0 * 2.0_f64.sqrt(), 1e-12);
    assert!(world.occupied([4.1, 0.0, 0.0], 0.0) && !world.occupied([3.9, 0.0, 0.0], 0.0));
}

#[test]
fn solids_by_hand() {
    let hit = |shape: Shape, azimuth: f64, elevation: f64| {
        let (azimuth, elevation) = degrees(azimuth, elevation);
        shape.first_hit(unit_vector(azimuth, elevation))
    };
    let block = Shape::Block { min: [2.0, -0.5, -0.5], max: [3.0, 0.5, 0.5] };
    close(hit(block, 0.0, 0.0).unwrap(), 2.0, 1e-12);
    assert_eq!(hit(block, 180.0, 0.0), None);
    assert_eq!(hit(block, 20.0, 0.0), None);
    let ball = Shape::Ball { centre: [5.0, 0.0, 0.0], radius: 3.0 };
    close(hit(ball, 0.0, 0.0).unwrap(), 2.0, 1e-12);
    close(hit(ball, 0.6_f64.asin().to_degrees(), 0.0).unwrap(), 4.0, 1e-6);
    let pole = Shape::Cylinder { axis: [2.0, 0.0], radius: 0.5, height: [-1.0, 0.0] };
    close(hit(pole, 0.0, -10.0).unwrap(), 1.5 / 10.0_f64.to_radians().cos(), 1e-12);
    assert_eq!(hit(pole, 0.0, 1.0), None);
    let lid = Shape::Cylinder { axis: [0.0, 0.0], radius: 0.5, height: [-2.0, -1.0] };
    close(hit(lid, 0.0, -90.0).unwrap(), 1.0, 1e-12);
}

#[test]
fn every_hit_is_where_the_solid_begins() {
    let grid = Grid::new(GridConfiguration::default_exploration()).unwrap();
    for seed in 0..8 {
        let world = World::embedded(seed);
        for time in [0.0, 3.7, 8.0] {
            for direction in grid.all_directions() {
                let direction = grid.direction_centre(direction);
                let range = world.range(direction, time);
                let at =
                    |rho_m| Spherical { rho_m, azimuth: direction.0, elevation: direction.1 }.to_cartesian();
                assert!(range > 0.6, "seed {seed}: something touches the head");
                assert!(world.occupied(at(range + 1e-6), time) && !world.occupied(at(range - 1e-6), time));
                assert!((1..100).all(|i| !world.occupied(at(range * f64::from(i) / 100.0), time)));
            }
        }
    }
}

#[test]
fn the_seed_decides_the_world_and_the_walker_walks() {
    assert_eq!(World::embedded(7), World::embedded(7));
    assert_ne!(World::embedded(7), World::embedded(8));
    let ends = [[1.8, 1.2], [3.3, -1.7]];
    let walker = Motion::Walk { ends, period_s: 16.0, phase: 0.0 };
    assert_eq!(walker.place(0.0).at, ends[0]);
    close(walker.place(8.0).at[0], 3.3, 1e-12);
    close(walker.place(4.0).at[1], -0.25, 1e-12);
    for seed in 0..50 {
        let world = World::embedded(seed);
        for time in 0..64 {
            let [x, y] = world.bodies[0].motion.place(f64::from(time) / 4.0).at;
            let body = |angle: f64| [x + 0.24 * angle.cos(), y + 0.24 * angle.sin()];
            let free = |[x, y]: [f64; 2]| {
                [-1.2, -0.4, 0.0, 0.4]
                    .iter()
                    .all(|&z| !world.things.iter().any(|thing| thing.shape.contains([x, y, z])))
            };
            assert!(
                (0..16).all(|i| free(body(f64::from(i) * PI / 8.0))),
                "seed {seed}: walks into furniture"
            );
        }
    }
}

#[test]
fn the_sound_comes_from_the_first_surface_towards_the_loudspeaker() {
    for seed in 0..50 {
        let world = World::embedded(seed);
        let source = world.source_from(&world.sources[0], 0.0, 0.0);
        close(world.range((source.azimuth, source.elevation), 0.0), source.rho_m - 0.01, 1e-9);
        close(world.source_from(&world.sources[0], 0.3, 0.0).azimuth, source.azimuth - 0.3, 1e-12);
    }
}

#[test]
fn the_left_of_the_room_is_seen_and_heard_on_the_left() {
    // The layout of the room: cupboard and armchair on the left, table and loudspeaker on the right.
    let world = World::embedded(1);
    let side = |name: &str| {
        let thing = world.things.iter().find(|thing| thing.name == name).unwrap();
        thing.shape.sounding_point()[1]
    };
    assert!(side("cupboard") > 1.9 && side("armchair") > 0.5, "left is positive");
    assert!(side("table") < -0.5 && side("loudspeaker") < -1.5, "right is negative");
    // The wall on the left is nearer than that on the right: 2.7 against 3.5 m, each to 0.2 m.
    let wall = |azimuth: f64| {
        let far = World { things: Vec::new(), ..world.clone() };
        far.range(degrees(azimuth, 20.0), 0.0) * 20f64.to_radians().cos()
    };
    assert!((wall(90.0) - 2.7).abs() <= 0.2 && (wall(-90.0) - 3.5).abs() <= 0.2);
    // The loudspeaker is on the right: the sound is later and weaker at the left ear. After a turn towards it the sound
    // is ahead.
    let source = world.source_from(&world.sources[0], 0.0, 0.0);
    let cues = cues_of(source);
    assert!(source.azimuth < 0.0 && cues.itd_s < -3e-4 && cues.ild_db.iter().all(|level| *level < 0.0));
    assert!(cues_of(world.source_from(&world.sources[0], source.azimuth, 0.0)).itd_s.abs() < 1e-12);
}

#[test]
fn truth_reads_free_then_surface_then_hidden() {
    let grid = Grid::new(GridConfiguration::default_exploration()).unwrap();
    let world = World::embedded(3);
    let first = world.truth_first_hit(&grid, 1.0);
    let state = world.truth_state(&grid, 1.0);
    let solid = world.truth_solid(&grid, 1.0);
    assert_eq!((first.len(), state.len(), solid.len()), (grid.directions(), grid.cells(), grid.cells()));
    let mut beyond = 0;
    for (ray, hit) in first.iter().enumerate() {
        let labels: Vec<CellTruth> = (0..16).map(|rho| state[rho * grid.directions() + ray]).collect();
        for (rho, label) in labels.into_iter().enumerate() {
            let expected = match hit.map(|hit| rho.cmp(&hit)) {
                None | Some(std::cmp::Ordering::Less) => CellTruth::Free,
                Some(std::cmp::Ordering::Equal) => CellTruth::Surface,
                Some(std::cmp::Ordering::Greater) => CellTruth::Hidden,
            };
            assert_eq!(label, expected);
            assert!(label != CellTruth::Free || !solid[rho * grid.directions() + ray]);
        }
        beyond += usize::from(hit.is_none());
    }
    assert!(beyond < grid.directions() / 10, "{beyond} lines of sight leave the grid");
}

#[test]
fn lines_that_end_where_nothing_is_read_are_hidden() {
    let grid = Grid::new(GridConfiguration::default_exploration()).unwrap();
    let hidden = |walls: Surface| {
        let world = World { walls, things: Vec::new(), bodies: Vec::new(), ..World::embedded(3) };
        let state = world.truth_state(&grid, 0.0);
        state.iter().filter(|state| **state == CellTruth::Hidden).count()
    };
    let black = Surface { albedo: 0.01, contrast: 0.0, transparent: false };
    assert_eq!(hidden(black), grid.cells());
    assert!(hidden(Surface::default()) < grid.cells() / 2);
}

#[test]
fn the_field_of_view_is_a_pyramid_that_pitches() {
    let camera = DepthCamera::default();
    let sees = |azimuth, elevation, pitch: f64| {
        camera.sees(degrees(azimuth, elevation), pitch.to_radians()).is_some()
    };
    assert!(sees(40.0, 0.0, 0.0) && !sees(40.1, 0.0, 0.0) && !sees(180.0, 0.0, 0.0));
    assert!(sees(0.0, 30.0, 0.0) && !sees(0.0, 30.1, 0.0));
    assert!(sees(0.0, 50.0, 20.0) && !sees(0.0, -10.1, 20.0) && sees(0.0, -9.9, 20.0));
    assert!(sees(180.0, 80.0, 70.0), "pitched up, it sees over its own head");
    close(camera.sees(degrees(30.0, 0.0), 0.0).unwrap(), 0.75_f64.sqrt(), 1e-12);
}

#[test]
fn depth_errors_grow_as_stereo_errors_do() {
    let camera = DepthCamera::default();
    close(camera.sigma_m(4.0, 1.0), 16.0 * 0.25 / 60.0, 1e-12);
    close(camera.sigma_m(4.0, 0.5), 4.0 * 0.25 / 60.0 / 0.5, 1e-12);
    assert_eq!(camera.sigma_m(0.5, 1.0), 0.01);
    let grid =
        Grid::new(GridConfiguration { rho_max_m: 3.0, ..GridConfiguration::default_exploration() }).unwrap();
    let world = World::embedded(5);
    // The estimated yaw is a little less than the true one.
    let (yaw, heading, pitch) = (2.5, Heading { yaw: 2.49 }, -0.2);
    let pose = Pose { yaw, heading, pitch };
    let (mut square, mut count, mut lost, mut beyond) = (0.0, 0.0, 0.0, 0);
    for seed in 0..20 {
        let readings = camera.look(&world, &grid, pose, 1.0, &mut seeded(seed, "camera"));
        assert_eq!(readings, camera.look(&world, &grid, pose, 1.0, &mut seeded(seed, "camera")));
        for (reading, direction) in readings.iter().zip(grid.all_directions()) {
            let centre = grid.direction_centre(direction);
            let centre = (heading.relative(centre.0), centre.1);
            let Some(cosine) = camera.sees(centre, pitch) else {
                assert_eq!(*reading, None);
                continue;
            };
            count += 1.0;
            let Some(reading) = reading else {
                lost += 1.0;
                continue;
            };
            let truth = world.range((centre.0 + yaw, centre.1), 1.0);
            square += ((f64::from(reading.range_m) - truth) / camera.sigma_m(truth, cosine)).powi(2);
            beyond += usize::from(reading.range_m > 3.0);
            assert!(reading.confidence > 0.0 && reading.confidence <= 1.0);
            let recovered = camera.sigma_min_m / f64::from(reading.confidence);
            close(recovered / camera.sigma_m(f64::from(reading.range_m), cosine), 1.0, 1e-5);
        }
    }
    assert!(count > 4000.0 && beyond > 0);
    close(lost / count, 0.03, 0.008);
    close(square / (count - lost), 1.0, 0.06);
}

#[test]
fn interaural_cues_by_hand() {
    let source = |rho_m, azimuth, elevation| {
        let (azimuth, elevation) = degrees(azimuth, elevation);
        cues_of(Spherical { rho_m, azimuth, elevation })
    };
    let ahead = source(2.0, 0.0, 20.0);
    assert!(ahead.itd_s == 0.0 && ahead.ild_db.iter().all(|level| level.abs() < 1e-12));
    let left = source(2.0, 90.0, 0.0);
    close(left.itd_s, 0.0875 / 343.0 * (FRAC_PI_2 + 1.0), 1e-15);
    close(left.itd_s, 0.656e-3, 1e-6);
    let spreading = 20.0 * (2.0875_f64 / 1.9125).log10();
    close(left.ild_db[0], 0.18 * 500.0_f64.sqrt() + spreading, 1e-12);
    close(left.ild_db[3], 11.384 + spreading, 1e-3);
    let (front, back, right) = (source(1.5, 40.0, 10.0), source(1.5, 140.0, 10.0), source(1.5, -40.0, 10.0));
    close(front.itd_s, back.itd_s, 1e-15);
    close(front.ild_db[2], back.ild_db[2], 1e-12);
    close(front.itd_s, -right.itd_s, 1e-15);
    close(front.ild_db[1], -right.ild_db[1], 1e-12);
    assert!(
        source(0.3, 90.0, 0.0).ild_db[0] > left.ild_db[0] + 3.0,
        "near sounds are louder at the near ear"
    );
}

#[test]
fn ears_hear_with_the_noise_that_they_promise() {
    let (world, ears) = (World::embedded(2), Ears::default());
    let exact = cues_of(world.source_from(&world.sources[0], 0.4, 0.0));
    let mut random = seeded(9, "ears");
    let heard: Vec<Cues> = (0..20_000).filter_map(|_| ears.hear(&world, 0.4, 0.0, &mut random)).collect();
    close(heard.len() as f64 / 20_000.0, 1.0 - ears.silence, 0.01);
    let spread = |value: &dyn Fn(&Cues) -> f64, centre: f64| {
        (heard.iter().map(|cues| (value(cues) - centre).powi(2)).sum::<f64>() / heard.len() as f64).sqrt()
    };
    close(spread(&|cues| cues.itd_s, exact.itd_s), 20e-6, 0.5e-6);
    close(spread(&|cues| cues.ild_db[3], exact.ild_db[3]), 1.5, 0.04);
}

#[test]
fn a_turn_adds_up_and_the_gyroscope_drifts_by_its_bias() {
    for angle in [0.001, -0.5, PI, 2.0] {
        let rates = turn_profile(angle, 0.01);
        close(rates.iter().sum::<f64>() * 0.01, angle, 1e-12);
        close(rates[0], rates[rates.len() - 1], 1e-12);
        assert!(rates.iter().all(|rate| rate.abs() <= 2.0 && rate.signum() == angle.signum()));
    }
    assert_eq!(turn_profile(2.0, 0.01).len(), 200);
    for (angle, dt) in
        [(0.0, 0.01), (f64::NAN, 0.01), (1.0, 0.0), (1.0, -1.0), (1.0, f64::NAN), (1.0, 1e-300)]
    {
        assert!(turn_profile(angle, dt).is_empty());
    }
    let (gyroscope, mut random) = (Gyroscope::default(), seeded(4, "gyroscope"));
    let mean = (0..100_000).map(|_| gyroscope.measure(0.2, &mut random)).sum::<f64>() / 1e5;
    close(mean, 0.2 + gyroscope.bias, 1e-4);
}
