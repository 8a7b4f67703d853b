//! A neck with limits, speed and inertia.
//!
//! In: a gaze in the map, and the estimated attitude. Out: a turn about the vertical and a pitch, together, along raised
//! cosines: the head starts and ends at rest, and neither speed nor acceleration exceeds its limit. Invariant: the head turns
//! by the difference between the gaze and the *estimated* attitude, so that an error of the estimate remains an error.

use super::at_rest;
use super::ears::LOOK_S;
use crate::error::Error;
use crate::frame::wrap_angle;
use crate::grid::Grid;
use crate::head::frames::{Attitude, Extrinsics};
use crate::head::policy::Gaze;
use crate::head::sense::View;
use crate::head::stage::{Neck, Shared, Turned};
use crate::vestibular::rotation::{cross, transposed};
use crate::vision::RangeReading;
use crate::world::scene::{self, Scene};
use crate::world::sensors::DepthCamera;
use std::f64::consts::TAU;

/// Rest after a turn, s.
const SETTLE_S: f64 = 0.1;
/// Rest before the first look, s, in which balance learns the bias of its sensor.
pub(super) const BEFORE_S: f64 = 1.0;
/// Turns by less are none, rad.
const LEAST_RAD: f64 = 1e-9;

pub(super) struct SlewingNeck {
    stage: Shared,
    neck: scene::Neck,
    camera: DepthCamera,
    rate_hz: f64,
    lag_s: f64,
    lever_m: [f64; 3],
    /// The number of samples that were taken, and the attitudes at the last two.
    samples: u64,
    last: [Attitude; 2],
}

impl SlewingNeck {
    pub(super) fn new(stage: &Shared, scene: &Scene, extrinsics: Extrinsics, camera: DepthCamera) -> Self {
        let (rate_hz, lag_s) = (scene.imu.rate_hz, scene.imu.lag_s);
        let lever_m = extrinsics.imu.translation;
        let mut neck = Self {
            stage: stage.clone(),
            neck: scene.neck,
            camera,
            rate_hz,
            lag_s,
            lever_m,
            samples: 0,
            last: [Attitude::default(); 2],
        };
        neck.rest(BEFORE_S);
        neck
    }

    /// Time passes while the head is at rest.
    fn rest(&mut self, seconds: f64) {
        let still = |_: f64| [0.0; 2];
        self.pass(seconds, still);
    }

    /// Time passes; `moved` gives the yaw and the pitch by which the head has turned after some seconds.
    fn pass(&mut self, seconds: f64, moved: impl Fn(f64) -> [f64; 2]) {
        let stage = self.stage.clone();
        let mut stage = stage.borrow_mut();
        let (start, from) = (stage.time_s, stage.attitude);
        let dt = 1.0 / self.rate_hz;
        let at = |time: f64| {
            let [yaw, pitch] = moved((time - start - self.lag_s).clamp(0.0, seconds));
            Attitude { yaw: from.yaw + yaw, pitch: from.pitch + pitch, ..from }
        };
        loop {
            let time = (self.samples + 1) as f64 * dt;
            if time > start + seconds {
                break;
            }
            self.samples += 1;
            let now = at(time);
            let [older, before] = self.last;
            self.last = [before, now];
            let rate = rate_between(&before, &now, dt);
            let last = rate_between(&older, &before, dt);
            let (_, mut force) = at_rest(&now);
            // At the end of a lever the turn is felt too.
            let spin = [0, 1, 2].map(|axis| (rate[axis] - last[axis]) / dt);
            let (along, inwards) = (cross(spin, self.lever_m), cross(rate, cross(rate, self.lever_m)));
            (0..3).for_each(|axis| force[axis] += along[axis] + inwards[axis]);
            stage.felt.push((time, rate, force));
        }
        let [yaw, pitch] = moved(seconds);
        stage.attitude = Attitude { yaw: from.yaw + yaw, pitch: from.pitch + pitch, ..from };
        stage.time_s = start + seconds;
    }

    /// The yaw that the neck turns to, without wrapping beyond its limits.
    fn yaw_to(&self, azimuth: f64, now: f64) -> f64 {
        let [right, left] = self.neck.yaw_degrees.map(f64::to_radians);
        if left - right >= TAU {
            now + wrap_angle(azimuth - now)
        } else {
            wrap_angle(azimuth).clamp(right, left)
        }
    }

    fn pitch_to(&self, elevation: f64) -> f64 {
        let [down, up] = self.neck.pitch_degrees.map(f64::to_radians);
        elevation.clamp(down, up)
    }

    /// How long a turn takes: of a raised cosine the peak of the rate is 2 a / T, that of the acceleration 2π a / T².
    fn seconds(&self, angle: f64) -> f64 {
        let (speed, acceleration) =
            (self.neck.speed_degrees_s.to_radians(), self.neck.acceleration_degrees_s2.to_radians());
        (2.0 * angle / speed).max((TAU * angle / acceleration).sqrt())
    }
}

/// The mean angular rate between two attitudes without roll, in the axes of the head.
fn rate_between(before: &Attitude, now: &Attitude, dt: f64) -> [f64; 3] {
    let (yaw, pitch) = ((now.yaw - before.yaw) / dt, (now.pitch - before.pitch) / dt);
    let (sine, cosine) = (0.5 * (before.pitch + now.pitch)).sin_cos();
    [yaw * sine, -pitch, yaw * cosine]
}

impl Neck for SlewingNeck {
    fn turn(&mut self, gaze: Gaze, attitude: &Attitude) -> Result<Turned, Error> {
        self.rest(LOOK_S);
        let (azimuth, elevation) = (self.yaw_to(gaze.azimuth, attitude.yaw), self.pitch_to(gaze.elevation));
        let turn = [azimuth - attitude.yaw, elevation - attitude.pitch];
        let travel_rad = turn[0].hypot(turn[1]);
        let takes = turn.iter().map(|angle| self.seconds(angle.abs())).fold(0.0, f64::max);
        if travel_rad > LEAST_RAD {
            self.pass(takes, move |time| {
                let share = (time / takes).clamp(0.0, 1.0);
                let eased = share - (TAU * share).sin() / TAU;
                turn.map(|angle| angle * eased)
            });
        }
        self.rest(SETTLE_S);
        let mut stage = self.stage.borrow_mut();
        stage.look += 1;
        stage.commanded = turn;
        let gaze = Gaze { azimuth: wrap_angle(azimuth), elevation, ..gaze };
        Ok(Turned { gaze, seconds: takes, travel_rad })
    }

    fn reaches(&self, (azimuth, elevation): (f64, f64)) -> bool {
        let (yaw, pitch) = (self.yaw_to(azimuth, azimuth), self.pitch_to(elevation));
        self.camera.sees((wrap_angle(azimuth - yaw), elevation), pitch).is_some()
    }

    fn time_s(&self) -> f64 {
        self.stage.borrow().time_s
    }

    fn truth(&self) -> Option<Attitude> {
        let attitude = self.stage.borrow().attitude;
        Some(Attitude { yaw: wrap_angle(attitude.yaw), ..attitude })
    }
}

/// Of each direction of the map: whether cameras with these fields of view have it in view, and whether there was a
/// reading. `alone` is the part of the view at its left edge, as a tangent, where no reading says nothing.
pub(super) fn view(
    grid: &Grid,
    attitude: &Attitude,
    fields_degrees: [f64; 2],
    alone: f64,
    readings: &[Option<RangeReading>],
) -> View {
    let to_head = transposed(&attitude.matrix());
    let edges = fields_degrees.map(|field| (0.5 * field).to_radians().tan());
    let one = |(direction, reading): (crate::grid::Direction, &Option<RangeReading>)| {
        let (azimuth, elevation) = grid.direction_centre(direction);
        let ray = crate::frame::unit_vector(azimuth, elevation);
        let [ahead, left, up] = crate::vestibular::rotation::apply(&to_head, ray);
        let is_seen = ahead > 0.0 && left.abs() <= edges[0] * ahead && up.abs() <= edges[1] * ahead;
        let counts = reading.is_some() || left <= (edges[0] - alone) * ahead;
        (is_seen && counts).then_some(reading.is_some())
    };
    grid.all_directions().zip(readings).map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::head::stage::Stage;
    use crate::vestibular::inertial::GRAVITY;

    #[test]
    fn a_turn_stays_within_speed_and_acceleration_and_gravity_follows_the_pitch() {
        let scene = Scene::find("empty").unwrap();
        let stage = Stage::new(scene.world(1), 1);
        let extrinsics = Extrinsics::of(0.12, 0.0);
        let mut neck = SlewingNeck::new(&stage, &scene, extrinsics, DepthCamera::default());
        let turned = neck.turn(Gaze::at(2.0, 0.5), &Attitude::default()).unwrap();
        assert!((turned.gaze.azimuth - 2.0).abs() < 1e-12 && (turned.gaze.elevation - 0.5).abs() < 1e-12);
        let stage = stage.borrow();
        assert!((stage.attitude.yaw - 2.0).abs() < 1e-12 && (stage.attitude.pitch - 0.5).abs() < 1e-12);
        let dt = 1.0 / scene.imu.rate_hz;
        let sum: f64 =
            stage.felt.iter().map(|(_, rate, _)| dt * rate[0].hypot(rate[2]) * rate[2].signum()).sum();
        assert!((sum - 2.0).abs() < 1e-6, "the rates add up to the turn: {sum}");
        let speed = scene.neck.speed_degrees_s.to_radians() * (1.0 + 1e-9);
        assert!(stage.felt.iter().all(|(_, rate, _)| rate[0].hypot(rate[2]) <= speed));
        let (_, _, [x, _, z]) = stage.felt[stage.felt.len() - 1];
        assert!((x - GRAVITY * 0.5f64.sin()).abs() < 1e-9 && (z - GRAVITY * 0.5f64.cos()).abs() < 1e-9);
    }

    #[test]
    fn limits_hold() {
        let scene = Scene::find("empty").unwrap();
        let stage = Stage::new(scene.world(1), 1);
        let camera = DepthCamera { field_degrees: [80.0, 50.0], ..DepthCamera::default() };
        let mut neck = SlewingNeck::new(&stage, &scene, Extrinsics::of(0.12, 0.0), camera);
        let turned = neck.turn(Gaze::at(3.0, -1.5), &Attitude::default()).unwrap();
        assert!((turned.gaze.azimuth.to_degrees() - 150.0).abs() < 1e-9);
        assert!((turned.gaze.elevation.to_degrees() + 60.0).abs() < 1e-9);
        assert!(neck.reaches((3.1, 0.0)), "within half a field of view of the limit");
        assert!(
            !neck.reaches((0.0, 1.57)),
            "the pole is 30 degrees beyond the limit, and half the view is 25 high"
        );
    }
}
