//! The matcher on synthetic surfaces, and on pairs without information.
//!
//! In: seeded random textures on planes and steps with known disparity. Out: the share of the visible pixels with a
//! correct estimate. Invariant: without information there is no estimate.

use std::path::Path;

use bvm::vision::{Calibration, DisparityMap, GreyImage, Matcher, VisionError, match_pair, readings};

const WIDTH: usize = 180;
const HEIGHT: usize = 90;
const LARGEST: usize = 32;

/// A whole number scrambled into 0..1 (splitmix64).
fn scatter(seed: u64) -> f32 {
    let mut z = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
}

/// A smooth random texture in 20..235: random lattice values, bilinear between, two scales.
fn texture(seed: u64, x: f32, y: f32) -> f32 {
    let layer = |layer: u64, spacing: f32| {
        let (u, v) = (x / spacing + 1000.0, y / spacing + 1000.0);
        let (i, j) = (u.floor(), v.floor());
        let at = |di: f32, dj: f32| {
            scatter((seed << 50) | (layer << 40) | (((i + di) as u64) << 20) | (j + dj) as u64)
        };
        let (s, t) = (u - i, v - j);
        let above = (1.0 - s) * at(0.0, 0.0) + s * at(1.0, 0.0);
        let below = (1.0 - s) * at(0.0, 1.0) + s * at(1.0, 1.0);
        (1.0 - t) * above + t * below
    };
    20.0 + 215.0 * (0.6 * layer(1, 2.5) + 0.4 * layer(2, 9.0))
}

/// An image of whole grey levels.
fn image(value: impl Fn(f32, f32) -> f32) -> GreyImage {
    let pixel = |at: usize| value((at % WIDTH) as f32, (at / WIDTH) as f32).round();
    GreyImage::new(WIDTH, HEIGHT, (0..WIDTH * HEIGHT).map(pixel).collect()).unwrap()
}

/// The plane of disparity `a + b·x + c·y` (in left coordinates), textured: the left point x is seen at
/// x − d(x) on the right, so the right point x' shows the left point (x' + a + c·y) / (1 − b).
fn plane(a: f32, b: f32, c: f32) -> (GreyImage, GreyImage) {
    (image(|x, y| texture(1, x, y)), image(|x, y| texture(1, (x + a + c * y) / (1.0 - b), y)))
}

/// Share of the pixels visible in both views whose estimate is within half a pixel of the truth.
fn right_part(map: &DisparityMap, truth: impl Fn(usize, usize) -> Option<f32>) -> f64 {
    let (mut visible, mut right) = (0, 0);
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let Some(truth) = truth(x, y).filter(|&truth| truth <= x as f32) else { continue };
            visible += 1;
            right += usize::from((map.disparity[y * WIDTH + x] - truth).abs() <= 0.5);
        }
    }
    right as f64 / f64::from(visible)
}

/// Estimates are finite and in range with λ in ]0, 1]; all other pixels hold infinity and 0.
fn check_claims(map: &DisparityMap) {
    assert_eq!((map.disparity.len(), map.confidence.len()), (map.width * map.height, map.width * map.height));
    for (disparity, confidence) in map.disparity.iter().zip(&map.confidence) {
        let claim = (0.0..=LARGEST as f32).contains(disparity) && *confidence > 0.0 && *confidence <= 1.0;
        assert!(claim || (*disparity == f32::INFINITY && *confidence == 0.0), "{disparity} {confidence}");
    }
}

#[test]
fn planes_are_found_between_pixels() {
    for (a, b, c) in [(7.0, 0.0, 0.0), (12.3, 0.0, 0.0), (4.0, 0.05, 0.0), (20.0, -0.04, 0.06)] {
        let (left, right) = plane(a, b, c);
        let map = match_pair(&left, &right, LARGEST, Matcher::Scanline).unwrap();
        check_claims(&map);
        let part = right_part(&map, |x, y| Some(a + b * x as f32 + c * y as f32));
        println!("plane {a} {b} {c}: {part:.4}");
        assert!(part >= 0.95, "plane {a} {b} {c}: {part}");
    }
}

#[test]
fn gain_and_offset_between_the_cameras_do_not_matter() {
    let (left, right) = plane(9.4, 0.0, 0.0);
    let dim = right.pixels().iter().map(|value| (0.6 * value + 30.0).round()).collect();
    let map =
        match_pair(&left, &GreyImage::new(WIDTH, HEIGHT, dim).unwrap(), LARGEST, Matcher::Scanline).unwrap();
    assert!(right_part(&map, |_, _| Some(9.4)) >= 0.95);
}

#[test]
fn a_step_is_found_and_hidden_pixels_are_not_claimed() {
    let (near, far) = (24.0, 8.0);
    let in_front = |x: f32| (80.0..130.0).contains(&x);
    let left = image(|x, y| if in_front(x) { texture(2, x, y) } else { texture(3, x, y) });
    let right =
        image(|x, y| if in_front(x + near) { texture(2, x + near, y) } else { texture(3, x + far, y) });
    let map = match_pair(&left, &right, LARGEST, Matcher::Scanline).unwrap();
    check_claims(&map);
    // A far point at x is seen at x − 8 on the right, unless the near strip, at 56..106 there, covers it.
    let hidden = |x: usize| !in_front(x as f32) && in_front(x as f32 - far + near);
    let truth = |x: usize| if in_front(x as f32) { near } else { far };
    let part = right_part(&map, |x, _| (!hidden(x)).then_some(truth(x)));
    let places: Vec<usize> = (0..WIDTH * HEIGHT).filter(|at| hidden(at % WIDTH)).collect();
    let claimed = places.iter().filter(|&&at| map.confidence[at] > 0.0).count();
    // Nearly every estimate is correct, wherever it is.
    let claims = map.disparity.iter().enumerate().filter(|(_, disparity)| disparity.is_finite());
    let wrong = claims.filter(|(at, disparity)| (*disparity - truth(at % WIDTH)).abs() > 1.0).count();
    println!("step: right {part:.4}, claimed {claimed} of {} hidden, {wrong} wrong", places.len());
    assert!(part >= 0.95, "{part}");
    assert!(claimed * 5 < places.len(), "{claimed} of {} hidden pixels", places.len());
    assert!(wrong * 50 < WIDTH * HEIGHT, "{wrong} wrong claims");
}

#[test]
fn nothing_to_see_nothing_claimed() {
    let flat = |value: f32| image(move |_, _| value);
    let noise = |seed: u64| {
        image(move |x, y| 100.0 + (9.0 * scatter((seed << 40) | ((y as u64) << 20) | x as u64)).floor())
    };
    let (left, right) = plane(10.0, 0.0, 0.0);
    let cases = [
        ("flat", flat(128.0), flat(128.0), 0.0),
        ("saturated", flat(255.0), flat(255.0), 0.0),
        ("one side flat", left.clone(), flat(90.0), 0.0),
        ("noise", noise(1), noise(2), 0.02),
        ("two scenes", left.clone(), image(|x, y| texture(7, x, y)), 0.05),
        ("swapped", right, left, 0.05),
    ];
    for (name, left, right, most) in cases {
        let map = match_pair(&left, &right, LARGEST, Matcher::Scanline).unwrap();
        check_claims(&map);
        println!("{name}: density {:.4}", map.density());
        assert!(map.density() <= most, "{name}: {}", map.density());
    }
}

#[test]
fn a_bare_wall_between_textures_stays_unclaimed() {
    let bare = |x: f32| (70.0..120.0).contains(&x);
    // Grey, and so bright that the cameras saturate.
    for level in [140.0, 255.0] {
        let left = image(|x, y| if bare(x) { level } else { texture(4, x, y) });
        let right = image(|x, y| if bare(x + 6.0) { level } else { texture(4, x + 6.0, y) });
        let map = match_pair(&left, &right, LARGEST, Matcher::Scanline).unwrap();
        // The windows of census, cost and support reach 4 + 1 + 3 pixels into the wall.
        for y in 0..HEIGHT {
            for x in 79..111 {
                assert_eq!(map.confidence[y * WIDTH + x], 0.0, "{level}: ({x}, {y})");
            }
        }
        assert!(right_part(&map, |x, _| (!(62..128).contains(&x)).then_some(6.0)) >= 0.95, "{level}");
    }
}

#[test]
fn a_wall_across_the_view_becomes_ranges() {
    // 100 px · 0.1 m / (8 + 2) px: a wall 1 m deep, seen over atan(±0.9) and atan(±0.45).
    let text =
        "focal_px = 100\ncx_px = 90\ncy_px = 45\nbaseline_m = 0.1\ndoffs_px = 2\nmax_disparity_px = 32";
    let rig = Calibration::parse(text, Path::new("wall.toml"), None).unwrap();
    let (left, right) = plane(8.0, 0.0, 0.0);
    let map = match_pair(&left, &right, rig.max_disparity_px(), Matcher::Scanline).unwrap();
    let (azimuths, elevations) = (90, 45);
    let step = 4f64.to_radians();
    let found = readings(&map, &rig, azimuths, elevations, step, step).unwrap();
    assert_eq!(found.len(), azimuths * elevations);
    let mut count = 0;
    for (at, reading) in found.iter().enumerate() {
        let Some(reading) = reading else { continue };
        count += 1;
        let azimuth = (at % azimuths) as f64 * step - 178f64.to_radians();
        let elevation = (at / azimuths) as f64 * step - 88f64.to_radians();
        // The wall is Z = 1 m = ρ cos θ cos φ; the pixel of the reading may be anywhere in a cell of ±2°.
        let depth = f64::from(reading.range_m) * azimuth.cos() * elevation.cos();
        assert!((depth - 1.0).abs() < 0.08, "{depth} m at {azimuth} {elevation}");
        assert!(reading.confidence > 0.0 && reading.confidence <= 1.0);
    }
    // 84° by 48° make 21 by 12 whole columns and rows at most, with a border cut by the picture.
    assert!((180..=23 * 14).contains(&count), "{count} readings");
    // No readings behind the head.
    assert!(
        found
            .iter()
            .enumerate()
            .all(|(at, reading)| (33..57).contains(&(at % azimuths)) || reading.is_none())
    );
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let (left, right) = plane(12.3, 0.02, 0.01);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| match_pair(&left, &right, LARGEST, Matcher::Scanline).unwrap())
    };
    let one = with(1);
    assert!(one.density() > 0.8);
    assert_eq!(one, with(2));
    assert_eq!(one, with(5));
}

#[test]
fn pairs_that_cannot_be_searched_are_refused() {
    let of = |width, height| GreyImage::new(width, height, vec![100.0; width * height]).unwrap();
    let sizes = match_pair(&of(20, 10), &of(20, 11), 5, Matcher::Scanline).unwrap_err();
    assert!(sizes.to_string().contains("the left is 20x10, the right is 20x11"), "{sizes}");
    for (width, largest) in [(1, 1), (20, 20), (20, 0), (20, usize::MAX)] {
        let error = match_pair(&of(width, 3), &of(width, 3), largest, Matcher::Scanline).unwrap_err();
        assert!(matches!(error, VisionError::MaxDisparity { .. }), "{error}");
        assert!(error.to_string().contains(&largest.to_string()), "{error}");
    }
    let large = match_pair(&of(2000, 1000), &of(2000, 1000), 999, Matcher::Scanline).unwrap_err();
    assert!(matches!(large, VisionError::TooLarge { .. }), "{large}");
    // The smallest possible picture: without texture there is no estimate.
    assert_eq!(match_pair(&of(2, 1), &of(2, 1), 1, Matcher::Scanline).unwrap().density(), 0.0);
}

#[test]
fn coherence_finds_planes_and_claims_nothing_without_texture() {
    for (a, b, c) in [(7.0, 0.0, 0.0), (12.3, 0.0, 0.0), (20.0, -0.04, 0.06)] {
        let (left, right) = plane(a, b, c);
        let map = match_pair(&left, &right, LARGEST, Matcher::Coherence).unwrap();
        check_claims(&map);
        let off = |at: usize| map.disparity[at] - (a + b * (at % WIDTH) as f32 + c * (at / WIDTH) as f32);
        let claimed: Vec<usize> =
            (0..map.disparity.len()).filter(|&at| map.disparity[at].is_finite()).collect();
        let right = claimed.iter().filter(|&&at| off(at).abs() <= 0.5).count();
        println!("plane {a} {b} {c}: density {:.3}, {right} of {} right", map.density(), claimed.len());
        assert!(map.density() > 0.4 && right * 10 >= claimed.len() * 9, "plane {a} {b} {c}");
    }
    for level in [128.0, 255.0] {
        let flat = image(|_, _| level);
        assert_eq!(match_pair(&flat, &flat, LARGEST, Matcher::Coherence).unwrap().density(), 0.0);
    }
    let (left, right) = plane(9.0, 0.0, 0.0);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| match_pair(&left, &right, LARGEST, Matcher::Coherence).unwrap())
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn a_pair_that_is_not_rectified_is_doubted() {
    // The right picture three rows lower: no match lies in its row.
    let (left, right) = (image(|x, y| texture(5, x, y)), image(|x, y| texture(5, x + 9.0, y - 6.0)));
    let map = match_pair(&left, &right, LARGEST, Matcher::Scanline).unwrap();
    println!("not rectified: density {:.4}", map.density());
    assert!(map.density() < 0.05, "{}", map.density());
}

#[test]
fn pictures_of_one_pixel_are_refused_in_words() {
    let one = GreyImage::new(1, 1, vec![7.0]).unwrap();
    for matcher in [Matcher::Scanline, Matcher::Coherence] {
        let message = match_pair(&one, &one, 1, matcher).unwrap_err().to_string();
        assert!(message.contains("images 1 pixels wide"), "{message}");
    }
}
