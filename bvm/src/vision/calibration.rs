//! The geometry of a rectified stereo pair, seen from its left camera.
//!
//! In: a TOML file with the keys `focal_px`, `cx_px`, `cy_px`, `baseline_m`, `doffs_px`, `max_disparity_px`
//! (`doffs_px` is cx of the right camera minus cx of the left). Out: [`Calibration`], checked, which turns
//! pixels and disparities into directions and ranges:
//!
//! ```text
//! Z = f·B / (d + doffs)     X = (x − cx)·Z/f     Y = (y − cy)·Z/f      (Y points down, as rows do)
//! ρ = √(X² + Y² + Z²)       θ = atan2(X, Z)      φ = atan2(−Y, √(X² + Z²))
//! σ_Z = Z²·σ_d / (f·B)      because |dZ/dd| = f·B/(d + doffs)² = Z²/(f·B)
//! ```
//!
//! Invariant: every number is finite, focal length and baseline are positive, `max_disparity_px >= 1`.

use std::path::Path;

use serde::Serialize;
use toml::{Table, Value};

use super::error::VisionError;

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
}

impl Calibration {
    /// Reads and checks a calibration file.
    pub fn read(path: &Path) -> Result<Self, VisionError> {
        let failed = |source| VisionError::Read { path: path.to_path_buf(), source };
        Self::parse(&std::fs::read_to_string(path).map_err(failed)?, path)
    }

    /// Checks the text of a calibration; `path` is only named in errors.
    pub fn parse(text: &str, path: &Path) -> Result<Self, VisionError> {
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
        let number = |key: &str, positive: bool| {
            let value = table.get(key).ok_or_else(|| wrong(key, "missing".into()))?;
            let found = match value {
                Value::Float(float) => *float,
                Value::Integer(integer) => *integer as f64,
                _ => f64::NAN,
            };
            let expected = if positive { "a finite number above 0" } else { "a finite number" };
            if found.is_finite() && (found > 0.0 || !positive) {
                Ok(found)
            } else {
                Err(wrong(key, format!("is {value}, expected {expected}")))
            }
        };
        let whole = |key: &str| match table.get(key) {
            Some(Value::Integer(integer)) if *integer >= 1 => Ok(*integer as usize),
            Some(value) => Err(wrong(key, format!("is {value}, expected a whole number of at least 1"))),
            None => Err(wrong(key, "missing".into())),
        };
        Ok(Self {
            focal_px: number("focal_px", true)?,
            cx_px: number("cx_px", false)?,
            cy_px: number("cy_px", false)?,
            baseline_m: number("baseline_m", true)?,
            doffs_px: number("doffs_px", false)?,
            max_disparity_px: whole("max_disparity_px")?,
        })
    }

    /// The largest disparity to search, pixels.
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

    /// Direction of a pixel: azimuth θ (positive to the right) and elevation φ (positive up), radians.
    pub fn direction(&self, x_px: f64, y_px: f64) -> (f64, f64) {
        let (right, down) = self.slopes(x_px, y_px);
        (right.atan(), (-down).atan2(right.hypot(1.0)))
    }

    /// Range ρ from the left camera, metres, of a pixel with a disparity; `None` where there is no depth.
    pub fn range_m(&self, x_px: f64, y_px: f64, disparity_px: f64) -> Option<f64> {
        let (right, down) = self.slopes(x_px, y_px);
        self.depth_m(disparity_px).map(|depth| depth * right.hypot(down).hypot(1.0))
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
