//! The geometry of a rectified stereo pair, seen from its left camera.
//!
//! In: a TOML file with the keys `focal_px`, `cx_px`, `cy_px`, `baseline_m`, `doffs_px`, `max_disparity_px` (`doffs_px`
//! is cx of the right camera minus cx of the left; whole disparities below `max_disparity_px` are searched), or a file
//! of Middlebury or KITTI. Out: a checked [`Calibration`], which converts pixels and disparities to directions and
//! ranges in the map's frame ([`crate::frame`]: positive to the left):
//!
//! ```text
//! Z = f·B / (d + doffs)     X = (x − cx)·Z/f     Y = (y − cy)·Z/f      (Y points down, as rows do)
//! ρ = √(X² + Y² + Z²)       θ = atan2(−X, Z)     φ = atan2(−Y, √(X² + Z²))
//! σ_Z = Z²·σ_d / (f·B)      because |dZ/dd| = f·B/(d + doffs)² = Z²/(f·B)
//! ```
//!
//! Invariant: every number is finite, focal length and baseline are positive, `max_disparity_px >= 1`; the size of the
//! pictures and redundant offsets in the file are checked.

use std::path::Path;

use serde::Serialize;
use toml::{Table, Value};

use super::error::VisionError;
use crate::frame::{angles, from_camera};
use crate::input;

mod files;
mod lookup;
pub mod raw;

pub use files::KITTI_DISPARITIES;

const KEYS: [&str; 6] = ["focal_px", "cx_px", "cy_px", "baseline_m", "doffs_px", "max_disparity_px"];

/// A calibration that has been checked.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Calibration {
    focal_px: f64,
    cx_px: f64,
    cy_px: f64,
    baseline_m: f64,
    doffs_px: f64,
    max_disparity_px: usize,
    /// Width and height of the pictures, pixels, if the file contains them.
    #[serde(skip_serializing_if = "Option::is_none")]
    picture_px: Option<[usize; 2]>,
}

impl Calibration {
    /// Reads and checks a calibration file: TOML, Middlebury or KITTI. The folder of the left image determines the
    /// KITTI cameras.
    ///
    /// # Errors
    /// A file that cannot be read, is longer than 1 MiB, or has a key that is missing or impossible.
    pub fn read(path: &Path, left: Option<&Path>) -> Result<Self, VisionError> {
        Self::parse(&input::text(path, input::MOST_OF_CALIBRATION)?, path, left)
    }

    /// Two parallel cameras without offset: focal length and centre in pixels, baseline in metres, and the number of
    /// disparities that are searched.
    ///
    /// # Errors
    /// A number that is not finite, or a length that is not positive.
    pub fn of_rig(
        focal_px: f64,
        centre_px: [f64; 2],
        baseline_m: f64,
        max_disparity_px: usize,
    ) -> Result<Self, VisionError> {
        let numbers = [focal_px, centre_px[0], centre_px[1], baseline_m, 0.0];
        checked(Path::new("cameras"), numbers, max_disparity_px)
    }

    /// Checks the text of a calibration; `path` is only named in errors.
    ///
    /// # Errors
    /// A key that is missing or impossible.
    pub fn parse(text: &str, path: &Path, left: Option<&Path>) -> Result<Self, VisionError> {
        if files::is_middlebury(text) {
            return files::middlebury(text, path);
        }
        if files::is_kitti(text) {
            return files::kitti(text, path, left);
        }
        Self::parse_toml(text, path)
    }

    fn parse_toml(text: &str, path: &Path) -> Result<Self, VisionError> {
        let table: Table = text.parse().map_err(|error: toml::de::Error| {
            let line = error.span().map_or(1, |span| 1 + text[..span.start].matches('\n').count());
            let reason = format!("line {line}: {}", error.message());
            VisionError::CalibrationSyntax { path: path.to_path_buf(), reason }
        })?;
        let wrong = |key: &str, reason: String| VisionError::CalibrationKey {
            path: path.to_path_buf(),
            key: key.to_string(),
            reason,
        };
        if let Some(key) = table.keys().find(|key| !KEYS.contains(&key.as_str())) {
            return Err(wrong(key, format!("unknown; expected {}", KEYS.join(", "))));
        }
        let number = |key: &str| match table.get(key) {
            Some(Value::Float(float)) => Ok(*float),
            Some(Value::Integer(integer)) => Ok(*integer as f64),
            Some(value) => Err(wrong(key, format!("is {value}, expected a number"))),
            None => Err(wrong(key, "missing".into())),
        };
        let [focal, cx, cy, baseline, doffs, most] = KEYS;
        let numbers = [number(focal)?, number(cx)?, number(cy)?, number(baseline)?, number(doffs)?];
        match table.get(most) {
            Some(Value::Integer(integer)) if *integer >= 1 => checked(path, numbers, *integer as usize),
            Some(value) => Err(wrong(most, format!("is {value}, expected a whole number of at least 1"))),
            None => Err(wrong(most, "missing".into())),
        }
    }

    /// Checks that the calibration is for pictures of this size; `path` is only named in errors. A file without a size
    /// matches any that are wider than its disparities.
    ///
    /// # Errors
    /// Another width or height, with the ratio of the two if it is a simple factor; as many disparities as the pictures are
    /// wide.
    pub fn check_pictures(&self, path: &Path, width: usize, height: usize) -> Result<(), VisionError> {
        if self.max_disparity_px >= width {
            let reason = format!(
                "{} disparities are searched (`max_disparity_px`; `ndisp` of Middlebury; {KITTI_DISPARITIES} of KITTI), but \
                 the pictures are {width} pixels wide: expected fewer than the width",
                self.max_disparity_px
            );
            return Err(VisionError::File { path: path.to_path_buf(), reason });
        }
        let Some([own_width, own_height]) = self.picture_px else { return Ok(()) };
        if (own_width, own_height) == (width, height) {
            return Ok(());
        }
        let key = if own_width == width { "height" } else { "width" };
        let factor = width as f64 / own_width as f64;
        let scaled = (own_height as f64 * factor - height as f64).abs() <= 1.0;
        let way_out = match scaled {
            true => format!("scale its pixels by {factor:.4}, or use the pictures of its own size"),
            false => "use the calibration of these pictures".to_owned(),
        };
        let reason = format!(
            "the file is for {own_width}x{own_height}, but the pictures are {width}x{height}: {way_out}"
        );
        Err(VisionError::CalibrationKey { path: path.to_path_buf(), key: key.to_owned(), reason })
    }

    /// f·B, pixels times metres: depth times disparity.
    pub fn depth_times_disparity(&self) -> f64 {
        self.focal_px * self.baseline_m
    }

    /// The ray through a pixel, in the camera's frame: X/Z, Y/Z and 1 (right, down, ahead).
    pub fn ray(&self, x_px: f64, y_px: f64) -> [f64; 3] {
        let (right, down) = self.slopes(x_px, y_px);
        [right, down, 1.0]
    }

    /// The length of [`Calibration::ray`].
    fn length_of_ray(&self, x_px: f64, y_px: f64) -> f64 {
        let (right, down) = self.slopes(x_px, y_px);
        (1.0 + right * right + down * down).sqrt()
    }

    /// Number of integer disparities to search, from 0.
    pub fn max_disparity_px(&self) -> usize {
        self.max_disparity_px
    }

    /// Depth Z along the optical axis, metres, of a disparity in pixels; `None` where the disparity is not
    /// finite or puts the point at infinity or behind the camera.
    pub fn depth_m(&self, disparity_px: f64) -> Option<f64> {
        let shift = disparity_px + self.doffs_px;
        let depth = self.focal_px * self.baseline_m / shift;
        (shift > 0.0 && depth.is_finite() && depth > 0.0).then_some(depth)
    }

    /// Direction of a pixel: azimuth θ (positive to the left) and elevation φ (positive up), radians.
    pub fn direction(&self, x_px: f64, y_px: f64) -> (f64, f64) {
        angles(from_camera(self.ray(x_px, y_px)))
    }

    /// The position of a pixel with a disparity in the map's frame, `[ahead, left, up]` in metres from the left camera;
    /// `None` where there is no depth.
    pub fn point_m(&self, x_px: f64, y_px: f64, disparity_px: f64) -> Option<[f64; 3]> {
        let depth = self.depth_m(disparity_px)?;
        Some(from_camera(self.ray(x_px, y_px).map(|slope| slope * depth)))
    }

    /// Range ρ from the left camera, metres, of a pixel with a disparity; `None` where there is no depth.
    pub fn range_m(&self, x_px: f64, y_px: f64, disparity_px: f64) -> Option<f64> {
        self.depth_m(disparity_px).map(|depth| depth * self.length_of_ray(x_px, y_px))
    }

    /// Disparity, pixels, of a point at a range from the left camera, metres, on the line of sight of a pixel.
    pub fn disparity_px(&self, x_px: f64, y_px: f64, range_m: f64) -> f64 {
        self.depth_times_disparity() * self.length_of_ray(x_px, y_px) / range_m - self.doffs_px
    }

    /// Standard deviation of the range, metres, at `range_m` on the optical axis for a disparity noise of
    /// `disparity_sigma_px`: ρ²·σ_d/(f·B). Off the axis the true value is smaller by the cosine of the angle.
    pub fn range_sigma_m(&self, range_m: f64, disparity_sigma_px: f64) -> f64 {
        range_m * range_m * disparity_sigma_px / (self.focal_px * self.baseline_m)
    }

    /// X/Z and Y/Z of a pixel.
    fn slopes(&self, x_px: f64, y_px: f64) -> (f64, f64) {
        ((x_px - self.cx_px) / self.focal_px, (y_px - self.cy_px) / self.focal_px)
    }
}

/// A calibration of focal length, centre (px), baseline (m), offset (px), in the order of the keys.
fn checked(path: &Path, numbers: [f64; 5], max_disparity_px: usize) -> Result<Calibration, VisionError> {
    for (key, value) in KEYS.into_iter().zip(numbers) {
        let positive = key == "focal_px" || key == "baseline_m";
        if !value.is_finite() || (positive && value <= 0.0) {
            let expected = if positive { "a finite number above 0" } else { "a finite number" };
            // TOML spells it `nan`.
            let found = value.to_string().to_lowercase();
            let reason = format!("is {found}, expected {expected}");
            return Err(VisionError::CalibrationKey {
                path: path.to_path_buf(),
                key: key.to_string(),
                reason,
            });
        }
    }
    let [focal_px, cx_px, cy_px, baseline_m, doffs_px] = numbers;
    Ok(Calibration { focal_px, cx_px, cy_px, baseline_m, doffs_px, max_disparity_px, picture_px: None })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::FRAC_PI_4;

    const GOOD: &str = "focal_px = 100.0\ncx_px = 50\ncy_px = 40.0\nbaseline_m = 0.5\ndoffs_px = 10.0\nmax_disparity_px = 64\n";

    fn parse(text: &str) -> Result<Calibration, VisionError> {
        Calibration::parse(text, Path::new("rig.toml"), None)
    }

    #[test]
    fn hand_geometry() {
        let rig = parse(GOOD).unwrap();
        assert_eq!(rig.max_disparity_px(), 64);
        // 100 px · 0.5 m / (15 + 10) px = 2 m.
        assert_eq!(rig.depth_m(15.0), Some(2.0));
        assert_eq!(rig.direction(50.0, 40.0), (0.0, 0.0));
        // Slope 3/4 makes a 3-4-5 triangle: range 2 · 5/4.
        assert_eq!(rig.range_m(125.0, 40.0, 15.0), Some(2.5));
        assert_eq!(rig.disparity_px(125.0, 40.0, 2.5), 15.0);
        let angle = 0.75f64.atan();
        assert!((rig.direction(125.0, 40.0).0 + angle).abs() < 1e-15, "to the right is negative");
        assert!((rig.direction(-25.0, 40.0).0 - angle).abs() < 1e-15);
        assert!((rig.direction(50.0, -35.0).1 - angle).abs() < 1e-15);
        // 2 m deep, 1.5 m to the right, 2.5 m up.
        assert_eq!(rig.point_m(125.0, -85.0, 15.0), Some([2.0, -1.5, 2.5]));
        // Slopes 3/4 right and 5/4 up: √(1 + 9/16) = 5/4, so 45° up.
        assert!((rig.direction(125.0, -85.0).1 - FRAC_PI_4).abs() < 1e-15);
        assert!((rig.range_m(125.0, -85.0, 15.0).unwrap() - 2.0 * 3.125f64.sqrt()).abs() < 1e-12);
        // 2² m² · 0.5 px / 50 px·m.
        assert!((rig.range_sigma_m(2.0, 0.5) - 0.04).abs() < 1e-15);
    }

    #[test]
    fn depth_noise_is_the_slope_of_depth() {
        let rig = parse(GOOD).unwrap();
        let slope = (rig.depth_m(14.999).unwrap() - rig.depth_m(15.001).unwrap()) / 0.002;
        assert!((rig.range_sigma_m(2.0, 1.0) - slope).abs() < 1e-6);
    }

    #[test]
    fn no_depth_at_infinity_or_behind() {
        let rig = parse(GOOD).unwrap();
        for disparity in [-10.0, -11.0, f64::INFINITY, f64::NAN] {
            assert_eq!(rig.depth_m(disparity), None, "{disparity}");
        }
    }

    #[test]
    fn each_fault_names_the_file_the_key_and_the_value() {
        let cases = [
            ("focal_px = 100.0", "focal_px = 0", "`focal_px`: is 0, expected a finite number above 0"),
            ("focal_px = 100.0", "focal_px = inf", "`focal_px`: is inf"),
            ("cx_px = 50", "cx_px = nan", "`cx_px`: is nan, expected a finite number"),
            ("cy_px = 40.0", "cy_px = 'middle'", "`cy_px`: is \"middle\""),
            ("baseline_m = 0.5", "baseline_m = -0.5", "`baseline_m`: is -0.5"),
            ("doffs_px = 10.0", "", "`doffs_px`: missing"),
            ("doffs_px = 10.0", "doffs = 10.0", "`doffs`: unknown; expected focal_px"),
            ("max_disparity_px = 64", "max_disparity_px = 0", "`max_disparity_px`: is 0, expected a whole"),
            ("max_disparity_px = 64", "max_disparity_px = 6.5", "`max_disparity_px`: is 6.5"),
            ("cx_px = 50", "cx_px = 50 50", "not valid TOML: line 2"),
        ];
        for (good, bad, expected) in cases {
            let message = parse(&GOOD.replace(good, bad)).unwrap_err().to_string();
            assert!(message.contains(expected) && message.contains("rig.toml"), "{message}");
        }
    }

    #[test]
    fn a_missing_file_is_named() {
        let message = Calibration::read(Path::new("nowhere/rig.toml"), None).unwrap_err().to_string();
        assert!(message.contains("cannot read `nowhere/rig.toml`"), "{message}");
    }

    proptest! {
        #[test]
        fn any_text_is_answered(text in "(?s).{0,200}") {
            let _ = parse(&text);
        }

        #[test]
        fn range_and_direction_lead_back_to_the_point(
            x in -200.0..300.0f64, y in -200.0..300.0f64, disparity in 0.0..64.0f64,
        ) {
            let rig = parse(GOOD).unwrap();
            let (depth, range) = (rig.depth_m(disparity).unwrap(), rig.range_m(x, y, disparity).unwrap());
            let (azimuth, elevation) = rig.direction(x, y);
            let flat = range * elevation.cos();
            prop_assert!((flat * azimuth.cos() - depth).abs() < 1e-9);
            prop_assert!((flat * azimuth.sin() + (x - 50.0) / 100.0 * depth).abs() < 1e-9);
            prop_assert!((range * elevation.sin() + (y - 40.0) / 100.0 * depth).abs() < 1e-9);
        }
    }
}
