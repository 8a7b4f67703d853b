//! The vestibular model in three dimensions: published behaviour, and reference runs of an extended Kalman filter.
//!
//! `docs/balance.md` prints the table; `cargo test -p bvm --test balance dimensions -- --nocapture` prints ours. Where the reference
//! run does not state its motion, expected values are those of the program's equations integrated on their own (numpy, an extended
//! Kalman filter of nine states written for this comparison: each tangent once, that of the rotation at the prior of the rate).

use super::published::near;
use bvm::vestibular::human::{DT, Human};
use bvm::vestibular::inertial::GRAVITY;
use bvm::vestibular::rotation::{self, Vector};

/// A head in three dimensions, with its true orientation.
#[derive(Clone)]
struct Head {
    human: Human,
    orientation: [f64; 4],
}

impl Head {
    /// Upright or tilted, after a minute at rest.
    fn at_rest(orientation: [f64; 4]) -> Self {
        let up = rotation::apply(&rotation::transposed(&rotation::matrix(orientation)), [0.0, 0.0, GRAVITY]);
        let mut head = Self { human: Human::at_rest(up, 0.0), orientation };
        head.go(60.0, [0.0; 3], [0.0; 3]);
        head
    }

    /// Rotates (rad/s) and accelerates (m/s², in the axes of the head) for some time.
    fn go(&mut self, seconds: f64, rate: Vector, acceleration: Vector) {
        for _ in 0..(seconds / DT).round() as usize {
            self.step(rate, acceleration);
        }
    }

    fn step(&mut self, rate: Vector, acceleration: Vector) {
        let turn = rotation::from_vector(rate.map(|rate| DT * rate));
        self.orientation = rotation::normalised(rotation::product(self.orientation, turn));
        let up =
            rotation::apply(&rotation::transposed(&rotation::matrix(self.orientation)), [0.0, 0.0, GRAVITY]);
        let force = std::array::from_fn(|axis| up[axis] + acceleration[axis]);
        self.human.move_on(rate, force).expect("finite readings");
    }
}

#[test]
fn a_rotation_about_the_vertical() {
    for rate in [20f64, 90.0] {
        let mut head = Head::at_rest([1.0, 0.0, 0.0, 0.0]);
        let rate = rate.to_radians();
        head.step([0.0, 0.0, rate], [0.0; 3]);
        near("3-D: first estimate of a rotation", head.human.rate()[2] / rate, 0.94, 5e-3);
        head.go(30.0, [0.0, 0.0, rate], [0.0; 3]);
        let then = head.human.rate()[2];
        head.go(20.0, [0.0, 0.0, rate], [0.0; 3]);
        near("3-D: decay of a rotation, s", 20.0 / (then / head.human.rate()[2]).ln(), 16.49, 0.2);
    }
}

#[test]
fn a_long_acceleration_is_felt_as_a_tilt() {
    for (g, degrees) in [(0.2, 11.3), (0.5, 26.6), (1.0, 45.0)] {
        let mut head = Head::at_rest([1.0, 0.0, 0.0, 0.0]);
        head.go(40.0, [0.0; 3], [g * GRAVITY, 0.0, 0.0]);
        let [x, _, z] = head.human.gravity();
        near(&format!("3-D: tilt felt at {g} g, deg"), x.atan2(z).to_degrees(), degrees, 0.6);
    }
}

#[test]
fn a_stop_and_a_roll() {
    // A long rotation stops, and the head rolls within a second. The reference run has 16.5, 15.5, 12.4, 8.2 and 3.1 s at 0, 15,
    // 30, 45 and 90 degrees; its speed is not stated, and the times depend on it.
    for (speed, times) in [(60.0, [16.5, 15.0, 11.3, 7.77, 4.27]), (90.0, [16.5, 15.12, 11.87, 8.74, 4.78])] {
        let mut head = Head::at_rest([1.0, 0.0, 0.0, 0.0]);
        head.go(100.0, [0.0, 0.0, f64::to_radians(speed)], [0.0; 3]);
        for (roll, seconds) in [0.0, 15.0, 30.0, 45.0, 90.0].into_iter().zip(times) {
            let mut head = head.clone();
            let mut felt = Vec::new();
            for step in 0..2500 {
                let rolls = if step < 100 { f64::to_radians(roll) } else { 0.0 };
                head.step([rolls, 0.0, 0.0], [0.0; 3]);
                felt.push(head.human.rate()[2]);
            }
            let steps = felt.iter().position(|rate| rate / felt[0] < (-1f64).exp()).unwrap();
            near(
                &format!("3-D: {speed} deg/s, stop, roll by {roll} deg, s"),
                steps as f64 * DT,
                seconds,
                0.02,
            );
        }
    }
}

#[test]
fn off_vertical_axes() {
    // The reference run has gains of .01, .16, .62, .85 and .90 at 0, 10, 30, 60 and 90 degrees and 30 deg/s, and .01, .05, .31 and
    // .64 at 0, 10, 30 and 60 degrees and 60 deg/s. Expected are those of the filter in numpy, after 70 s.
    for (speed, axis, expected) in [
        (30.0, 0.0, 0.00959),
        (30.0, 10.0, 0.1561),
        (30.0, 30.0, 0.60508),
        (30.0, 60.0, 0.83212),
        (30.0, 90.0, 0.88353),
        (60.0, 10.0, 0.04956),
        (60.0, 30.0, 0.30985),
        (60.0, 60.0, 0.63395),
    ] {
        let mut head = Head::at_rest(rotation::from_vector([f64::to_radians(axis), 0.0, 0.0]));
        let rate = f64::to_radians(speed);
        head.go(70.0, [0.0, 0.0, rate], [0.0; 3]);
        let mut sum = 0.0;
        let steps = (360.0 / speed / DT).round() as usize;
        for _ in 0..steps {
            head.step([0.0, 0.0, rate], [0.0; 3]);
            sum += head.human.rate()[2] / rate / steps as f64;
        }
        near(&format!("3-D: off-vertical axis, {speed} deg/s, {axis} deg"), sum, expected, 1e-4);
    }
}
