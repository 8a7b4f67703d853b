//! Recordings of stereo frames and an inertial sensor, in EuRoC's format.
//!
//! In: a folder with `cam0`, `cam1` (pictures named by their time in ns), `imu0.csv` (time in ns, angular velocity in
//! rad/s and specific force in m/s², in the body's frame) and the cameras' `sensor.yaml`. Out: [`Recording`], and
//! [`Posture`], the rotation of the body over time. Invariant: times increase; each number is finite.

use crate::error::Error;
use crate::frame::{Spherical, wrap_angle};
use crate::input;
use crate::vestibular::{Balance, Vestibular};
use crate::vision::VisionError;
use nalgebra::{Rotation3, Unit, Vector3};
use std::path::{Path, PathBuf};

/// An inertial reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertial {
    /// ns.
    pub time: i64,
    /// rad/s.
    pub angular_velocity: Vector3<f64>,
    /// m/s²; at rest, upwards.
    pub specific_force: Vector3<f64>,
}

/// A recording.
#[derive(Clone, Debug)]
pub struct Recording {
    /// Time in ns, left and right picture.
    pub frames: Vec<(i64, PathBuf, PathBuf)>,
    /// In order of time.
    pub inertial: Vec<Inertial>,
}

impl Recording {
    /// Reads the recording in a folder.
    ///
    /// # Errors
    /// A file or folder that is missing; readings of more than 256 MiB; a row that is not seven numbers; fewer than two frames.
    pub fn read(folder: &Path) -> Result<Self, Error> {
        let wrong = |path: &Path, reason: String| VisionError::ImageFile { path: path.to_path_buf(), reason };
        let cameras = ["cam0", "cam1"].map(|camera| {
            let (inner, outer) = (folder.join(camera).join("data"), folder.join(camera));
            if inner.is_dir() { inner } else { outer }
        });
        let failed = |path: &Path| {
            let path = path.to_path_buf();
            move |source| VisionError::Read { path, source }
        };
        let mut frames = Vec::new();
        for entry in std::fs::read_dir(&cameras[0]).map_err(failed(&cameras[0]))? {
            let left = entry.map_err(failed(&cameras[0]))?.path();
            let time = left.file_stem().and_then(|stem| stem.to_string_lossy().parse::<i64>().ok());
            let Some((time, name)) = time.zip(left.file_name()) else { continue };
            let right = cameras[1].join(name);
            if right.is_file() {
                frames.push((time, left, right));
            }
        }
        frames.sort();
        if frames.len() < 2 {
            return Err(
                wrong(&cameras[0], format!("{} pairs of frames, expected at least 2", frames.len())).into()
            );
        }
        let path = [folder.join("imu0.csv"), folder.join("imu0").join("data.csv")];
        let path = path.iter().find(|path| path.is_file()).unwrap_or(&path[0]);
        let text = input::text(path, input::MOST_BYTES)?;
        Ok(Self { frames, inertial: inertial(&text).map_err(|reason| wrong(path, reason))? })
    }
}

fn inertial(text: &str) -> Result<Vec<Inertial>, String> {
    let mut rows: Vec<Inertial> = Vec::new();
    for (row, line) in text.lines().enumerate().filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
    {
        let cells: Vec<&str> = line.trim().split(',').collect();
        let refusal = |cell: &str| format!("row {}: `{cell}` is not a finite number", row + 1);
        let [time, numbers @ ..] = cells.as_slice() else { continue };
        let time = time.parse().map_err(|_| format!("row {}: `{time}` is not a time in ns", row + 1))?;
        let mut values = [0.0; 6];
        if numbers.len() != values.len() {
            return Err(format!("row {}: {} cells, expected 7", row + 1, cells.len()));
        }
        for (value, cell) in values.iter_mut().zip(numbers) {
            *value =
                cell.parse().ok().filter(|value: &f64| value.is_finite()).ok_or_else(|| refusal(cell))?;
        }
        if rows.last().is_some_and(|last| last.time >= time) {
            return Err(format!("row {}: time {time} is not after the previous one", row + 1));
        }
        let [x, y, z, a, b, c] = values;
        let (angular_velocity, specific_force) = (Vector3::new(x, y, z), Vector3::new(a, b, c));
        rows.push(Inertial { time, angular_velocity, specific_force });
    }
    if rows.is_empty() { Err("no rows of numbers".to_owned()) } else { Ok(rows) }
}

/// The rotation of the body: the estimated yaw, and the tilt.
///
/// The sensor's bias and the vertical are the means of the readings before the first frame, when the body is at rest.
#[derive(Clone, Debug)]
pub struct Posture {
    balance: Vestibular,
    bias: Vector3<f64>,
    /// Ahead, left and up of the first frame, in the body's frame then: the axes of the map.
    level: [Vector3<f64>; 3],
    /// From the body's frame now to that of the first frame.
    turned: Rotation3<f64>,
    time: i64,
    /// Time in ns and rate in rad/s of a reading not yet processed.
    pending: (i64, f64),
}

impl Posture {
    /// At rest at the time of the first frame; `ahead` is the direction of the gaze in the body's frame.
    ///
    /// # Errors
    /// No reading of the sensor before the first frame.
    pub fn at_rest(recording: &Recording, ahead: Vector3<f64>) -> Result<Self, Error> {
        let begin = recording.frames[0].0;
        let before: Vec<&Inertial> = recording.inertial.iter().take_while(|row| row.time < begin).collect();
        if before.is_empty() {
            let (path, reason) =
                (recording.frames[0].1.clone(), "there is no inertial reading before this frame".to_owned());
            return Err(VisionError::ImageFile { path, reason }.into());
        }
        let mean = |of: fn(&Inertial) -> Vector3<f64>| {
            before.iter().map(|row| of(row)).sum::<Vector3<f64>>() / before.len() as f64
        };
        let up = mean(|row| row.specific_force).normalize();
        let ahead = (ahead - up * up.dot(&ahead)).normalize();
        Ok(Self {
            balance: Vestibular::at_rest(Balance::Gyroscope)?,
            bias: mean(|row| row.angular_velocity),
            level: [ahead, up.cross(&ahead), up],
            turned: Rotation3::identity(),
            time: begin,
            pending: (0, 0.0),
        })
    }

    /// Processes inertial readings; rows are in order of time.
    ///
    /// # Errors
    /// Only the filter's own checks, which finite data pass.
    pub fn feel(&mut self, row: &Inertial) -> Result<(), Error> {
        let step = row.time - self.time;
        if step <= 0 {
            return Ok(());
        }
        self.time = row.time;
        let rate = row.angular_velocity - self.bias;
        let seconds = step as f64 * 1e-9;
        let yaw_rate = (self.turned * rate).dot(&self.level[2]);
        if let Some(axis) = Unit::try_new(rate, 1e-12) {
            self.turned *= Rotation3::from_axis_angle(&axis, rate.norm() * seconds);
        }
        // The vestibular filter has its own sampling time: each of its instants gets a mean rate.
        self.pending = (self.pending.0 + step, self.pending.1 + yaw_rate * seconds);
        let pace = (Vestibular::DT * 1e9) as i64;
        while self.pending.0 >= pace {
            let share = self.pending.1 * pace as f64 / self.pending.0 as f64;
            self.balance.feel(share / Vestibular::DT)?;
            self.pending = (self.pending.0 - pace, self.pending.1 - share);
        }
        Ok(())
    }

    /// The estimated yaw, radians to the left.
    pub fn yaw(&self) -> f64 {
        self.balance.yaw()
    }

    /// Azimuth and elevation of a direction given in the body's frame, radians, of a head that is turned but not tilted.
    pub fn direction(&self, body: Vector3<f64>) -> (f64, f64) {
        let turned = self.turned * body;
        let seen = Spherical::from_cartesian(self.level.map(|axis| axis.dot(&turned)));
        (wrap_angle(seen.azimuth - self.integrated_yaw()), seen.elevation)
    }

    /// The yaw of the integrated turn.
    fn integrated_yaw(&self) -> f64 {
        let now = self.turned * self.level[0];
        self.level[1].dot(&now).atan2(self.level[0].dot(&now))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A body that rests for 0.1 s with a bias of 0.3 rad/s about every axis, then turns about the vertical (its x axis).
    fn turning(rate: f64) -> Recording {
        let row = |step: i64| {
            let turn = if step > 20 { rate } else { 0.0 };
            let angular_velocity = Vector3::new(0.3 + turn, 0.3, 0.3);
            Inertial { time: step * 5_000_000, angular_velocity, specific_force: Vector3::new(9.8, 0.0, 0.0) }
        };
        let frames = [20i64, 120].map(|step| (step * 5_000_000, PathBuf::from("l"), PathBuf::from("r")));
        Recording { frames: frames.to_vec(), inertial: (0..=120).map(row).collect() }
    }

    #[test]
    fn half_a_second_of_turning() {
        let recording = turning(-0.8);
        let mut posture = Posture::at_rest(&recording, Vector3::z()).unwrap();
        recording.inertial.iter().for_each(|row| posture.feel(row).unwrap());
        // −0.8 rad/s about the vertical for 0.5 s is −0.4 rad, to the right; the filter lags by its prior, a little.
        assert!((posture.integrated_yaw() + 0.4).abs() < 1e-9, "{}", posture.integrated_yaw());
        assert!((posture.yaw() + 0.4).abs() < 0.01, "{}", posture.yaw());
        // A point ahead of the turned head stays ahead of it, and level.
        let (azimuth, elevation) = posture.direction(Vector3::z());
        assert!(azimuth.abs() < 1e-9 && elevation.abs() < 1e-9);
    }

    #[test]
    fn faults_name_the_row() {
        for (text, expected) in [
            ("#t\n", "no row"),
            ("1,2,3\n", "row 1: 3 cells, expected 7"),
            ("1,0,0,0,0,0,0\nx,0,0,0,0,0,0\n", "row 2: `x` is not a time"),
            ("1,0,0,nan,0,0,0\n", "row 1: `nan` is not a finite number"),
            ("2,0,0,0,0,0,0\n1,0,0,0,0,0,0\n", "row 2: time 1 is not after"),
        ] {
            let message = inertial(text).unwrap_err();
            assert!(message.contains(expected), "{message}");
        }
    }
}
