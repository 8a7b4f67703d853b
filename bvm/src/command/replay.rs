//! `bvm replay`: builds a map from a recording.
//!
//! In: a folder of stereo frames and inertial readings (EuRoC). Out: the map's pictures, a strip of frames, and
//! `replay.json`. Each frame is rectified, matched and read; balance estimates the orientation; the cell filter
//! predicts and estimates. Translation of the head is ignored: the map represents directions about one place. While one frame
//! is in the map, the next one is matched and the one after it read.
//! Invariant: frames are taken in order of time.

use super::look::StereoOptions;
use super::{check_folder, print};
use bvm::error::Error;
use bvm::frame::{DESCRIPTION, angles};
use bvm::grid::{Grid, GridConfiguration};
use bvm::map::Map;
use bvm::recording::{Posture, Recording};
use bvm::report::{
    ColourMap, Panorama, TopView, Window, first_occupied_range, panorama, top_view, write_atomically,
};
use bvm::vision::calibration::raw::RawPair;
use bvm::vision::image::{self, write_png_rgb};
use bvm::vision::readings::pixel_readings;
use bvm::vision::{
    DisparityMap, EvidenceKind, FrameEvidence, HiddenCells, Pair, Population, Sight, ViewReadings,
    VisionError,
};
use clap::Args;
use indicatif::ProgressBar;
use nalgebra::Vector3;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::mpsc::sync_channel;

/// Build a map from a recording, frame by frame.
#[derive(Args)]
#[command(after_help = "Example:\n  bvm replay --recording V1_01_easy/mav0 --out replay")]
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
    density: f64,
    readings: usize,
    /// Positive to the left.
    yaw_degrees: f64,
    /// Mean entropy of the occupancy of all cells, nats.
    entropy: f64,
}

#[derive(Serialize)]
struct Figures {
    /// Axes and angles of the map.
    frame: &'static str,
    grid: GridConfiguration,
    frames: Vec<Frame>,
}

/// Nearest and farthest cell edges, metres.
const REACH_M: [f64; 2] = [0.8, 8.0];
/// Size of a cell in azimuth and in elevation, degrees.
const CELL_DEGREES: usize = 1;
/// The part of the sphere in the strip, degrees of azimuth and elevation to either side.
const SHOWN: [f64; 2] = [60.0, 40.0];
/// Frames side by side in the strip.
const ACROSS: usize = 7;

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
    let (mut map, mut sight) = (Map::new(grid)?, Sight::default());
    let (mut frames, mut tiles) = (Vec::new(), Vec::new());
    let mut rows = recording.inertial.iter().peekable();
    let bar = ProgressBar::new(recording.frames.len() as u64);
    let evidence = arguments.stereo.evidence.into();
    matched_in_order(&recording, &raw, &arguments.stereo, |time, Matched { pair, found, population }| {
        while let Some(row) = rows.next_if(|row| row.time <= time) {
            posture.feel(row);
        }
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
            density: found.density(),
            readings: view.readings.iter().flatten().count(),
            yaw_degrees: posture.yaw().to_degrees(),
            entropy: entropies.iter().map(|&entropy| f64::from(entropy)).sum::<f64>()
                / entropies.len() as f64,
        });
        tiles.push(tile(&pair, &found, &map)?);
        bar.inc(1);
        Ok(())
    })?;
    bar.finish_and_clear();
    let figures = Figures { frame: DESCRIPTION, grid: *map.grid().configuration(), frames };
    let files = write(arguments, &map, &posture, &tiles, &figures)?;
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
    files.iter().for_each(|file| print(&format!("wrote {}", file.display())));
    Ok(())
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

/// A small colour picture, row by row.
struct Tile {
    width: usize,
    rgb: Vec<u8>,
}

/// The left picture, its disparities, and the first occupied cells at that time, one below the other.
fn tile(pair: &Pair, found: &DisparityMap, map: &Map) -> Result<Tile, Error> {
    let grid = map.grid();
    let width = found.width / 4;
    let mut rgb = Vec::new();
    let most = pair.calibration.max_disparity_px() as f32 / 2.0;
    for y in 0..found.height / 4 {
        rgb.extend((0..width).flat_map(|x| [pair.left.pixels()[4 * y * found.width + 4 * x] as u8; 3]));
    }
    for y in 0..found.height / 4 {
        rgb.extend((0..width).flat_map(|x| {
            let disparity = found.disparity[4 * y * found.width + 4 * x];
            if disparity.is_finite() {
                ColourMap::Sequential.colour(f64::from(disparity / most))
            } else {
                [40; 3]
            }
        }));
    }
    let ranges = first_occupied_range(grid, map.occupancy(), 0.05)?;
    let height = (width as f64 * SHOWN[1] / SHOWN[0]) as usize;
    for y in 0..height {
        for x in 0..width {
            let share = |at: usize, of: usize| 2.0 * (at as f64 + 0.5) / of as f64 - 1.0;
            let azimuth = (-SHOWN[0] * share(x, width)).to_radians();
            let elevation = (-SHOWN[1] * share(y, height)).to_radians();
            let direction = grid.direction_of(azimuth, elevation);
            let range = direction.map_or(f64::NAN, |direction| ranges[grid.direction_index(direction)]);
            let near = (REACH_M[1] / range).ln() / (REACH_M[1] / REACH_M[0]).ln();
            rgb.extend(if near.is_finite() { ColourMap::Sequential.colour(near) } else { [214, 220, 230] });
        }
    }
    Ok(Tile { width, rgb })
}

fn write(
    arguments: &Arguments,
    map: &Map,
    posture: &Posture,
    tiles: &[Tile],
    figures: &Figures,
) -> Result<Vec<PathBuf>, Error> {
    let folder = &arguments.out;
    std::fs::create_dir_all(folder).map_err(|source| Error::Folder { path: folder.clone(), source })?;
    let (width, height) = (tiles[0].width, tiles[0].rgb.len() / tiles[0].width / 3);
    let (across, down) = (ACROSS.min(tiles.len()), tiles.len().div_ceil(ACROSS));
    let mut strip = vec![255; 3 * across * width * down * height];
    for (at, tile) in tiles.iter().enumerate() {
        let (column, row) = (at % ACROSS, at / ACROSS);
        for (y, line) in tile.rgb.chunks_exact(3 * width).enumerate() {
            let start = 3 * ((row * height + y) * across * width + column * width);
            strip[start..start + line.len()].copy_from_slice(line);
        }
    }
    let mut written = vec![folder.join("strip.png")];
    write_png_rgb(&written[0], across * width, down * height, &strip)?;
    let grid = map.grid();
    let first = first_occupied_range(grid, map.occupancy(), 0.05)?;
    let window = Window { azimuth_degrees: [SHOWN[0], -SHOWN[0]], elevation_degrees: [-SHOWN[1], SHOWN[1]] };
    let sphere = Panorama {
        title: "First occupied cell",
        quantity: "range (m)",
        values: &first,
        colours: ColourMap::Sequential,
        limits: Some([REACH_M[1], REACH_M[0]]),
        window,
        gaze_path: &[(posture.yaw(), 0.0)],
    };
    let from_above = TopView {
        occupancy: map.occupancy(),
        truth: None,
        heading: posture.yaw(),
        field: 80f64.to_radians(),
        band: 10f64.to_radians(),
    };
    for (name, picture) in
        [("occupancy_panorama.png", panorama(grid, &sphere)?), ("top_view.png", top_view(grid, &from_above)?)]
    {
        picture.write(&folder.join(name))?;
        written.push(folder.join(name));
    }
    let json = serde_json::to_string_pretty(figures).expect("internal: figures are numbers");
    write_atomically(&folder.join("replay.json"), json.as_bytes())?;
    written.push(folder.join("replay.json"));
    Ok(written)
}
