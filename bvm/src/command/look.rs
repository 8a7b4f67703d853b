//! `bvm look`: a real stereo pair becomes a map and a gaze.
//!
//! In: two images and a calibration. Out: a folder of pictures, `look.json`, and a few lines. Invariant: cells that the
//! pair does not show stay unknown in the map.

use super::{check_folder, print};
use bvm::error::Error;
use bvm::exploration::{Gaze, Gradient};
use bvm::frame::DESCRIPTION;
use bvm::grid::{Grid, GridConfiguration};
use bvm::map::{Heading, Map};
use bvm::report::{
    ColourMap, Panorama, TopView, Window, first_occupied_range, mean, panorama, top_view, write_atomically,
};
use bvm::vision::image::write_png_rgb;
use bvm::vision::readings::pixel_readings;
use bvm::vision::stereo::coherence::cyclopean;
use bvm::vision::{
    DisparityMap, EvidenceKind, FrameEvidence, Matcher, Pair, RangeReading, Sight, ViewReadings, cloud, pfm,
};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Size of a cell in azimuth and in elevation, degrees.
const CELL_DEGREES: f64 = 0.5;

/// Compute disparity, map and next gaze from a stereo pair.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  bvm look --left L.png --right R.png --calibration C.toml --out look\n  \
bvm look --left L.png --right R.png --calibration calib.txt --disparity d.pfm\n  \
bvm look --left L.png --right R.png --calibration C.toml --evidence virtual\n\n\
The calibration is TOML with the keys focal_px, cx_px, cy_px, baseline_m,\n\
doffs_px, max_disparity_px:\n  \
depth = focal_px * baseline_m / (disparity + doffs_px);\n\
or Middlebury's calib.txt, KITTI's calib.txt, or EuRoC's folder of cam0 and\n\
cam1, whose pictures are rectified.\n\n\
Disparities are those of the left picture, in pixels, as PFM; infinity where\n\
there is none. With --disparity or --confidence, and no --out, nothing else is\n\
written.\n\n\
The map starts from its prior. In `bvm replay --hidden map`, the prior of the\n\
hidden cells of a line of sight is the map before the frame."
)]
pub(crate) struct Arguments {
    /// Image of the left eye (PNG, PGM or PPM).
    #[arg(long, value_name = "FILE")]
    left: PathBuf,
    /// Image of the right eye.
    #[arg(long, value_name = "FILE")]
    right: PathBuf,
    /// Calibration of the pair (formats below).
    #[arg(long, value_name = "FILE")]
    calibration: PathBuf,
    #[command(flatten)]
    stereo: StereoOptions,
    /// Write the disparities to this file (PFM).
    #[arg(long, value_name = "FILE")]
    disparity: Option<PathBuf>,
    /// Write the confidences to this file (PFM).
    #[arg(long, value_name = "FILE")]
    confidence: Option<PathBuf>,
    /// Output folder [default: bvm-look].
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Print the figures as JSON.
    #[arg(long)]
    json: bool,
}

/// The options of matching and of evidence for the map.
#[derive(Args)]
pub(crate) struct StereoOptions {
    /// Matcher.
    #[arg(
        long,
        value_name = "NAME",
        value_enum,
        default_value_t,
        hide_possible_values = true,
        help = "Stereo matching: Bayesian inference along scan lines\n(scanline), or coherence detection\n(coherence)"
    )]
    pub(crate) matcher: MatcherName,
    /// Evidence of a direction for the map.
    #[arg(
        long,
        value_name = "NAME",
        value_enum,
        default_value_t,
        hide_possible_values = true,
        help = "Evidence for the map: the most probable range with\nits deviation (hard), or the whole posterior over\nrange (virtual)"
    )]
    pub(crate) evidence: EvidenceName,
}

/// [`Matcher`], as an argument.
#[derive(Clone, Copy, Default, clap::ValueEnum)]
pub(crate) enum MatcherName {
    #[default]
    Scanline,
    Coherence,
}

impl From<MatcherName> for Matcher {
    fn from(name: MatcherName) -> Self {
        match name {
            MatcherName::Scanline => Matcher::Scanline,
            MatcherName::Coherence => Matcher::Coherence,
        }
    }
}

/// [`EvidenceKind`], as an argument.
#[derive(Clone, Copy, Default, clap::ValueEnum)]
pub(crate) enum EvidenceName {
    #[default]
    Hard,
    Virtual,
}

impl From<EvidenceName> for EvidenceKind {
    fn from(name: EvidenceName) -> Self {
        match name {
            EvidenceName::Hard => EvidenceKind::Hard,
            EvidenceName::Virtual => EvidenceKind::Virtual,
        }
    }
}

#[derive(Serialize)]
struct Figures {
    matcher: Matcher,
    evidence: EvidenceKind,
    width: usize,
    height: usize,
    /// Share of the pixels with an estimate.
    density: f64,
    /// Time of the matching, ms.
    matching_ms: f64,
    #[serde(flatten)]
    map: Option<MapFigures>,
}

#[derive(Serialize)]
pub(super) struct MapFigures {
    /// Axes and angles of the map.
    frame: &'static str,
    /// Directions with a range.
    readings: usize,
    /// Nearest and farthest range, m.
    nearest_m: f32,
    farthest_m: f32,
    grid: GridConfiguration,
    gaze: Gaze,
    gaze_azimuth_degrees: f64,
    gaze_elevation_degrees: f64,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Error> {
    let pair = Pair::read(&arguments.left, &arguments.right, &arguments.calibration)?;
    let fields_only = arguments.disparity.is_some() || arguments.confidence.is_some();
    let folder = match &arguments.out {
        None if fields_only => None,
        None => Some(PathBuf::from("bvm-look")),
        Some(folder) => Some(folder.clone()),
    };
    if let Some(folder) = &folder {
        check_folder(folder)?;
    }
    let begun = Instant::now();
    let evidence = arguments.stereo.evidence.into();
    let (found, population) = match (evidence, &folder) {
        (EvidenceKind::Virtual, Some(_)) => pair.matched_with_population(arguments.stereo.matcher.into())?,
        _ => (pair.matched(arguments.stereo.matcher.into())?, None),
    };
    let matching_ms = begun.elapsed().as_secs_f64() * 1e3;
    let mut files = Vec::new();
    for (path, values) in
        [(&arguments.disparity, &found.disparity), (&arguments.confidence, &found.confidence)]
    {
        if let Some(path) = path {
            pfm::write(path, found.width, values)?;
            files.push(path.clone());
        }
    }
    let mut figures = Figures {
        matcher: arguments.stereo.matcher.into(),
        evidence,
        width: found.width,
        height: found.height,
        density: found.density(),
        matching_ms,
        map: None,
    };
    if let Some(folder) = &folder {
        let heard = FrameEvidence { evidence, population: population.as_ref(), ..FrameEvidence::default() };
        let Seen { map, view, figures: of_map } = mapped(&pair, &found, &heard)?;
        if of_map.readings == 0 {
            eprintln!(
                "warning: no direction has a range: no pixel has a disparity with disparity + doffs_px > 0"
            );
        }
        figures.map = Some(of_map);
        files.extend(write(folder, &pair, &found, &map, &view.readings, &figures)?);
    }
    if arguments.json {
        print(&serde_json::to_string(&figures).expect("internal: figures are numbers"));
        return Ok(());
    }
    print(&format!(
        "disparity     {:.1} % of {} x {} pixels, in {matching_ms:.0} ms",
        100.0 * figures.density,
        figures.width,
        figures.height
    ));
    if let Some(MapFigures { readings, nearest_m, farthest_m, gaze, .. }) = &figures.map {
        print(&format!("readings      {readings} directions, {nearest_m:.2} to {farthest_m:.2} m"));
        match gaze.range_m {
            Some(range) => print(&format!(
                "look next at  azimuth {:.1}°, elevation {:.1}° (a frontier cell at {range:.2} m)",
                gaze.azimuth.to_degrees(),
                gaze.elevation.to_degrees()
            )),
            None => print("look next     straight ahead: no frontier was found"),
        }
    }
    files.iter().for_each(|file| print(&format!("wrote {}", file.display())));
    Ok(())
}

/// The map from a pair.
pub(super) struct Seen {
    pub(super) map: Map,
    pub(super) view: ViewReadings,
    figures: MapFigures,
}

/// The map from the pair, and its readings.
pub(super) fn mapped(pair: &Pair, found: &DisparityMap, heard: &FrameEvidence<'_>) -> Result<Seen, Error> {
    let calibration = &pair.calibration;
    let azimuth_cells = (360.0 / CELL_DEGREES) as usize;
    let step = CELL_DEGREES.to_radians();
    let direction = |x, y| calibration.direction(x, y);
    let pixel_readings =
        pixel_readings(found, calibration, direction, [azimuth_cells, azimuth_cells / 2], [step; 2])?;
    // Ignore outliers among the readings, so that they do not enlarge the grid.
    let mut ranges: Vec<f32> = pixel_readings.iter().flatten().map(|found| found.reading.range_m).collect();
    ranges.sort_by(f32::total_cmp);
    let (nearest, farthest) = match ranges.len() {
        0 => (0.5, 5.0),
        count => (ranges[count / 100], ranges[count - 1 - count / 100]),
    };
    let grid = Grid::new(GridConfiguration {
        cells_rho: 16,
        rho_min_m: 0.7 * f64::from(nearest),
        rho_max_m: 1.1 * f64::from(farthest).max(1.2 * f64::from(nearest)),
        azimuth_cells,
        elevation_cells: azimuth_cells / 2,
    })?;
    let view = ViewReadings::of(&pixel_readings, found, calibration, &grid, f64::from(nearest), heard);
    let mut map = Map::new(grid.clone())?;
    map.observe(&[&Sight::default().likelihood_of(&grid, &view, None)?])?;
    let gaze = Gradient::default().choose(&map, &Heading::default())?;
    let figures = MapFigures {
        frame: DESCRIPTION,
        readings: view.readings.iter().flatten().count(),
        nearest_m: nearest,
        farthest_m: farthest,
        grid: *map.grid().configuration(),
        gaze,
        gaze_azimuth_degrees: gaze.azimuth.to_degrees(),
        gaze_elevation_degrees: gaze.elevation.to_degrees(),
    };
    Ok(Seen { map, view, figures })
}

fn write(
    folder: &Path,
    pair: &Pair,
    disparity: &DisparityMap,
    map: &Map,
    seen: &[Option<RangeReading>],
    figures: &Figures,
) -> Result<Vec<PathBuf>, Error> {
    let gaze = &figures.map.as_ref().expect("internal: the map has been made").gaze;
    std::fs::create_dir_all(folder).map_err(|source| Error::Folder { path: folder.to_owned(), source })?;
    let path = |name: &str| folder.join(name);
    let mut written = Vec::new();
    let largest = disparity.disparity.iter().copied().filter(|value| value.is_finite()).fold(1.0, f32::max);
    let pixels = |values: &[f32], most: f32| -> Vec<u8> {
        let colour = |value: &f32| match value.is_finite() && *value > 0.0 {
            true => ColourMap::Sequential.colour(f64::from(value / most)),
            false => [40, 40, 40],
        };
        values.iter().flat_map(colour).collect()
    };
    for (name, values, most) in
        [("disparity.png", &disparity.disparity, largest), ("confidence.png", &disparity.confidence, 1.0)]
    {
        write_png_rgb(&path(name), disparity.width, disparity.height, &pixels(values, most))?;
        written.push(path(name));
    }
    let grid = map.grid();
    let window = window(grid, seen);
    let near = Some([grid.configuration().rho_max_m, grid.configuration().rho_min_m]);
    let draw = |title: &str, quantity: &str, values: &[f64], colours, limits| {
        let gaze_path = [(gaze.azimuth, gaze.elevation)];
        panorama(grid, &Panorama { title, quantity, values, colours, limits, window, gaze_path: &gaze_path })
    };
    let range: Vec<f64> =
        seen.iter().map(|reading| reading.map_or(f64::NAN, |reading| f64::from(reading.range_m))).collect();
    let first = first_occupied_range(grid, map.occupancy(), 0.05)?;
    let entropy = mean(grid, map.entropy())?;
    let what = TopView {
        occupancy: map.occupancy(),
        truth: None,
        heading: 0.0,
        field: (window.azimuth_degrees[0] - window.azimuth_degrees[1]).to_radians(),
        band: 3f64.to_radians(),
    };
    for (name, picture) in [
        ("range_panorama.png", draw("What was read", "range (m)", &range, ColourMap::Sequential, near)?),
        (
            "occupancy_panorama.png",
            draw("First occupied cell", "range (m)", &first, ColourMap::Sequential, near)?,
        ),
        (
            "entropy_panorama.png",
            draw("Mean entropy, and the gaze", "H (nats)", &entropy, ColourMap::Sequential, None)?,
        ),
        ("top_view.png", top_view(grid, &what)?),
    ] {
        picture.write(&path(name))?;
        written.push(path(name));
    }
    if figures.matcher == Matcher::Coherence {
        let (seen, view) = cyclopean(&pair.left, &pair.right, pair.calibration.max_disparity_px())?;
        let rgb: Vec<u8> = view.iter().flat_map(|level| [*level; 3]).collect();
        write_png_rgb(&path("cyclopean.png"), seen.width, view.len() / seen.width, &rgb)?;
        written.push(path("cyclopean.png"));
    }
    cloud::write(&path("cloud.ply"), pair, disparity)?;
    written.push(path("cloud.ply"));
    let json = serde_json::to_string_pretty(figures).expect("internal: figures are numbers");
    write_atomically(&path("look.json"), json.as_bytes())?;
    written.push(path("look.json"));
    Ok(written)
}

/// The part of the sphere that was seen, with a margin.
fn window(grid: &Grid, seen: &[Option<RangeReading>]) -> Window {
    let directions = grid.all_directions().zip(seen).filter(|(_, reading)| reading.is_some());
    let centres: Vec<(f64, f64)> =
        directions.map(|(direction, _)| grid.direction_centre(direction)).collect();
    if centres.is_empty() {
        return Window::default();
    }
    let bounds = |value: &dyn Fn(&(f64, f64)) -> f64, end: f64| {
        let low = centres.iter().map(value).fold(f64::INFINITY, f64::min).to_degrees();
        let high = centres.iter().map(value).fold(f64::NEG_INFINITY, f64::max).to_degrees();
        [(low - 3.0).max(-end), (high + 3.0).min(end)]
    };
    let [right, left] = bounds(&|centre| centre.0, 180.0);
    Window { azimuth_degrees: [left, right], elevation_degrees: bounds(&|centre| centre.1, 90.0) }
}
