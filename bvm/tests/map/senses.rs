//! The senses' programs as they are compiled into the crate, against published figures.
//!
//! In: `models/line_of_sight.bp`, `models/binaural.bp`, `models/vestibular.bp`. Out: posteriors, directions, gains.
//! Invariant: expected values are those of the reference (closed forms checked by brute force, eLife 6:e28074), or
//! follow from the world's own geometry.

use bp_core::compiler::exec::scalar::Scalar;
use bp_core::compiler::strategies::gaussian::Filter;
use bvm::audition::Hearing;
use bvm::frame::Spherical;
use bvm::grid::{Grid, GridConfiguration};
use bvm::programs::{line_of_sight, vestibular};
use bvm::world::World;
use bvm::world::sensors::cues_of;

/// P(O = 1 | z) of each cell of one line of ten; z = 0 is "No Detection".
fn posterior<T: Scalar>(z: f64, sigma: f64) -> Vec<f64> {
    let number = T::from_f64;
    let question = line_of_sight::reading().rays(1).n(10).sigma_min(sigma).ln_b(1.0);
    let answer = question.lambda(&[number(1.0)]).rho(&[number(1.0)]).z(&[number(z)]).ask().unwrap();
    let p = |occupied: bool, cell: i64| answer.p(occupied, cell)[0].to_f64();
    (1..=10).map(|cell| p(true, cell) / (p(false, cell) + p(true, cell))).collect()
}

fn check_posteriors<T: Scalar>() {
    let half = 0.5;
    let cases: [(f64, f64, usize, &[f64]); 4] = [
        (3.0, 0.6, 0, &[0.0223, 0.3639, 0.7229, 0.5434, 0.5007, half, half, half, half, half]),
        (6.0, 0.6, 0, &[0.0, 0.0, 0.0001, 0.0223, 0.3639, 0.7229, 0.5434, 0.5007, half, half]),
        (0.0, 0.6, 7, &[0.0001, 0.0102, 0.1717]),
        (3.0, 0.3, 0, &[0.0, 0.0934, 0.93, 0.5117, half]),
    ];
    for (z, sigma, first, expected) in cases {
        let found = posterior::<T>(z, sigma);
        for (cell, expected) in (first..).zip(expected) {
            let p = found[cell];
            assert!((p - expected).abs() <= 0.6e-4, "z = {z}, cell {cell}: {p}, expected {expected}");
        }
    }
}

#[test]
fn a_line_of_sight_has_the_published_posteriors() {
    check_posteriors::<f64>();
    check_posteriors::<f32>();
}

/// The angle from the median plane, in degrees, which is all that two ears can determine.
fn lateral_degrees(place: Spherical) -> f64 {
    (place.azimuth.sin() * place.elevation.cos()).clamp(-1.0, 1.0).asin().to_degrees()
}

#[test]
fn the_loudspeaker_is_heard_where_it_stands() {
    let grid = Grid::new(GridConfiguration::default_exploration()).unwrap();
    let mut hearing = Hearing::calibrated(&grid);
    let world = World::embedded(1);
    for yaw_degrees in [0.0f64, 50.0, 100.0, 200.0, 300.0] {
        let source = world.source_from(&world.sources[0], yaw_degrees.to_radians(), 0.0);
        let sounding = hearing.sounding(&cues_of(source)).unwrap();
        let best = (0..sounding.len()).max_by(|a, b| sounding[*a].total_cmp(&sounding[*b])).unwrap();
        let heard = lateral_degrees(grid.centre(grid.cell(best).unwrap()));
        let stands = lateral_degrees(source);
        assert!((heard - stands).abs() < 6.0, "yaw {yaw_degrees}: heard at {heard}, stands at {stands}");
    }
}

fn settled() -> Filter {
    let mut filter = vestibular::rotation().filter().unwrap();
    filter.settle().unwrap();
    filter
}

#[test]
fn balance_has_the_published_gains() {
    let filter = settled();
    let (omega, canal) = (filter.gain_of("Omega", "V").unwrap(), filter.gain_of("C", "V").unwrap() / 0.01);
    assert!((omega - 0.9428).abs() < 0.5e-4 && (canal - 0.1892).abs() < 0.5e-4, "{omega}, {canal}");
}

#[test]
fn a_constant_rotation_fades_in_16_s() {
    let (dt, tau_c) = (0.01, 4.0);
    let (mut filter, mut canal, mut before) = (settled(), 0.0, 0.0);
    let mut estimates = Vec::new();
    for _ in 0..=6000 {
        canal = (1.0 - dt / tau_c) * canal + tau_c / (tau_c + dt) * (1.0 - before);
        before = 1.0;
        estimates.push(filter.step(&[("V", canal)]).unwrap().mean_of("Omega").unwrap());
    }
    // Once the canal's own 4 s are over, the rest decays by e in 4 · √17 = 16.49 s.
    let fall = 20.0 / (estimates[4000] / estimates[6000]).ln();
    assert!((fall - 16.49).abs() < 0.05, "{fall}");
}
