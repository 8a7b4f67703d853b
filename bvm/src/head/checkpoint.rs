//! What a run leaves behind so that it can be resumed.
//!
//! In: a head and the looks so far. Out: a file: one line of JSON, then numbers, little-endian: for each look the next gaze
//! (azimuth and elevation, f64), the counts of looks and of readings of each direction (u16), and the numbers of the map
//! and of the senses' memories (f32). Invariant: the file is whole or the one before; a resumed run gives the same map, bit by bit, as one that was not
//! interrupted.

use super::{Coverage, Head, Look, Policy};
use crate::error::Error;
use crate::report::write_atomically;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Time between two writings.
const EVERY: Duration = Duration::from_millis(1500);
/// The version of the file.
const VERSION: u32 = 2;

/// What a run was asked to do, except for its length.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Settings {
    /// The scene.
    pub scene: String,
    /// A checksum of the scene: a file may have been changed.
    pub checksum: String,
    /// The seed.
    pub seed: u64,
    /// The senses.
    pub senses: String,
    /// The policy.
    pub policy: String,
    /// The kind of evidence.
    pub evidence: String,
}

#[derive(Serialize, Deserialize)]
struct Header {
    version: u32,
    settings: Settings,
    directions: usize,
    numbers: usize,
    /// The length of each sense's memory.
    memories: Vec<usize>,
    looks: Vec<Look>,
}

/// The file of a run.
#[derive(Clone, Debug)]
pub struct Checkpoint {
    path: PathBuf,
    settings: Settings,
    written: Instant,
}

impl Checkpoint {
    /// The checkpoint of a run in a folder.
    pub fn new(folder: &Path, settings: Settings) -> Self {
        let path = folder.join(format!("checkpoint-{}.bvm", settings.policy.replace(' ', "-")));
        Self { path, settings, written: Instant::now() }
    }

    /// Whether the last writing is long enough ago.
    pub fn is_due(&self) -> bool {
        self.written.elapsed() > EVERY
    }

    /// Writes the file.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&mut self, head: &Head, looks: &[Look]) -> Result<(), Error> {
        let numbers = head.map().numbers();
        let (seen, readings) = head.coverage().counts();
        let memories = head.memories();
        let header = Header {
            version: VERSION,
            settings: self.settings.clone(),
            directions: seen.len(),
            numbers: numbers.len(),
            memories: memories.iter().map(Vec::len).collect(),
            looks: looks.to_vec(),
        };
        let mut bytes = serde_json::to_vec(&header).expect("internal: looks are numbers and names");
        bytes.push(b'\n');
        for look in looks {
            bytes.extend(look.next.azimuth.to_le_bytes());
            bytes.extend(look.next.elevation.to_le_bytes());
        }
        seen.iter().chain(readings).for_each(|count| bytes.extend(count.to_le_bytes()));
        let all = numbers.iter().chain(memories.iter().flatten());
        all.for_each(|number| bytes.extend(number.to_le_bytes()));
        write_atomically(&self.path, &bytes)?;
        self.written = Instant::now();
        Ok(())
    }

    /// Removes the file, if there is one: the run is complete.
    pub fn remove(&self) {
        let _ = std::fs::remove_file(&self.path);
    }

    /// Brings a new head and a new policy to the end of the run of the file; returns its looks. Without a file nothing is
    /// done, and there are none.
    ///
    /// # Errors
    /// A file that is none of this version, or of a run with other settings.
    pub fn resume(&self, head: &mut Head, policy: &mut dyn Policy) -> Result<Vec<Look>, Error> {
        let refuse = |reason: String| Error::Checkpoint { path: self.path.clone(), reason };
        let bytes = match std::fs::read(&self.path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
            Err(error) => return Err(refuse(error.to_string())),
        };
        let broken =
            || refuse(String::from("not a checkpoint of this version: start again without --resume"));
        let end = bytes.iter().position(|byte| *byte == b'\n').ok_or_else(broken)?;
        let mut header: Header = serde_json::from_slice(&bytes[..end]).map_err(|_| broken())?;
        if header.version != VERSION {
            return Err(broken());
        }
        if header.settings != self.settings {
            let written = |settings: &Settings| {
                let Settings { scene, seed, senses, evidence, .. } = settings;
                format!("scene {scene}, seed {seed}, senses {senses}, evidence {evidence}")
            };
            let changed = if written(&header.settings) == written(&self.settings) {
                String::from("the scene file has changed since")
            } else {
                format!(
                    "it is of a run with {}, not with {}",
                    written(&header.settings),
                    written(&self.settings)
                )
            };
            return Err(refuse(changed));
        }
        let mut rest = Numbers { bytes: &bytes[end + 1..] };
        for look in &mut header.looks {
            look.next.azimuth = f64::from_le_bytes(rest.take().ok_or_else(broken)?);
            look.next.elevation = f64::from_le_bytes(rest.take().ok_or_else(broken)?);
        }
        let mut counts = || -> Option<Vec<u16>> {
            (0..header.directions).map(|_| Some(u16::from_le_bytes(rest.take()?))).collect()
        };
        let (seen, readings) = (counts().ok_or_else(broken)?, counts().ok_or_else(broken)?);
        let mut floats = |count: usize| -> Option<Vec<f32>> {
            (0..count).map(|_| Some(f32::from_le_bytes(rest.take()?))).collect()
        };
        let numbers = floats(header.numbers);
        let memories: Option<Vec<Vec<f32>>> = header.memories.iter().map(|count| floats(*count)).collect();
        let map = head.map().with_numbers(&numbers.ok_or_else(broken)?).ok_or_else(broken)?;
        for look in &header.looks {
            head.repeat(look, policy)?;
        }
        let coverage = head.coverage().with_counts(seen, readings).ok_or_else(broken)?;
        head.restore(map, coverage, &memories.ok_or_else(broken)?);
        Ok(header.looks)
    }
}

/// Numbers at the front of some bytes.
struct Numbers<'b> {
    bytes: &'b [u8],
}

impl Numbers<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (first, rest) = self.bytes.split_first_chunk::<N>()?;
        self.bytes = rest;
        Some(*first)
    }
}

impl Coverage {
    /// The same with other counts; `None` if they are not one for each direction.
    fn with_counts(&self, looks: Vec<u16>, readings: Vec<u16>) -> Option<Self> {
        let fits = looks.len() == self.looks.len() && readings.len() == self.readings.len();
        fits.then(|| Self { reaches: self.reaches.clone(), looks, readings })
    }
}
