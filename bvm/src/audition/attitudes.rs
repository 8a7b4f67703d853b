//! How the head was turned while it listened.
//!
//! In: a table of headings or of orientations (CSV), or the recording of an inertial sensor (`models/inertial.bp`). Out: the
//! orientation at any time, later and later. Invariant: memory does not grow with the length of the file; a time that the
//! file does not reach is an error.

use super::error::AuditionError;
use crate::error::Error;
use crate::vestibular::reader::{Format, Reader};
use crate::vestibular::rotation::{self, Quaternion};
use crate::vestibular::{Fault, Settings, Stream};
use std::collections::VecDeque;
use std::fs::File;
use std::io::{BufRead, BufReader, Lines};
use std::path::{Path, PathBuf};

/// A file may end this much before the sound, s.
const LATE_S: f64 = 0.1;
/// Names of columns.
const TIMES: [&str; 4] = ["time_s", "t_s", "t [s]", "time [s]"];
const HEADINGS: [(&str, f64); 6] = [
    ("heading_deg", 1.0),
    ("yaw_deg", 1.0),
    ("azimuth_deg", 1.0),
    ("heading_degrees", 1.0),
    ("yaw_degrees", 1.0),
    ("heading_rad", 180.0 / std::f64::consts::PI),
];
const ORIENTATION: [&str; 4] = ["qw", "qx", "qy", "qz"];

/// Rows of a table.
struct Rows {
    lines: Lines<BufReader<File>>,
    number: usize,
    time: usize,
    turn: Columns,
}

enum Columns {
    Heading(usize, f64),
    Orientation([usize; 4]),
}

/// Where orientations come from.
enum Source {
    Table(Rows),
    Inertial {
        reader: Box<Reader<BufReader<File>>>,
        stream: Box<Stream>,
        ready: VecDeque<(f64, Quaternion)>,
        begun_ns: Option<i64>,
        is_over: bool,
    },
}

/// The orientation of the head over time: from its axes to those of the map.
pub struct Attitudes {
    path: PathBuf,
    source: Source,
    /// The time on the clock of the file at which the sound begins, s.
    start_s: f64,
    before: (f64, Quaternion),
    after: Option<(f64, Quaternion)>,
}

impl Attitudes {
    /// Headings (`time_s`, and `heading_deg` to the left) or orientations (`t_s`, `qw`, `qx`, `qy`, `qz`, as `bvm balance` writes
    /// them) by time. The sound begins at `start_s` on the clock of the table.
    ///
    /// # Errors
    /// A file that cannot be read, or has no such columns.
    pub fn of_table(path: &Path, start_s: f64) -> Result<Attitudes, Error> {
        let file =
            File::open(path).map_err(|source| AuditionError::Read { path: path.to_path_buf(), source })?;
        let refuse = |reason: String| AuditionError::File { path: path.to_path_buf(), reason };
        let mut lines = BufReader::new(file).lines();
        let header = match lines.next() {
            Some(Ok(line)) => line.trim_start_matches('\u{feff}').to_lowercase(),
            Some(Err(source)) => return Err(AuditionError::Read { path: path.to_path_buf(), source }.into()),
            None => return Err(refuse("the file is empty".to_owned()).into()),
        };
        let names: Vec<&str> = header.split(',').map(str::trim).collect();
        let place = |name: &str| names.iter().position(|own| *own == name);
        let time = TIMES.iter().find_map(|name| place(name));
        let heading = HEADINGS.iter().find_map(|(name, size)| Some(Columns::Heading(place(name)?, *size)));
        let parts = ORIENTATION.map(place);
        let orientation = match parts {
            [Some(w), Some(x), Some(y), Some(z)] => Some(Columns::Orientation([w, x, y, z])),
            _ => None,
        };
        let Some((time, turn)) = time.zip(heading.or(orientation)) else {
            return Err(refuse(format!(
                "the columns are `{header}`: expected `time_s` and `heading_deg` (positive to the left), or `t_s`, `qw`, `qx`, `qy`, `qz`"
            ))
            .into());
        };
        Attitudes::begun(path, Source::Table(Rows { lines, number: 1, time, turn }), start_s)
    }

    /// The orientation of an inertial sensor whose axes are those of the head. The sound begins `start_s` after the first row.
    ///
    /// # Errors
    /// A file that cannot be read, or is no recording of an inertial sensor.
    pub fn of_inertial(path: &Path, start_s: f64) -> Result<Attitudes, Error> {
        let reader = Box::new(Reader::open(path, Format::default())?);
        let stream = Box::new(Stream::new(Settings::default()));
        let source =
            Source::Inertial { reader, stream, ready: VecDeque::new(), begun_ns: None, is_over: false };
        Attitudes::begun(path, source, start_s)
    }

    fn begun(path: &Path, source: Source, start_s: f64) -> Result<Attitudes, Error> {
        let unknown = (f64::NEG_INFINITY, [1.0, 0.0, 0.0, 0.0]);
        let mut found = Attitudes { path: path.to_path_buf(), source, start_s, before: unknown, after: None };
        let Some(first) = found.next()? else { return Err(found.refuse("there are no rows".to_owned())) };
        found.before = first;
        found.after = found.next()?;
        Ok(found)
    }

    /// The orientation at a time of the sound, s; times do not go back.
    ///
    /// # Errors
    /// A row that cannot be used; a time that the file does not reach.
    pub fn at(&mut self, sound_s: f64) -> Result<Quaternion, Error> {
        let time_s = self.start_s + sound_s;
        if time_s < self.before.0 - LATE_S {
            return Err(self.refuse(format!(
                "begins at {:.3} s, after the sound, which is at {time_s:.3} s: see --audio-start",
                self.before.0
            )));
        }
        while let Some(after) = self.after.filter(|after| after.0 <= time_s) {
            self.before = after;
            self.after = self.next()?;
        }
        let Some(after) = self.after else {
            if time_s > self.before.0 + LATE_S {
                return Err(self.refuse(format!(
                    "ends at {:.3} s, before the sound, which is at {time_s:.3} s",
                    self.before.0
                )));
            }
            return Ok(self.before.1);
        };
        let share = ((time_s - self.before.0) / (after.0 - self.before.0)).clamp(0.0, 1.0);
        let (one, other) = (self.before.1, after.1);
        let sign = if one.iter().zip(&other).map(|(a, b)| a * b).sum::<f64>() < 0.0 { -1.0 } else { 1.0 };
        Ok(rotation::normalised(std::array::from_fn(|at| (1.0 - share) * one[at] + share * sign * other[at])))
    }

    fn refuse(&self, reason: String) -> Error {
        AuditionError::File { path: self.path.clone(), reason }.into()
    }

    fn next(&mut self) -> Result<Option<(f64, Quaternion)>, Error> {
        let next = match &mut self.source {
            Source::Table(rows) => match rows.next() {
                Ok(next) => next,
                Err(reason) => return Err(self.refuse(reason)),
            },
            Source::Inertial { reader, stream, ready, begun_ns, is_over } => {
                while ready.is_empty() && !*is_over {
                    let instants = match reader.next_row()? {
                        Some(row) => stream.feel(row).map_err(|fault| match fault {
                            Fault::Clock(reason) => reader.refusal(reason).into(),
                            Fault::Program(error) => error,
                        })?,
                        None => {
                            *is_over = true;
                            stream.finish()?
                        }
                    };
                    for instant in instants {
                        let since = instant.time - *begun_ns.get_or_insert(instant.time);
                        ready.push_back((since as f64 * 1e-9, instant.estimate.orientation));
                    }
                }
                ready.pop_front()
            }
        };
        if let Some((time_s, _)) = next.filter(|(time_s, _)| *time_s < self.before.0) {
            return Err(self.refuse(format!("the clock runs back at {time_s:.3} s")));
        }
        Ok(next)
    }
}

impl Rows {
    fn next(&mut self) -> Result<Option<(f64, Quaternion)>, String> {
        let line = loop {
            self.number += 1;
            match self.lines.next() {
                None => return Ok(None),
                Some(Err(error)) => return Err(format!("line {}: {error}", self.number)),
                Some(Ok(line)) if line.trim().is_empty() => {}
                Some(Ok(line)) => break line,
            }
        };
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        let number = |at: usize| {
            let cell = cells.get(at).copied().unwrap_or("");
            let value = cell.parse::<f64>().ok().filter(|value| value.is_finite());
            value.ok_or_else(|| format!("line {}: `{cell}` is not a number", self.number))
        };
        let time_s = number(self.time)?;
        let turn = match self.turn {
            Columns::Heading(at, size) => {
                let half = 0.5 * (size * number(at)?).to_radians();
                [half.cos(), 0.0, 0.0, half.sin()]
            }
            Columns::Orientation([w, x, y, z]) => {
                let found = [number(w)?, number(x)?, number(y)?, number(z)?];
                let length = found.iter().map(|part| part * part).sum::<f64>().sqrt();
                if (length - 1.0).abs() > 0.01 {
                    return Err(format!("line {}: a quaternion of length {length:.3}", self.number));
                }
                rotation::normalised(found)
            }
        };
        Ok(Some((time_s, turn)))
    }
}
