//! Recordings of stereo frames and an inertial sensor, in EuRoC's format.
//!
//! In: a folder with `cam0`, `cam1` (pictures named by their time in ns), `imu0.csv` (time in ns, angular velocity in
//! rad/s and specific force in m/s², in the body's frame) and the cameras' `sensor.yaml`. Out: [`Recording`], [`Posture`], the
//! rotation of the body over time, and [`Poses`], its places, where they were measured. Invariant: times increase; each number is
//! finite.

mod poses;

pub use poses::Poses;

use crate::error::Error;
use crate::frame::{Spherical, wrap_angle};
use crate::input;
use crate::vestibular::reader::Row;
use crate::vestibular::rotation::{self, Quaternion};
use crate::vestibular::{BalanceError, Fault, Noise, Settings, Stream};
use crate::vision::VisionError;
use nalgebra::{Matrix3, Rotation3, Vector3};
use std::collections::BTreeMap;
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
    /// Pictures of the left camera without one of the right.
    pub unpaired: usize,
    /// In order of time.
    pub inertial: Vec<Inertial>,
}

impl Recording {
    /// Reads the recording in a folder.
    ///
    /// # Errors
    /// A file or folder that is missing; readings of more than 256 MiB; a row that is not seven numbers; fewer than two frames.
    pub fn read(folder: &Path) -> Result<Self, Error> {
        let wrong = |path: &Path, reason: String| VisionError::File { path: path.to_path_buf(), reason };
        let cameras = ["cam0", "cam1"].map(|camera| {
            let (inner, outer) = (folder.join(camera).join("data"), folder.join(camera));
            if inner.is_dir() { inner } else { outer }
        });
        let failed = |path: &Path| {
            let path = path.to_path_buf();
            move |source| VisionError::Read { path, source }
        };
        let (mut frames, mut unpaired) = (Vec::new(), 0);
        for entry in std::fs::read_dir(&cameras[0]).map_err(failed(&cameras[0]))? {
            let left = entry.map_err(failed(&cameras[0]))?.path();
            let time = left.file_stem().and_then(|stem| stem.to_string_lossy().parse::<i64>().ok());
            let Some((time, name)) = time.zip(left.file_name()) else { continue };
            let right = cameras[1].join(name);
            if right.is_file() {
                frames.push((time, left, right));
            } else {
                unpaired += 1;
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
        Ok(Self { frames, unpaired, inertial: inertial(&text).map_err(|reason| wrong(path, reason))? })
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

/// A frame whose last inertial reading is older, s, has no orientation of its own.
const LATE_S: f64 = 0.03;

/// The rotation of the body: the filter of `models/inertial.bp`, with its clock ([`Stream`]).
///
/// The body is taken to be at rest before the first frame: the readings until then show the bias of the gyroscope and the vertical.
#[derive(Clone, Debug)]
pub struct Posture {
    stream: Stream,
    /// The direction of the gaze, in the body's frame, and its azimuth at the first frame: 0 in the map.
    ahead: Vector3<f64>,
    first: f64,
    /// Of the last reading.
    time: i64,
    /// The rows so far, and those with each event.
    rows: u64,
    events: BTreeMap<&'static str, u64>,
    /// The orientation at the time that was asked for last.
    orientation: Quaternion,
}

impl Posture {
    /// At rest at the time of the first frame; `ahead` is the direction of the gaze in the body's frame.
    ///
    /// # Errors
    /// No reading of the sensor before the first frame.
    pub fn at_rest(recording: &Recording, ahead: Vector3<f64>) -> Result<Self, Error> {
        let begin = recording.frames[0].0;
        let before = recording.inertial.iter().take_while(|row| row.time < begin);
        let Some(first) = recording.inertial.first().filter(|row| row.time < begin) else {
            let (path, reason) =
                (recording.frames[0].1.clone(), "there is no inertial reading before this frame".to_owned());
            return Err(VisionError::File { path, reason }.into());
        };
        let stream = Stream::new(Settings::default());
        let (time, orientation) = (first.time, stream.filter().orientation());
        let events = BTreeMap::new();
        let mut posture = Self { stream, ahead, first: 0.0, time, rows: 0, events, orientation };
        for row in before {
            let seconds = posture.feel(row)?;
            posture.stream.still(row.angular_velocity.into(), seconds.max(1e-4));
        }
        posture.orientation = posture.stream.filter().orientation();
        posture.first = posture.azimuth();
        Ok(posture)
    }

    /// Processes an inertial reading; one that is not after the last is known already, and ignored. Returns the seconds since the
    /// reading before.
    ///
    /// # Errors
    /// The program's own checks.
    pub fn feel(&mut self, row: &Inertial) -> Result<f64, Error> {
        if self.rows > 0 && row.time <= self.time {
            return Ok(0.0);
        }
        self.rows += 1;
        let (rate, force) = (Some(row.angular_velocity.into()), Some(row.specific_force.into()));
        let row = Row { number: self.rows, time: row.time, rate, force };
        let instants = self.stream.feel(row).map_err(|fault| match fault {
            Fault::Program(error) => error,
            Fault::Clock(reason) => BalanceError::File { path: PathBuf::from("imu0.csv"), reason }.into(),
        })?;
        for name in instants.iter().flat_map(|instant| instant.events.names()) {
            *self.events.entry(name).or_default() += 1;
        }
        let seconds = (row.time - self.time) as f64 * 1e-9;
        (self.time, self.orientation) = (row.time, self.stream.filter().orientation());
        Ok(seconds)
    }

    /// Turns the estimate on to the stamp of a frame, by the last rate. Returns the age of the last reading, s: if it is more than
    /// [`Posture::is_late`] allows, the orientation is held.
    pub fn turn_to(&mut self, time: i64) -> f64 {
        let age = (time - self.time) as f64 * 1e-9;
        let filter = self.stream.filter();
        self.orientation = filter.orientation();
        if !Self::is_late(age) {
            let turn = rotation::from_vector(filter.estimate().rate.map(|rate| age * rate));
            self.orientation = rotation::normalised(rotation::product(self.orientation, turn));
        }
        age
    }

    /// Whether a reading of this age, s, is too old for a frame.
    pub fn is_late(age: f64) -> bool {
        age > LATE_S
    }

    /// The deviation of the yaw at an age of the last reading, rad: beyond [`Posture::is_late`] it grows by the prior of rates.
    pub fn yaw_deviation(&self, age: f64) -> f64 {
        let unseen = if Self::is_late(age) { age * Noise::default().omega } else { 0.0 };
        self.stream.filter().rotation_covariance()[2][2].max(0.0).sqrt().hypot(unseen)
    }

    /// The inertial rows so far with each event: gaps, clipped readings.
    pub fn events(&self) -> &BTreeMap<&'static str, u64> {
        &self.events
    }

    /// The estimated yaw, radians to the left.
    pub fn yaw(&self) -> f64 {
        wrap_angle(self.azimuth() - self.first)
    }

    /// The rotation from a frame that is turned to the body's by `to_body` into the map's, in which the azimuth of the first
    /// frame is 0.
    pub fn to_map(&self, to_body: &Rotation3<f64>) -> Matrix3<f64> {
        let world = Matrix3::from(rotation::matrix(self.orientation)).transpose();
        Rotation3::from_axis_angle(&Vector3::z_axis(), -self.first).matrix() * world * to_body.matrix()
    }

    fn in_world(&self, body: Vector3<f64>) -> [f64; 3] {
        rotation::apply(&rotation::matrix(self.orientation), body.into())
    }

    fn azimuth(&self) -> f64 {
        Spherical::from_cartesian(self.in_world(self.ahead)).azimuth
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::angles;

    /// A body that rests for 0.1 s with a bias of 0.3 rad/s about every axis, then turns about the vertical (its x axis).
    fn turning(rate: f64) -> Recording {
        let row = |step: i64| {
            let turn = if step > 20 { rate } else { 0.0 };
            let angular_velocity = Vector3::new(0.3 + turn, 0.3, 0.3);
            Inertial { time: step * 5_000_000, angular_velocity, specific_force: Vector3::new(9.8, 0.0, 0.0) }
        };
        let frames = [20i64, 120].map(|step| (step * 5_000_000, PathBuf::from("l"), PathBuf::from("r")));
        Recording { frames: frames.to_vec(), unpaired: 0, inertial: (0..=120).map(row).collect() }
    }

    #[test]
    fn half_a_second_of_turning() {
        let recording = turning(-0.8);
        let mut posture = Posture::at_rest(&recording, Vector3::z()).unwrap();
        recording.inertial.iter().for_each(|row| {
            posture.feel(row).unwrap();
        });
        // −0.8 rad/s about the vertical for 0.5 s is −0.4 rad, to the right.
        assert!((posture.yaw() + 0.4).abs() < 1e-3, "{}", posture.yaw());
        // What is ahead of the turned head is on the right of the map, and level; y of the body is to its left then.
        let seen = |body: Vector3<f64>| angles((posture.to_map(&Rotation3::identity()) * body).into());
        let (azimuth, elevation) = seen(Vector3::z());
        assert!((azimuth + 0.4).abs() < 1e-3 && elevation.abs() < 1e-3, "{azimuth} {elevation}");
        let (azimuth, _) = seen(-Vector3::y());
        assert!((azimuth - (std::f64::consts::FRAC_PI_2 - 0.4)).abs() < 1e-3, "{azimuth}");
    }

    #[test]
    fn a_frame_between_two_readings_or_after_the_last() {
        let recording = turning(-0.8);
        let mut posture = Posture::at_rest(&recording, Vector3::z()).unwrap();
        recording.inertial.iter().for_each(|row| {
            posture.feel(row).unwrap();
        });
        let end = recording.inertial[120].time;
        // 4 ms later the turn goes on at -0.8 rad/s.
        let (before, age) = (posture.yaw(), posture.turn_to(end + 4_000_000));
        assert!(
            !Posture::is_late(age) && (posture.yaw() - before + 0.0032).abs() < 1e-4,
            "{}",
            posture.yaw()
        );
        let known = posture.yaw_deviation(age);
        // Half a second without readings: held, with 0.35 rad of deviation from the prior of 0.7 rad/s.
        let age = posture.turn_to(end + 500_000_000);
        assert!(Posture::is_late(age) && posture.yaw() == before);
        assert!((posture.yaw_deviation(age) - known.hypot(0.5 * Noise::default().omega)).abs() < 1e-9);
        // The readings come back: a gap, and the deviation stays.
        assert!(
            posture.events().is_empty(),
            "the rows before the first frame came twice: {:?}",
            posture.events()
        );
        let late = Inertial { time: end + 600_000_000, ..recording.inertial[120] };
        posture.feel(&late).unwrap();
        assert_eq!(posture.events().get("gap"), Some(&1));
        assert!(posture.yaw_deviation(0.0) > 0.3);
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
