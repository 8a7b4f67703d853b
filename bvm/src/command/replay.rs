//! `bvm replay`: builds a map from a recording.
//!
//! In: a folder of stereo frames and inertial readings (EuRoC); with `--poses`, the places of the body. Out: the map's pictures, a
//! strip of frames, and `replay.json`. Each frame is rectified, matched and read; balance estimates the orientation; the cell
//! filter predicts and estimates. Where places are given, the map follows the head; otherwise its translation is ignored. While
//! one frame is in the map, the next one is matched and the one after it read.
//! Invariant: frames are taken in order of time, and the map predicts the instants of frames that are missing.

mod pictures;
mod timing;

use super::look::StereoOptions;
use super::{check_folder, print};
use bvm::error::Error;
use bvm::frame::{DESCRIPTION, angles};
use bvm::grid::{Grid, GridConfiguration};
use bvm::map::Map;
use bvm::recording::{Posture, Recording};
use bvm::report::write_atomically;
use bvm::vision::calibration::raw::RawPair;
use bvm::vision::image;
use bvm::vision::readings::pixel_readings;
use bvm::vision::{
    DisparityMap, EvidenceKind, FrameEvidence, HiddenCells, Pair, Population, Sight, ViewReadings,
    VisionError,
};
use clap::Args;
use indicatif::ProgressBar;
use nalgebra::Vector3;
use pictures::{ACROSS, Tile, tile};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::mpsc::sync_channel;
use timing::{Counts, Now, Timing};

/// Build a map from a recording, frame by frame.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  bvm replay --recording V1_01_easy/mav0 --out replay\n  bvm replay --recording V1_01_easy/mav0 \\\n    --poses V1_01_easy/mav0/state_groundtruth_estimate0/data.csv"
)]
pub(crate) struct Arguments {
    /// Folder with cam0, cam1 and imu0.csv (EuRoC).
    #[arg(long, value_name = "FOLDER")]
    recording: PathBuf,
    #[command(flatten)]
    stereo: StereoOptions,
    /// Prior of the hidden cells of a line of sight.
    #[arg(
        long,
        value_name = "NAME",
        value_enum,
        default_value_t,
        hide_possible_values = true,
        help = "Prior of the hidden cells of a line of sight:\noccupied with probability ½ (uniform), or the map\nbefore the frame (map)"
    )]
    hidden: HiddenName,
    /// Places of the body over time (EuRoC's ground truth).
    #[arg(
        long,
        value_name = "FILE",
        help = "Places of the body over time: CSV of ns, position\n(m), quaternion (EuRoC's ground truth); the map\nfollows them"
    )]
    poses: Option<PathBuf>,
    /// Output folder.
    #[arg(long, value_name = "FOLDER", default_value = "bvm-replay")]
    out: PathBuf,
    /// Print the figures as JSON.
    #[arg(long)]
    json: bool,
}

/// [`Hidden`], as an argument.
#[derive(Clone, Copy, Default, clap::ValueEnum)]
pub(crate) enum HiddenName {
    #[default]
    Uniform,
    Map,
}

impl From<HiddenName> for HiddenCells {
    fn from(name: HiddenName) -> Self {
        match name {
            HiddenName::Uniform => HiddenCells::Uniform,
            HiddenName::Map => HiddenCells::Map,
        }
    }
}

#[derive(Serialize)]
struct Frame {
    time_ns: i64,
    /// Instants of the map since the frame before: more than one where frames are missing.
    instants: i64,
    /// Age of the last inertial reading.
    inertial_age_ms: f64,
    density: f64,
    readings: usize,
    /// Positive to the left.
    yaw_degrees: f64,
    sd_yaw_degrees: f64,
    /// How far the map has followed the head, m, in its own axes; none without a place.
    place_m: Option<[f64; 3]>,
    /// Mean entropy of the occupancy of all cells, nats.
    entropy: f64,
}

#[derive(Serialize)]
struct Figures {
    /// Axes and angles of the map.
    frame: &'static str,
    grid: GridConfiguration,
    clock: Counts,
    frames: Vec<Frame>,
}

/// Nearest and farthest cell edges, metres.
const REACH_M: [f64; 2] = [0.8, 8.0];
/// Size of a cell in azimuth and in elevation, degrees.
const CELL_DEGREES: usize = 1;

pub(crate) fn run(arguments: &Arguments) -> Result<(), Error> {
    let recording = Recording::read(&arguments.recording)?;
    let raw = RawPair::find(&arguments.recording)?.ok_or_else(|| VisionError::File {
        path: arguments.recording.clone(),
        reason: "is not a folder of a recording".to_owned(),
    })?;
    check_folder(&arguments.out)?;
    let grid = Grid::new(GridConfiguration {
        cells_rho: 16,
        rho_min_m: REACH_M[0],
        rho_max_m: REACH_M[1],
        azimuth_cells: 360 / CELL_DEGREES,
        elevation_cells: 180 / CELL_DEGREES,
    })?;
    let rig = *raw.calibration();
    let to_body = raw.to_body();
    let mut posture = Posture::at_rest(&recording, to_body * Vector3::z())?;
    let mut timing = Timing::of(&recording, arguments.poses.as_deref(), &posture)?;
    let (mut map, mut sight) = (Map::new(grid)?, Sight::default());
    let (mut frames, mut tiles) = (Vec::new(), Vec::new());
    let mut rows = recording.inertial.iter().peekable();
    let bar = ProgressBar::new(recording.frames.len() as u64);
    let evidence = arguments.stereo.evidence.into();
    matched_in_order(&recording, &raw, &arguments.stereo, |time, Matched { pair, found, population }| {
        while let Some(row) = rows.next_if(|row| row.time <= time) {
            posture.feel(row)?;
        }
        bar.inc(1);
        let Some(Now { instants, age, moved, place }) = timing.frame(time, &mut posture, map.grid()) else {
            return Ok(());
        };
        if let Some(step) = moved {
            map.translate(step);
        }
        (1..instants).try_for_each(|_| map.observe(&[]))?;
        let grid = map.grid();
        let turn = posture.to_map(&to_body);
        let direction = |x: f64, y: f64| angles((turn * Vector3::from(rig.ray(x, y))).into());
        let cells = [grid.azimuth_cells(), grid.elevation_cells()];
        let steps = [grid.azimuth_step(), grid.elevation_step()];
        let pixel_readings = pixel_readings(&found, &rig, direction, cells, steps)?;
        let heard = FrameEvidence { evidence, population: population.as_ref(), ..FrameEvidence::default() };
        let view = ViewReadings::of(&pixel_readings, &found, &rig, grid, REACH_M[0], &heard);
        let before = (HiddenCells::from(arguments.hidden) == HiddenCells::Map).then_some(&map);
        let likelihood = sight.likelihood_of(grid, &view, before)?;
        map.observe(&[&likelihood])?;
        let entropies = map.occupancy_entropy();
        frames.push(Frame {
            time_ns: time,
            instants,
            inertial_age_ms: 1e3 * age,
            density: found.density(),
            readings: view.readings.iter().flatten().count(),
            yaw_degrees: posture.yaw().to_degrees(),
            sd_yaw_degrees: posture.yaw_deviation(age).to_degrees(),
            place_m: place,
            entropy: entropies.iter().map(|&entropy| f64::from(entropy)).sum::<f64>()
                / entropies.len() as f64,
        });
        tiles.push(tile(&pair, &found, &map)?);
        Ok(())
    })?;
    bar.finish_and_clear();
    let clock = timing.counts(&posture);
    let figures = Figures { frame: DESCRIPTION, grid: *map.grid().configuration(), clock, frames };
    let files = write(&arguments.out, &map, &posture, &tiles, &figures)?;
    if arguments.json {
        print(&serde_json::to_string(&figures).expect("internal: figures are numbers"));
        return Ok(());
    }
    for frame in figures.frames.iter().step_by(ACROSS) {
        print(&format!(
            "{}  disparity {:>5.1} %  {:>6} directions  yaw {:>7.3}°  entropy {:.4} nats",
            frame.time_ns,
            100.0 * frame.density,
            frame.readings,
            frame.yaw_degrees,
            frame.entropy
        ));
    }
    figures.clock.lines().iter().for_each(|line| print(line));
    files.iter().for_each(|file| print(&format!("wrote {}", file.display())));
    Ok(())
}

fn write(
    folder: &Path,
    map: &Map,
    posture: &Posture,
    tiles: &[Tile],
    figures: &Figures,
) -> Result<Vec<PathBuf>, Error> {
    std::fs::create_dir_all(folder).map_err(|source| Error::Folder { path: folder.to_owned(), source })?;
    let mut written = pictures::write(folder, map, posture.yaw(), tiles)?;
    let json = serde_json::to_string_pretty(figures).expect("internal: figures are numbers");
    write_atomically(&folder.join("replay.json"), json.as_bytes())?;
    written.push(folder.join("replay.json"));
    Ok(written)
}

/// A frame whose disparities are known.
struct Matched {
    pair: Pair,
    found: DisparityMap,
    population: Option<Population>,
}

/// Passes the frames of a recording, matched, with their times in ns, to `then`, in their order. Frames are read and rectified
/// on one thread, matched on another, and passed on this one; each waits for the next one when it is a frame ahead.
///
/// # Errors
/// The first of any stage; later frames are not passed.
fn matched_in_order(
    recording: &Recording,
    raw: &RawPair,
    stereo: &StereoOptions,
    mut then: impl FnMut(i64, Matched) -> Result<(), Error>,
) -> Result<(), Error> {
    let rectified =
        |left: &Path, right: &Path| Pair::rectified(raw, &image::read(left)?, &image::read(right)?);
    let matched = |pair: Pair| -> Result<Matched, VisionError> {
        let (found, population) = match stereo.evidence.into() {
            EvidenceKind::Virtual => pair.matched_with_population(stereo.matcher.into())?,
            EvidenceKind::Hard => (pair.matched(stereo.matcher.into())?, None),
        };
        Ok(Matched { pair, found, population })
    };
    std::thread::scope(|scope| {
        let (read, pairs) = sync_channel(1);
        let (matching, frames) = sync_channel(1);
        scope.spawn(move || {
            for (time, left, right) in &recording.frames {
                // The receiver is gone when a later stage has failed.
                if read.send((*time, rectified(left, right))).is_err() {
                    return;
                }
            }
        });
        scope.spawn(move || {
            for (time, pair) in pairs {
                if matching.send((time, pair.and_then(matched))).is_err() {
                    return;
                }
            }
        });
        frames.into_iter().try_for_each(|(time, frame)| then(time, frame?))
    })
}
