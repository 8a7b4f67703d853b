//! Balance: simulated inertial samples through the inertial filter to the attitude.
//!
//! In: the true rates and forces of the turn, for the samples. Out: the attitude that `models/inertial.bp` estimates from
//! them. Invariant: a gap does not stop the head: what the samples do not tell is taken from the neck's own account of its
//! turn, and reported.

use super::neck::BEFORE_S;
use super::{Faults, noise_seed};
use crate::error::Error;
use crate::head::frames::Attitude;
use crate::head::sense::{Evidence, Sense, Sensed};
use crate::head::stage::Shared;
use crate::map::Map;
use crate::vestibular::reader::Row;
use crate::vestibular::rotation;
use crate::vestibular::{Fault, Noise, Settings, Stream};
use crate::world::scene::{FaultKind, Imu, Organ};
use crate::world::{Random, seeded};
use rand_distr::{Distribution, StandardNormal};

/// Deviation of the neck's own account, rad: its gears.
const NECK_RAD: f64 = 0.01;

pub(super) struct InertialSense {
    stage: Shared,
    imu: Imu,
    faults: Faults,
    is_used: bool,
    stream: Stream,
    number: u64,
    /// What the neck's account has added to the yaw of the filter, rad, and the variance of that.
    added: [f64; 2],
    before: f64,
    last: Option<([f64; 3], [f64; 3])>,
}

impl InertialSense {
    pub(super) fn new(stage: &Shared, imu: Imu, faults: Faults, is_used: bool) -> Self {
        let rate = imu.rate_hz.sqrt();
        let noise = Noise {
            gyroscope: (imu.gyroscope_sigma / rate).max(Noise::default().gyroscope),
            accelerometer: (imu.accelerometer_sigma / rate).max(Noise::default().accelerometer),
            ..Noise::default()
        };
        let stream = Stream::new(Settings { noise, ..Settings::default() });
        let stage = stage.clone();
        Self { stage, imu, faults, is_used, stream, number: 0, added: [0.0; 2], before: 0.0, last: None }
    }

    /// The sample of a rate and a force: constant biases and white noise.
    fn sample(&self, rate: [f64; 3], force: [f64; 3], random: &mut Random) -> ([f64; 3], [f64; 3]) {
        let mut noisy = |value: f64, sigma: f64| {
            let own: f64 = StandardNormal.sample(random);
            value + sigma * own
        };
        let Imu { gyroscope_bias, accelerometer_bias, gyroscope_sigma, accelerometer_sigma, .. } = self.imu;
        let rate = [0, 1, 2].map(|axis| noisy(rate[axis] + gyroscope_bias[axis], gyroscope_sigma));
        (rate, [0, 1, 2].map(|axis| noisy(force[axis] + accelerometer_bias[axis], accelerometer_sigma)))
    }
}

impl Sense for InertialSense {
    fn name(&self) -> &'static str {
        "imu"
    }

    fn likelihood(&mut self, _prior: &Map, attitude: &Attitude) -> Result<Sensed, Error> {
        let (felt, commanded, mut random, look) = {
            let mut stage = self.stage.borrow_mut();
            let felt = std::mem::take(&mut stage.felt);
            (felt, stage.commanded, seeded(noise_seed(&stage), "imu"), stage.look - 1)
        };
        let assumed = Attitude {
            yaw: attitude.yaw + commanded[0],
            pitch: attitude.pitch + commanded[1],
            roll: attitude.roll,
            sd_yaw: attitude.sd_yaw.hypot(NECK_RAD),
        };
        if !self.is_used {
            return Ok(Sensed { evidence: Evidence::Attitude(assumed), ..Sensed::default() });
        }
        // The rest before the first look belongs to no look.
        let fault = self.faults.at(Organ::Imu, look);
        let (mut readings, mut estimate) = (0, None);
        for (time, rate, force) in &felt {
            let mut own = self.sample(*rate, *force, &mut random);
            if *time > BEFORE_S {
                match fault {
                    Some(FaultKind::Lost) => continue,
                    Some(FaultKind::Frozen) => own = self.last.unwrap_or(own),
                    None => {}
                }
            }
            self.last = Some(own);
            self.number += 1;
            readings += 1;
            let stamp = (time * 1e9).round() as i64;
            let row = Row { number: self.number, time: stamp, rate: Some(own.0), force: Some(own.1) };
            match self.stream.feel(row) {
                Ok(instants) => estimate = instants.last().map(|instant| instant.estimate).or(estimate),
                Err(Fault::Program(error)) => return Err(error),
                Err(Fault::Clock(reason)) => return Ok(unused(assumed, readings, reason)),
            }
        }
        let Some(estimate) = estimate else {
            self.added[0] += commanded[0];
            self.added[1] += NECK_RAD * NECK_RAD;
            let reason = "no inertial samples: the commanded turn is used";
            return Ok(unused(assumed, readings, reason.to_owned()));
        };
        let matrix = rotation::matrix(estimate.orientation);
        // A turn may be longer than half a circle.
        let filtered = Attitude::of(&matrix, self.before + commanded[0]);
        let gained = filtered.yaw - self.before;
        self.before = filtered.yaw;
        let mut fault = None;
        // A sensor that repeats itself, or gave nothing during a turn, has not measured it.
        if (gained - commanded[0]).abs() > 10.0 * NECK_RAD.max(estimate.sd_heading) {
            fault = Some(format!(
                "the sensor felt a turn of {:.1} degrees, {:.1} were commanded: the command is used",
                gained.to_degrees(),
                commanded[0].to_degrees()
            ));
            self.added[0] += commanded[0] - gained;
            self.added[1] += NECK_RAD * NECK_RAD;
        }
        let sd_yaw = estimate.sd_heading.hypot(self.added[1].sqrt());
        let mut known = Attitude { yaw: filtered.yaw + self.added[0], sd_yaw, ..filtered };
        if fault.is_some() {
            (known.pitch, known.roll) = (assumed.pitch, assumed.roll);
        }
        Ok(Sensed { evidence: Evidence::Attitude(known), readings, fault, ..Sensed::default() })
    }
}

fn unused(assumed: Attitude, readings: usize, reason: String) -> Sensed {
    Sensed { evidence: Evidence::Attitude(assumed), readings, fault: Some(reason), ..Sensed::default() }
}
