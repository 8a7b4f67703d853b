//! A recording of a run: MCAP with ROS 2 messages.
//!
//! In: the map and the record of each look. Out: a file that Foxglove, rviz2 and `ros2 bag` read: the occupied cells of
//! the map with their velocities (`/map`), transforms (`/tf`), gazes (`/gaze`, `/next_gaze`) and entropies. Invariant:
//! the chunk of a look is closed with it; log time and stamp are the world's time.

use super::{Point, ros};
use crate::head::{Gaze, Look};
use crate::report::ReportError;
use crate::vestibular::rotation;
use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions, Writer};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// The stamp of time 0: a stamp of 0 means "now" to tf2.
const BEGIN_NS: u64 = 1_000_000_000;

/// A recording that is being written.
pub struct Recorder {
    path: PathBuf,
    writer: Writer<BufWriter<File>>,
    channels: BTreeMap<&'static str, u16>,
    sequence: u32,
}

/// Topics with their messages.
const TOPICS: [(&str, &ros::Schema); 6] = [
    ("/map", &ros::CLOUD),
    ("/tf", &ros::TRANSFORMS),
    ("/gaze", &ros::POSE),
    ("/next_gaze", &ros::POSE),
    ("/entropy", &ros::NUMBER),
    ("/occupancy_entropy", &ros::NUMBER),
];

impl Recorder {
    /// Begins a recording; an earlier file is replaced.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn new(path: &Path) -> Result<Self, ReportError> {
        let failed = |source| ReportError::Write { path: path.to_owned(), source };
        let file = BufWriter::new(File::create(path).map_err(failed)?);
        let options = WriteOptions::new().profile("ros2").compression(Some(Compression::Zstd));
        let mut writer = options.create(file).map_err(|error| failed(std::io::Error::other(error)))?;
        let mut channels = BTreeMap::new();
        for (topic, schema) in TOPICS {
            let added = writer
                .add_schema(schema.name, "ros2msg", schema.definition.as_bytes())
                .and_then(|id| writer.add_channel(id, topic, "cdr", &BTreeMap::new()));
            channels.insert(topic, added.map_err(|error| failed(std::io::Error::other(error)))?);
        }
        Ok(Self { path: path.to_owned(), writer, channels, sequence: 0 })
    }

    /// Adds a look, and closes its chunk.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn add(&mut self, look: &Look, points: &[Point]) -> Result<(), ReportError> {
        let stamp = BEGIN_NS + (look.time_s * 1e9).round() as u64;
        let attitude = of_matrix(&look.attitude.matrix());
        let mut scene = vec![("map", "head", [0.0; 3], attitude)];
        if let Some(truth) = look.truth {
            scene.push(("map", "true_head", [0.0; 3], of_matrix(&truth.matrix())));
        }
        let facing = |gaze: &Gaze| {
            let turned =
                crate::head::Attitude { yaw: gaze.azimuth, pitch: gaze.elevation, ..Default::default() };
            ros::pose(stamp, "map", [0.0; 3], of_matrix(&turned.matrix()))
        };
        let number = |value: f64| {
            let mut cdr = ros::Cdr::new();
            cdr.f64(value);
            cdr.finish()
        };
        for (topic, data) in [
            ("/map", ros::cloud(stamp, "map", points)),
            ("/tf", ros::transforms(stamp, &scene)),
            ("/gaze", facing(&look.gaze)),
            ("/next_gaze", facing(&look.next)),
            ("/entropy", number(look.entropy)),
            ("/occupancy_entropy", number(look.occupancy_entropy)),
        ] {
            let channel_id = self.channels[topic];
            let header =
                MessageHeader { channel_id, sequence: self.sequence, log_time: stamp, publish_time: stamp };
            let written = self.writer.write_to_known_channel(&header, &data);
            written.map_err(|error| self.failed(error))?;
        }
        self.sequence += 1;
        self.writer.flush().map_err(|error| self.failed(error))
    }

    /// Ends the recording: its index is written.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn finish(mut self) -> Result<(), ReportError> {
        let finished = self.writer.finish().map(|_| ());
        finished.map_err(|error| self.failed(error))
    }

    fn failed(&self, error: mcap::McapError) -> ReportError {
        ReportError::Write { path: self.path.clone(), source: std::io::Error::other(error) }
    }
}

/// A rotation as x, y, z, w.
fn of_matrix(matrix: &rotation::Matrix) -> ros::Quaternion {
    let rows = nalgebra::Matrix3::from_fn(|row, column| matrix[row][column]);
    let turned = nalgebra::UnitQuaternion::from_matrix(&rows);
    [turned.i, turned.j, turned.k, turned.w]
}
