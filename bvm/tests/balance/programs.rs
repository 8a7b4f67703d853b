//! The filters of balance, by hand or emitted, beside those that the compiler makes of their programs at run time.

use bp_core::prelude::*;
use bvm::programs::{inertial, self_motion};
use bvm::vestibular::Noise;
use bvm::vestibular::human::Human;
use bvm::vestibular::inertial::{GRAVITY, Inertial};
use bvm::vestibular::rotation;
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

fn number(posterior: &Posterior, slot: &str) -> [f64; 2] {
    let of = posterior.of(slot).unwrap();
    [of.mean().unwrap(), of.deviation().unwrap()]
}

/// A mean may differ by a part of its deviation, and a deviation by a part of itself: the tangents are taken at slightly different
/// places.
#[track_caller]
fn agree(name: &str, [mean, deviation]: [f64; 2], [own, own_deviation]: [f64; 2], part: f64) {
    assert!((mean - own).abs() < part * deviation, "{name}: program {mean} ± {deviation}, filter {own}");
    assert!(
        (own_deviation / deviation - 1.0).abs() < part,
        "{name}: deviation {deviation}, filter {own_deviation}"
    );
}

#[test]
fn the_inertial_filter_is_its_program() {
    let first = [0.6, -0.4, 9.7];
    let length = rotation::dot(first, first).sqrt();
    let up = first.map(|cell: f64| cell * GRAVITY / length);
    let program = Program::parse(inertial::SOURCE).unwrap().by("extended_kalman").unwrap();
    let program = program.with("up", up.to_vec()).unwrap();
    let question = "P(G V B Turn | Gyroscope Accelerometer Small Still Weight)";
    let mut filter = program.filter(question).unwrap();
    let mut own = Inertial::new(Noise::default(), 0.0);
    own.start(first);
    let dt = 0.01;
    for step in 0..80 {
        let time = f64::from(step) * dt;
        let rate = [0.3 * (4.0 * time).sin() + 0.01, 0.2 * (3.0 * time).cos(), 0.9];
        let force = [0.6 + 0.5 * (5.0 * time).sin(), -0.4 + 0.3 * time, 9.7 + 0.4 * (9.0 * time).cos()];
        let still = step % 7 == 3;
        own.turn(rate, 0.0, dt);
        own.push(force, dt);
        let mut seen =
            evidence! { Gyroscope: rate.to_vec(), Accelerometer: force.to_vec(), Small: vec![0.0; 3] };
        if still {
            own.still([0.012, -0.004, 0.003], dt);
            seen.set("Still", vec![0.012, -0.004, 0.003]);
        }
        if step == 0 {
            seen.set("Weight", GRAVITY);
        }
        let posterior = filter.step(seen).unwrap();
        if step % 20 != 19 {
            continue;
        }
        let to_sensor = rotation::transposed(&rotation::matrix(own.orientation()));
        let velocity = rotation::apply(&to_sensor, own.velocity());
        let gravity = own.estimate().gravity;
        for axis in 0..3 {
            let g = number(&posterior, &format!("G[{axis}]"));
            let own_g = own.gravity_deviations()[axis];
            agree(&format!("{step}: G[{axis}]"), g, [gravity[axis], own_g], 0.1);
            let v = number(&posterior, &format!("V[{axis}]"));
            assert!((v[0] - velocity[axis]).abs() < 0.1 * v[1], "{step}: V[{axis}] {v:?} {}", velocity[axis]);
            let b = number(&posterior, &format!("B[{axis}]"));
            agree(&format!("{step}: B[{axis}]"), b, [own.bias()[axis], own.bias_deviations()[axis]], 0.1);
        }
        // The heading: what stays uncertain of the angle turned about the vertical, once the vertical is known.
        let names = ["G[0]", "G[1]", "G[2]"];
        let spread = |one: &str, other: &str| posterior.covariance(one, other).unwrap();
        let of_gravity = Matrix3::from_fn(|row, column| spread(names[row], names[column]));
        let with_turn = Vector3::from_fn(|row, _| spread(names[row], "Turn"));
        let explained = with_turn.dot(&(of_gravity.try_inverse().unwrap() * with_turn));
        let heading = (number(&posterior, "Turn")[1].powi(2) - explained).sqrt();
        let [x, y, z] = own.rotation_covariance();
        let tilt = Matrix2::new(x[0], x[1], y[0], y[1]);
        let both = Vector2::new(z[0], z[1]);
        let own_heading = (z[2] - both.dot(&(tilt.try_inverse().unwrap() * both))).sqrt();
        println!("{step}: heading {heading} {own_heading}");
        assert!(
            (own_heading / heading - 1.0).abs() < 0.05,
            "{step}: heading ± {heading}, filter {own_heading}"
        );
    }
}

/// The emitted filter takes its tangents once at each observation; asked of the text, the filter iterates. Slow motions show no
/// difference.
#[test]
fn the_human_observer_is_its_program() {
    let up = [3.0, -2.0, 9.1];
    let length = rotation::dot(up, up).sqrt();
    let up = up.map(|cell: f64| cell * GRAVITY / length);
    let program = Program::parse(self_motion::SOURCE).unwrap().by("extended_kalman").unwrap();
    let program = program.with("up", up.to_vec()).unwrap();
    let mut filter = program.filter("P(Omega G A Turn | V F)").unwrap();
    let mut own = Human::at_rest(up, 0.0);
    for step in 0..60 {
        let time = f64::from(step) * 0.01;
        let canals = [0.08 * (5.0 * time).sin(), 0.03, 0.1 - 0.1 * time];
        let otoliths = [up[0] + 0.2 * time, up[1] - 0.15 * time * time, up[2]];
        own.feel(canals, otoliths).unwrap();
        let posterior = filter.step(evidence! { V: canals.to_vec(), F: otoliths.to_vec() }).unwrap();
        if step % 20 != 19 {
            continue;
        }
        let found = own.estimate();
        for axis in 0..3 {
            for (name, mean, deviation) in [
                ("Omega", found.rate, found.sd_rate),
                ("G", found.gravity, found.sd_gravity),
                ("A", found.acceleration, found.sd_acceleration),
            ] {
                let of_program = number(&posterior, &format!("{name}[{axis}]"));
                agree(&format!("{step}: {name}"), of_program, [mean[axis], deviation[axis]], 0.1);
            }
        }
        assert!((found.sd_heading / number(&posterior, "Turn")[1] - 1.0).abs() < 0.1);
    }
}
