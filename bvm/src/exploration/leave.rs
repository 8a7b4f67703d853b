//! What a run leaves beside its pictures: a page, the map in the files of other programs.
//!
//! In: the episodes, and what was kept of the first. Out: `report.html`, `map.ply`, `map.bt`, `map.ot`, and with the
//! feature `recording` `run.mcap`. Invariant: each file is written whole or not at all, but for the recording, which grows
//! look by look.

use super::Episode;
use super::page::{Frames, page};
use crate::error::Error;
#[cfg(feature = "recording")]
use crate::export::Recorder;
use crate::export::{Octree, Point, RESOLUTION_M, points, write_ply};
use crate::head::{Look, depth};
use crate::map::Map;
use crate::report::write_atomically;
use std::path::{Path, PathBuf};

/// The files that every run writes under the same names.
const LEFT: [&str; 12] = [
    "run.json",
    "report.html",
    "map.ply",
    "map.bt",
    "map.ot",
    "entropy.png",
    "entropy_of_occupancy.png",
    "occupancy_panorama.png",
    "entropy_panorama.png",
    "gaze_path.png",
    "top_view.png",
    "cameras.png",
];

/// Whether a name is that of a checkpoint.
fn is_checkpoint(name: &str) -> bool {
    name.starts_with("checkpoint-") && name.ends_with(".bvm")
}

/// Whether a name is that of a checkpoint or of a recording, of which there may be several.
fn is_numbered(name: &str) -> bool {
    is_checkpoint(name) || name == "run.mcap" || name.starts_with("run_") && name.ends_with(".mcap")
}

/// The file of the recording: of a resumed run the first that does not exist yet.
#[cfg(feature = "recording")]
fn recording(folder: &Path, resumed: bool) -> PathBuf {
    let names = (1..).map(|number| match number {
        1 => folder.join("run.mcap"),
        number => folder.join(format!("run_{number}.mcap")),
    });
    let mut free = names.filter(|path| !resumed || !path.exists());
    free.next().expect("internal: the numbers do not end")
}

/// What is kept of a run while it goes on: panoramas, and the recording of its looks.
pub struct Record {
    frames: Frames,
    #[cfg(feature = "recording")]
    recording: (Recorder, PathBuf),
    fault: Option<Error>,
}

impl Record {
    /// The record of a run of so many looks, in a folder, which is made. A resumed run leaves the recording of its
    /// first part as it is, and begins another.
    ///
    /// # Errors
    /// A folder or file that cannot be written.
    pub fn new(folder: &Path, steps: usize, resumed: bool) -> Result<Self, Error> {
        std::fs::create_dir_all(folder)
            .map_err(|source| Error::Folder { path: folder.to_owned(), source })?;
        #[cfg(feature = "recording")]
        let recording = {
            let path = recording(folder, resumed);
            (Recorder::new(&path)?, path)
        };
        #[cfg(not(feature = "recording"))]
        let _ = resumed;
        Ok(Self {
            frames: Frames::of(steps),
            #[cfg(feature = "recording")]
            recording,
            fault: None,
        })
    }

    /// Removes what an earlier run left in a folder, so that its files do not pass for those of the next one. A folder without
    /// a run's own files is left as it is, and so are files of other names.
    ///
    /// # Errors
    /// A file that cannot be removed.
    pub fn clear(folder: &Path) -> Result<(), Error> {
        let failed = |source| Error::Folder { path: folder.to_owned(), source };
        let Ok(entries) = std::fs::read_dir(folder) else { return Ok(()) };
        let names: Vec<String> =
            entries.flatten().filter_map(|entry| entry.file_name().into_string().ok()).collect();
        if !names.iter().any(|name| name == "run.json" || is_checkpoint(name)) {
            return Ok(());
        }
        let of_a_run = |name: &&String| LEFT.contains(&name.as_str()) || is_numbered(name);
        for name in names.iter().filter(of_a_run) {
            let path = folder.join(name);
            if path.is_file() {
                std::fs::remove_file(&path).map_err(failed)?;
            }
        }
        Ok(())
    }

    /// Adds a look. An error is kept for [`Record::leave`], so that the run goes on.
    pub fn add(&mut self, map: &Map, look: &Look) {
        let added = self.frames.add(map, look);
        #[cfg(feature = "recording")]
        let added = added.and_then(|()| self.recording.0.add(look, &cells(map)));
        if let Err(error) = added {
            self.fault.get_or_insert(error.into());
        }
    }

    /// Ends the recording and writes the other files; returns the paths of all.
    ///
    /// # Errors
    /// A file that could not be written, also while the run went on.
    pub fn leave(mut self, folder: &Path, title: &str, episodes: &[Episode]) -> Result<Vec<PathBuf>, Error> {
        if let Some(fault) = self.fault {
            return Err(fault);
        }
        let mut paths = Vec::new();
        #[cfg(feature = "recording")]
        let recorded = {
            let (recorder, path) = self.recording;
            recorder.finish()?;
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            paths.push(path);
            format!("{name} (ROS 2 messages, for Foxglove or rviz2), ")
        };
        #[cfg(not(feature = "recording"))]
        let recorded = "";
        let Some(first) = episodes.first() else { return Ok(paths) };
        let [html, ply, bt, ot] =
            ["report.html", "map.ply", "map.bt", "map.ot"].map(|name| folder.join(name));
        let (points, tree) = (cells(&first.map), Octree::of(&first.map, RESOLUTION_M));
        write_ply(&ply, &points)?;
        tree.write_bt(&bt)?;
        tree.write_ot(&ot)?;
        let beside = format!(
            "Beside this page: run.json (all figures), pictures (PNG), {recorded}map.ply (occupied cells), map.bt and \
             map.ot (OctoMap, {RESOLUTION_M} m)."
        );
        self.frames.end(&first.map, first.looks.len())?;
        if let Some(page) = page(title, &beside, episodes, &self.frames, &points) {
            write_atomically(&html, page.as_bytes())?;
            paths.push(html);
        }
        paths.extend([ply, bt, ot]);
        Ok(paths)
    }
}

fn cells(map: &Map) -> Vec<Point> {
    points(map, depth::STEP_S)
}
