//! From a disparity map to one range reading per direction.
//!
//! In: a [`DisparityMap`], its [`Calibration`] and a grid of directions. Out: for each direction the reading
//! of its most confident pixel, or `None`. The pixels of one direction look at nearly the same place with the
//! same pair of images: they are not independent sensors, so one of them speaks for all. It is the one with
//! the highest confidence λ, then the nearest, then the first; a mean would put a surface between the two
//! sides of a depth edge.
//! Invariant: a reading has a finite positive range and a confidence in ]0, 1]; directions outside the image
//! or without a claim have none.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::calibration::Calibration;
use super::error::VisionError;
use super::stereo::DisparityMap;

/// What one direction of sight says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RangeReading {
    /// Distance ρ from the left camera, metres.
    pub range_m: f32,
    /// Confidence λ in ]0, 1].
    pub confidence: f32,
}

/// One reading per direction, indexed `[elevation row * azimuth_cells + azimuth column]`.
///
/// Column `j` covers the azimuths ]−π + j·Δθ, −π + (j+1)·Δθ] and row `i` the elevations
/// ]−π/2 + i·Δφ, −π/2 + (i+1)·Δφ], radians. Refuses steps that are not positive or that go beyond the sphere.
pub fn readings(
    map: &DisparityMap,
    calibration: &Calibration,
    azimuth_cells: usize,
    elevation_cells: usize,
    azimuth_step_rad: f64,
    elevation_step_rad: f64,
) -> Result<Vec<Option<RangeReading>>, VisionError> {
    check_axis("azimuth", azimuth_cells, azimuth_step_rad, TAU)?;
    check_axis("elevation", elevation_cells, elevation_step_rad, PI)?;
    let mut best: Vec<Option<RangeReading>> = vec![None; azimuth_cells * elevation_cells];
    for (at, (&disparity, &confidence)) in map.disparity.iter().zip(&map.confidence).enumerate() {
        if !(confidence > 0.0) {
            continue;
        }
        let (x, y) = ((at % map.width) as f64, (at / map.width) as f64);
        let Some(range) = calibration.range_m(x, y, f64::from(disparity)) else { continue };
        let (azimuth, elevation) = calibration.direction(x, y);
        let column = cell_of(azimuth + PI, azimuth_step_rad, azimuth_cells);
        let row = cell_of(elevation + FRAC_PI_2, elevation_step_rad, elevation_cells);
        let (Some(column), Some(row)) = (column, row) else { continue };
        let reading = RangeReading { range_m: range as f32, confidence: confidence.min(1.0) };
        let place = &mut best[row * azimuth_cells + column];
        if place.is_none_or(|held| beats(reading, held)) {
            *place = Some(reading);
        }
    }
    Ok(best)
}

/// Whether a reading takes the place of the one held.
fn beats(reading: RangeReading, held: RangeReading) -> bool {
    reading.confidence > held.confidence
        || (reading.confidence == held.confidence && reading.range_m < held.range_m)
}

/// The cell ]k·step, (k+1)·step] of an angle measured from the lower end of its axis.
fn cell_of(angle_rad: f64, step_rad: f64, cells: usize) -> Option<usize> {
    let index = (angle_rad / step_rad).ceil() - 1.0;
    (index >= 0.0 && index < cells as f64).then_some(index as usize)
}

fn check_axis(axis: &'static str, cells: usize, step_rad: f64, full_rad: f64) -> Result<(), VisionError> {
    let covered = cells as f64 * step_rad;
    if cells > 0 && step_rad > 0.0 && covered <= full_rad * (1.0 + 1e-9) {
        Ok(())
    } else {
        Err(VisionError::Directions { axis, cells, step_rad, full_rad })
    }
}
