//! The matcher on recorded pairs with measured truth (Middlebury 2003 and 2014).
//!
//! In: `shared/data` next to the repository, or the folder named by `BP_DATA`. Out: density and share of wrong
//! estimates, compared with the limits below. If the folder is absent, each test reports it and passes. Invariant: the
//! limit on wrong claims is the figure of OpenCV's SGBM on the same pair and pixels. Reference: Scharstein and
//! Szeliski, CVPR 2003; Scharstein et al., GCPR 2014.

use std::path::{Path, PathBuf};

use bvm::vision::{Calibration, DisparityMap, GreyImage, Matcher, image, match_pair, readings};

/// A folder of the recordings, if it is there.
fn recordings(folder: &str) -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).map(|up| up.join("shared/data"));
    let root = std::env::var_os("BP_DATA").map(PathBuf::from).or_else(beside)?;
    let path = root.join("stereo").join(folder);
    if path.is_dir() {
        return Some(path);
    }
    println!("skipped: no folder {}", path.display());
    None
}

fn read(folder: &Path, name: &str) -> GreyImage {
    image::read(&folder.join(name)).unwrap()
}

/// Share of the mask's pixels with an estimate, and share of these that are wrong by more than 2 pixels.
fn score(map: &DisparityMap, truth: impl Fn(usize) -> f32, mask: impl Fn(usize) -> bool) -> (f64, f64) {
    let places: Vec<usize> = (0..map.disparity.len()).filter(|&at| mask(at)).collect();
    let claimed: Vec<usize> = places.iter().copied().filter(|&at| map.confidence[at] > 0.0).collect();
    let wrong = claimed.iter().filter(|&&at| (map.disparity[at] - truth(at)).abs() > 2.0).count();
    (claimed.len() as f64 / places.len() as f64, wrong as f64 / claimed.len().max(1) as f64)
}

/// The median of the estimates with these indices.
fn median(values: &[f32], taken: impl Fn(usize) -> bool) -> f32 {
    let claimed =
        |(at, value): (usize, &f32)| (value.is_finite() && *value > 0.0 && taken(at)).then_some(*value);
    let mut values: Vec<f32> = values.iter().enumerate().filter_map(claimed).collect();
    values.sort_by(f32::total_cmp);
    values[values.len() / 2]
}

#[test]
fn cones() {
    let Some(folder) = recordings("middlebury2003_cones") else { return };
    let (left, right) = (read(&folder, "im2.ppm"), read(&folder, "im6.ppm"));
    let (truth, mask) = (read(&folder, "disp2.pgm"), read(&folder, "cones_mask_2bt.png"));
    let map = match_pair(&left, &right, 64, Matcher::Scanline).unwrap();
    let true_disparity = |at: usize| truth.pixels()[at] / 4.0;
    let seen = |at: usize| truth.pixels()[at] > 0.0 && mask.pixels()[at] > 128.0;
    let (density, wrong) = score(&map, true_disparity, seen);
    println!("cones: density {density:.4}, wrong by more than 2 px {wrong:.4}");
    assert!(density >= 0.95 && wrong <= 0.023, "density {density}, wrong {wrong}");
    // 90 % of a normal law lies within 1.645 deviations: so should 90 % of the truth, with the resolution of a quarter
    // pixel included.
    let claimed: Vec<usize> =
        (0..map.disparity.len()).filter(|&at| seen(at) && map.confidence[at] > 0.0).collect();
    let near = |at: &&usize| (map.disparity[**at] - true_disparity(**at)).abs() <= 1.645 * map.sigma_px(**at);
    let covered = claimed.iter().filter(near).count() as f64 / claimed.len() as f64;
    println!("cones: 90 % intervals cover {covered:.3}");
    assert!((0.85..=0.95).contains(&covered), "{covered}");
    // Confidence is meaningful: of the more confident half less than one in a thousand is wrong.
    let sure = median(&map.confidence, |_| true);
    let (_, wrong) = score(&map, true_disparity, |at| seen(at) && map.confidence[at] >= sure);
    assert!(wrong <= 0.001, "surer half: {wrong}");
}

#[test]
fn motorcycle() {
    let Some(folder) = recordings("middlebury2014_motorcycle") else { return };
    let (left, right) = (read(&folder, "motorcycle_left.png"), read(&folder, "motorcycle_right.png"));
    let map = match_pair(&left, &right, 64, Matcher::Scanline).unwrap();
    println!("motorcycle: density {:.4}", map.density());
    assert!(map.density() >= 0.85, "{}", map.density());
    // The floor, bare at the right border, comes nearer towards the lower one.
    let row = |y: usize| median(&map.disparity, |at| at / map.width == y && at % map.width >= 695);
    assert!(row(330) < row(410) && row(410) < row(490));
    // The published calibration puts the truth, 7.2 to 59.9 px, between 2.1 and 5.0 m in depth.
    let text = "focal_px = 994.978\ncx_px = 311.193\ncy_px = 254.877\nbaseline_m = 0.193001\n\
                doffs_px = 31.086\nmax_disparity_px = 64";
    let rig = Calibration::parse(text, Path::new("motorcycle.toml"), None).unwrap();
    let degree = 1f64.to_radians();
    let found = readings(&map, &rig, 360, 90, degree, 2.0 * degree).unwrap();
    let ranges: Vec<f32> = found.iter().flatten().map(|reading| reading.range_m).collect();
    let (least, most) = ranges.iter().fold((f32::MAX, 0f32), |(a, b), &range| (a.min(range), b.max(range)));
    println!("motorcycle: {} directions, {least:.3} to {most:.3} m", ranges.len());
    // 41° by 28° are about 41 columns and 14 rows.
    assert!((450..=680).contains(&ranges.len()), "{}", ranges.len());
    assert!(least > 2.0 && most < 5.6, "{least} to {most} m");
    let swapped = match_pair(&right, &left, 64, Matcher::Scanline).unwrap();
    println!("swapped: density {:.4}", swapped.density());
    assert!(swapped.density() < 0.05, "{}", swapped.density());
}

#[test]
fn coherence_is_surest_where_it_is_right() {
    let Some(folder) = recordings("middlebury2003_cones") else { return };
    let (left, right) = (read(&folder, "im2.ppm"), read(&folder, "im6.ppm"));
    let (truth, mask) = (read(&folder, "disp2.pgm"), read(&folder, "cones_mask_2bt.png"));
    let map = match_pair(&left, &right, 64, Matcher::Coherence).unwrap();
    let seen = |at: usize| truth.pixels()[at] > 0.0 && mask.pixels()[at] > 128.0;
    let mut claims: Vec<(f32, bool)> = (0..map.disparity.len())
        .filter(|&at| seen(at) && map.confidence[at] > 0.0)
        .map(|at| (map.confidence[at], (map.disparity[at] - truth.pixels()[at] / 4.0).abs() > 2.0))
        .collect();
    claims.sort_by(|one, other| other.0.total_cmp(&one.0));
    let wrong = |part: f64| {
        let surest = &claims[..(claims.len() as f64 * part) as usize];
        surest.iter().filter(|claim| claim.1).count() as f64 / surest.len() as f64
    };
    let curve = [0.2, 0.4, 0.6, 0.8, 1.0].map(wrong);
    println!("cones, coherence: wrong among the surest {curve:.3?}");
    assert!(curve.is_sorted() && curve[0] < 0.5 * curve[4], "{curve:?}");
}

#[test]
fn raw_cameras_are_rectified() {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).map(|up| up.join("shared/data"));
    let root = std::env::var_os("BP_DATA").map(PathBuf::from).or_else(beside).unwrap();
    let folder = root.join("euroc_v1_01");
    if !folder.is_dir() {
        println!("skipped: no folder {}", folder.display());
        return;
    }
    let name = "1403715274712143104.png";
    let pair =
        bvm::vision::Pair::read(&folder.join("cam0").join(name), &folder.join("cam1").join(name), &folder)
            .unwrap();
    // The published poses put the cameras 110.074 mm apart; f is the mean of the four that are published.
    let focal = (458.654 + 457.296 + 457.587 + 456.134) / 4.0;
    assert!((pair.calibration.depth_times_disparity() - focal * 0.110_074).abs() < 0.01);
    let map = pair.matched(Matcher::Scanline).unwrap();
    println!("EuRoC: density {:.3}", map.density());
    // Unrectified rows are up to 20 px apart: hardly any pixel would match.
    assert!(map.density() > 0.5, "{}", map.density());
}
