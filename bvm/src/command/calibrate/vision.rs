//! `bvm calibrate vision`: the error distribution and reliability of stereo vision, from data with ground truth.
//!
//! In: pairs of pictures with true disparities. Out: the distribution of their errors (`models/stereo_error.bp`,
//! identified), the reliability of the confidence, and the accuracy of the map; pictures, and `calibration.json`.
//! Invariant: pixels that the right camera does not see do not count.

use super::super::look::{Seen, mapped};
use super::super::{check_folder, print};
use bp_core::compiler::learn::{Case, Learner, Settings};
use bvm::error::Error;
use bvm::map::Map;
use bvm::programs::stereo_error;
use bvm::report::{Line, lines, write_atomically};
use bvm::vision::evaluation::{Scored, Truth, part, wrong};
use bvm::vision::{DisparityMap, EvidenceKind, FrameEvidence, HiddenCells, Matcher, Pair, Sight};
use clap::Args;
use serde::Serialize;
use std::path::PathBuf;

/// Calibrate stereo vision: error distribution, reliability and map.
#[derive(Args)]
#[command(
    after_help = "Example:\n  bvm calibrate vision --pair im0.png im1.png calib.txt disp0.pfm --out made\n\n\
The truth is a PFM of left disparities (pixels; infinity, NaN or 0 where\n\
unknown), or an image whose grey levels are --truth-scale times the disparity\n\
(4 for Middlebury 2003; 256/257 for KITTI's 16 bits)."
)]
pub(crate) struct Vision {
    /// Left image, right image, calibration and ground truth; may be repeated.
    #[arg(long, num_args = 4, value_names = ["LEFT", "RIGHT", "CALIB", "TRUTH"], required = true)]
    pair: Vec<PathBuf>,
    /// Grey levels per pixel, if the ground truth is an image.
    #[arg(long, default_value_t = 1.0)]
    truth_scale: f64,
    /// Output folder.
    #[arg(long, default_value = "bvm-calibration")]
    out: PathBuf,
    /// Print the figures as JSON.
    #[arg(long)]
    json: bool,
}

/// Estimates of similar confidence.
#[derive(Serialize)]
struct Class {
    /// Mean λ.
    lambda: f64,
    claims: usize,
    /// Share within one pixel of the truth.
    right: f64,
    /// Root mean square of the reported deviations, pixels.
    reported_sigma_px: f64,
    /// Deviation of the inliers, identified, pixels.
    sigma_px: f64,
    /// Share of outliers, identified.
    outliers: f64,
}

/// The results of one matcher on all pairs.
#[derive(Serialize)]
struct Figures {
    matcher: String,
    /// Share of the counted pixels with an estimate.
    density: f64,
    /// Share of the estimates; absent, as the next two, if there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    wrong_by_1_matched: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    wrong_by_2_matched: Option<f64>,
    wrong_by_2_all: f64,
    /// Share of the true values within the 90 % intervals of range.
    #[serde(skip_serializing_if = "Option::is_none")]
    covered_by_90: Option<f64>,
    /// Deviation of the inliers, over all estimates, pixels: σ_min of Eq. 3. Absent for exact depth, and if there are
    /// no estimates.
    #[serde(skip_serializing_if = "Option::is_none")]
    sigma_min_px: Option<f64>,
    classes: Vec<Class>,
    /// Accuracy of the map, for each pair and each kind of evidence.
    maps: Vec<MapFigures>,
}

/// The map compared with the true surface.
#[derive(Serialize)]
struct MapFigures {
    evidence: EvidenceKind,
    hidden: HiddenCells,
    /// The number of times that the head, at rest, used the pair.
    times: usize,
    directions: usize,
    /// Mean −ln P of the true occupancy of the cells up to the surface, nats; absent if no surface is in reach.
    #[serde(skip_serializing_if = "Option::is_none")]
    log_loss: Option<f64>,
    /// Share of the directions whose first occupied cell is that of the surface, or the one before or behind it.
    #[serde(skip_serializing_if = "Option::is_none")]
    first_right_or_adjacent: Option<f64>,
}

pub(super) fn run(arguments: &Vision) -> Result<(), Error> {
    check_folder(&arguments.out)?;
    let mut pairs = Vec::new();
    for files in arguments.pair.chunks_exact(4) {
        let pair = Pair::read(&files[0], &files[1], &files[2])?;
        let truth = Truth::read(&files[3], arguments.truth_scale)?;
        truth.check_picture(&files[3], &pair.left)?;
        pairs.push((pair, truth));
    }
    let (mut figures, mut curves) = (Vec::new(), Vec::new());
    let exact = |pair: &Pair, truth: &Truth| DisparityMap {
        width: truth.width,
        height: pair.left.height(),
        disparity: truth.disparity.clone(),
        confidence: truth.disparity.iter().map(|value| if value.is_finite() { 1.0 } else { 0.0 }).collect(),
        spread: vec![0.0; truth.disparity.len()],
    };
    for matcher in [Some(Matcher::Scanline), Some(Matcher::Coherence), None] {
        let (mut scored, mut maps, mut counted) = (Vec::new(), Vec::new(), 0);
        for (pair, truth) in &pairs {
            let (found, population) = match matcher {
                Some(matcher) => pair.matched_with_population(matcher)?,
                None => (exact(pair, truth), None),
            };
            scored.extend(truth.score(&found));
            counted += truth.count();
            for evidence in [EvidenceKind::Hard, EvidenceKind::Virtual] {
                let heard =
                    FrameEvidence { evidence, population: population.as_ref(), ..FrameEvidence::default() };
                let again = matcher == Some(Matcher::Scanline) && evidence == EvidenceKind::Virtual;
                maps.extend(against(pair, &found, &heard, again, truth)?);
            }
        }
        scored.sort_by(|one, other| other.confidence.total_cmp(&one.confidence));
        let name = match matcher {
            Some(Matcher::Scanline) => "scanline",
            Some(Matcher::Coherence) => "coherence",
            None => "exact depth",
        };
        // Exact depths have no error distribution.
        let classes = if matcher.is_some() { classes(&scored)? } else { Vec::new() };
        let has_law = matcher.is_some() && !scored.is_empty();
        let sigma_min_px = has_law.then(|| identified(&scored)).transpose()?.map(|(sigma, _)| sigma);
        let density = scored.len() as f64 / counted as f64;
        figures.push(Figures {
            matcher: name.to_owned(),
            density,
            wrong_by_1_matched: wrong(&scored, 1.0),
            wrong_by_2_matched: wrong(&scored, 2.0),
            wrong_by_2_all: density * wrong(&scored, 2.0).unwrap_or(0.0) + 1.0 - density,
            covered_by_90: part(&scored, |claim| claim.error.abs() <= 1.644_854 * claim.sigma),
            sigma_min_px,
            classes,
            maps,
        });
        if matcher.is_some() {
            curves.push((name.to_owned(), scored, counted));
        }
    }
    let files = pictures(arguments, &figures, &curves)?;
    if arguments.json {
        print(&serde_json::to_string(&figures).expect("internal: figures are numbers"));
        return Ok(());
    }
    print("matcher       density  bad>1   bad>2   bad>2 all  90 % covers  sigma");
    for one in &figures {
        print(&format!(
            "{:<12} {:>6.1} % {} % {} % {:>7.2} % {} % {} px",
            one.matcher,
            100.0 * one.density,
            column(one.wrong_by_1_matched, 100.0, 5, 2),
            column(one.wrong_by_2_matched, 100.0, 5, 2),
            100.0 * one.wrong_by_2_all,
            column(one.covered_by_90, 100.0, 9, 1),
            column(one.sigma_min_px, 1.0, 7, 3)
        ));
    }
    print("");
    print("map input    evidence  hidden   times  log-loss, first cell right or adjacent");
    for one in &figures {
        let ways = one.maps.len() / pairs.len();
        for (way, first) in one.maps.iter().enumerate().take(ways) {
            let maps: Vec<String> = (one.maps.iter().skip(way).step_by(ways))
                .map(|map| {
                    let right = column(map.first_right_or_adjacent, 100.0, 1, 1);
                    format!("{} nats, {right} %", column(map.log_loss, 1.0, 1, 3))
                })
                .collect();
            let (evidence, hidden) = (first.evidence.name(), first.hidden.name());
            print(&format!(
                "{:<12} {evidence:<9} {hidden:<8} {:>5}  {}",
                one.matcher,
                first.times,
                maps.join("   ")
            ));
        }
    }
    print("");
    print("scanline: lambda  claims  within 1 px  est. sigma  sigma  outliers");
    for class in &figures[0].classes {
        print(&format!(
            "{:>16.3} {:>7} {:>10.1} % {:>8.3} px {:>6.3} {:>7.1} %",
            class.lambda,
            class.claims,
            100.0 * class.right,
            class.reported_sigma_px,
            class.sigma_px,
            100.0 * class.outliers
        ));
    }
    files.iter().for_each(|file| print(&format!("wrote {}", file.display())));
    Ok(())
}

/// A number in `width` columns with `decimals` decimals, times a factor; a dash if it is absent.
fn column(number: Option<f64>, factor: f64, width: usize, decimals: usize) -> String {
    let text = number.map_or_else(|| "–".to_owned(), |number| format!("{:.decimals$}", factor * number));
    format!("{text:>width$}")
}

/// The resolution of errors, in pixels. Disparities and truths are rounded; errors that are equal by rounding do not
/// mean a deviation of zero.
const RESOLUTION_PX: f64 = 0.01;
/// 2 / (1 + √5).
const GOLDEN: f64 = 0.618_033_988_749_895;

/// σ of the inliers, pixels, and the share of outliers: identified by the program from up to 4000 estimates. If all
/// errors are below [`RESOLUTION_PX`], σ is their root mean square, which is 0 for a perfect pair, and there are no
/// outliers. Otherwise a uniform offset within the resolution is added to each error, from a golden-section sequence.
fn identified(scored: &[Scored]) -> Result<(f64, f64), Error> {
    if scored.iter().all(|claim| f64::from(claim.error.abs()) < RESOLUTION_PX) {
        let squares = scored.iter().map(|claim| f64::from(claim.error).powi(2)).sum::<f64>();
        return Ok(((squares / scored.len().max(1) as f64).sqrt(), 0.0));
    }
    let model = stereo_error::model();
    let error = model.variable("Error").expect("internal: a variable of the program");
    let mut learner = Learner::new(&model)?;
    for (number, claim) in scored.iter().step_by(scored.len().div_ceil(4000)).enumerate() {
        let place = (number as f64 * GOLDEN).fract() - 0.5;
        learner.observe(&Case::new(&model).with(error, f64::from(claim.error) + RESOLUTION_PX * place))?;
    }
    let settings = Settings { iterations: 200, tolerance: 1e-5, ..Settings::default() };
    let learned = learner.learned_with(&settings, &mut |_, _| {})?;
    let numbers = |name: &str| {
        let parameter = learned.model().parameters.values().find(|parameter| parameter.name == name);
        parameter.map(|parameter| parameter.default.clone()).expect("internal: a parameter of the program")
    };
    Ok((numbers("sigma")[0], numbers("outliers")[0]))
}

/// Ten classes of equal size, the most confident first.
fn classes(scored: &[Scored]) -> Result<Vec<Class>, Error> {
    let size = scored.len().div_ceil(10).max(1);
    let mean = |claims: &[Scored], of: fn(&Scored) -> f32| {
        claims.iter().map(|claim| f64::from(of(claim))).sum::<f64>() / claims.len() as f64
    };
    let class = |claims: &[Scored]| {
        let (sigma_px, outliers) = identified(claims)?;
        Ok(Class {
            lambda: mean(claims, |claim| claim.confidence),
            claims: claims.len(),
            right: 1.0 - wrong(claims, 1.0).unwrap_or(0.0),
            reported_sigma_px: mean(claims, |claim| claim.sigma * claim.sigma).sqrt(),
            sigma_px,
            outliers,
        })
    };
    scored.chunks(size).map(class).collect()
}

/// The map from disparities, compared with the true surface in each direction; and, if the pair is used `again`, the
/// maps after the second use: with hidden cells of probability ½, and of the probabilities of the first map.
fn against(
    pair: &Pair,
    found: &DisparityMap,
    heard: &FrameEvidence<'_>,
    again: bool,
    truth: &Truth,
) -> Result<Vec<MapFigures>, Error> {
    let Seen { map, view, .. } = mapped(pair, found, heard)?;
    let figures_of = |map: &Map, hidden, times| MapFigures {
        evidence: heard.evidence,
        hidden,
        times,
        ..compared(pair, map, truth)
    };
    let mut figures = vec![figures_of(&map, HiddenCells::Uniform, 1)];
    for hidden in [HiddenCells::Uniform, HiddenCells::Map].into_iter().filter(|_| again) {
        let before = (hidden == HiddenCells::Map).then_some(&map);
        let likelihood = Sight::default().likelihood_of(map.grid(), &view, before)?;
        let mut next = map.clone();
        next.observe(&[&likelihood])?;
        figures.push(figures_of(&next, hidden, 2));
    }
    Ok(figures)
}

/// A map compared with the truth.
fn compared(pair: &Pair, map: &Map, truth: &Truth) -> MapFigures {
    let grid = map.grid();
    let mut surfaces: Vec<Vec<f64>> = vec![Vec::new(); grid.directions()];
    for (at, disparity) in truth.disparity.iter().enumerate() {
        let (x, y) = ((at % truth.width) as f64, (at / truth.width) as f64);
        let Some(range) = pair.calibration.range_m(x, y, f64::from(*disparity)) else { continue };
        let (azimuth, elevation) = pair.calibration.direction(x, y);
        if let Some(direction) = grid.direction_of(azimuth, elevation) {
            surfaces[grid.direction_index(direction)].push(range);
        }
    }
    let (mut loss, mut cells, mut right, mut directions) = (0.0, 0usize, 0usize, 0usize);
    for (at, ranges) in surfaces.iter_mut().enumerate().filter(|(_, ranges)| !ranges.is_empty()) {
        ranges.sort_by(f64::total_cmp);
        let surface = grid.log_coordinate(ranges[ranges.len() / 2]).ceil().max(1.0) as usize;
        if surface > grid.cells_rho() {
            continue;
        }
        directions += 1;
        let occupied = |depth: usize| f64::from(map.occupancy()[depth * grid.directions() + at]);
        for depth in 0..surface {
            let probability = if depth + 1 == surface { occupied(depth) } else { 1.0 - occupied(depth) };
            loss -= probability.max(1e-6).ln();
            cells += 1;
        }
        let first = (0..grid.cells_rho()).find(|depth| occupied(*depth) > 0.55);
        right += usize::from(first.is_some_and(|first| (first + 1).abs_diff(surface) <= 1));
    }
    MapFigures {
        evidence: EvidenceKind::default(),
        hidden: HiddenCells::default(),
        times: 1,
        directions,
        log_loss: (cells > 0).then(|| loss / cells as f64),
        first_right_or_adjacent: (directions > 0).then(|| right as f64 / directions as f64),
    }
}

fn pictures(
    arguments: &Vision,
    figures: &[Figures],
    curves: &[(String, Vec<Scored>, usize)],
) -> Result<Vec<PathBuf>, Error> {
    let folder = &arguments.out;
    std::fs::create_dir_all(folder).map_err(|source| Error::Folder { path: folder.clone(), source })?;
    let mut reliability: Vec<Line> = (figures.iter().filter(|one| !one.classes.is_empty()))
        .map(|one| {
            let points = one.classes.iter().rev().map(|class| (class.lambda, class.right));
            Line { name: one.matcher.clone(), points: points.collect() }
        })
        .collect();
    reliability.push(Line { name: "reported".to_owned(), points: vec![(0.0, 0.0), (1.0, 1.0)] });
    let sparsification: Vec<Line> = (curves.iter())
        .map(|(name, scored, counted)| {
            let point = |percent: usize| {
                let kept = &scored[..scored.len() * percent / 100];
                wrong(kept, 2.0).map(|part| (100.0 * kept.len() as f64 / *counted as f64, 100.0 * part))
            };
            Line { name: name.clone(), points: (2..=100).filter_map(point).collect() }
        })
        .collect();
    let highest =
        sparsification.iter().flat_map(|line| line.points.iter().map(|point| point.1)).fold(1.0, f64::max);
    let mut written = Vec::new();
    for (name, picture) in [
        (
            "reliability.png",
            lines(
                "Reliability of the confidence",
                ["confidence", "share within 1 px"],
                [[0.0, 1.0], [0.0, 1.0]],
                &reliability,
            ),
        ),
        (
            "sparsification.png",
            lines(
                "Errors of the most confident estimates",
                ["density (%)", "wrong by more than 2 px (%)"],
                [[0.0, 100.0], [0.0, highest]],
                &sparsification,
            ),
        ),
    ] {
        picture.write(&folder.join(name))?;
        written.push(folder.join(name));
    }
    let json = serde_json::to_string_pretty(figures).expect("internal: figures are numbers");
    write_atomically(&folder.join("calibration.json"), json.as_bytes())?;
    written.push(folder.join("calibration.json"));
    Ok(written)
}
