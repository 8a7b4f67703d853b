//! Range readings of directions from a disparity map.
//!
//! In: a [`DisparityMap`], its [`Calibration`] and a grid of directions. Out: for each direction the reading of its
//! most confident pixel, or `None`. The pixels of one direction see nearly the same place in the same pair of images:
//! they are not independent sensors, so only one is used. It is the one with the least deviation σ_d, then the nearest,
//! then the first; a mean would put a surface between the two sides of a depth edge. Its λ is that of Eq. 3, in
//! disparities: σ_d = [`SIGMA_MIN_PX`] / λ. Invariant: a reading has a finite positive range and a confidence in ]0,
//! 1]; directions outside the image or without an estimate have none.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::calibration::Calibration;
use super::error::VisionError;
use super::stereo::{DisparityMap, SIGMA_MIN_PX};
use crate::frame::Spherical;

/// A reading of one direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RangeReading {
    /// Distance ρ along the line of sight, metres. Beyond the grid it means "No Detection".
    pub range_m: f32,
    /// Confidence λ in ]0, 1].
    pub confidence: f32,
}

/// A reading with its pixel in the left picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PixelReading {
    /// The reading.
    pub reading: RangeReading,
    /// The pixel, `y * width + x`.
    pub pixel: usize,
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
    let direction = |x, y| calibration.direction(x, y);
    let (cells, steps) = ([azimuth_cells, elevation_cells], [azimuth_step_rad, elevation_step_rad]);
    let pixel_readings = pixel_readings(map, calibration, direction, cells, steps)?;
    Ok(pixel_readings.iter().map(|found| found.map(|found| found.reading)).collect())
}

/// [`readings`] with their pixels, for a turned head: `direction` gives the azimuth and elevation of a pixel, radians.
///
/// # Errors
/// Steps that are not positive or that go beyond the sphere.
pub fn pixel_readings(
    map: &DisparityMap,
    calibration: &Calibration,
    direction: impl Fn(f64, f64) -> (f64, f64),
    cells: [usize; 2],
    steps_rad: [f64; 2],
) -> Result<Vec<Option<PixelReading>>, VisionError> {
    let place = |x: f64, y: f64, rho_m: f64| {
        let (azimuth, elevation) = direction(x, y);
        Spherical { rho_m, azimuth, elevation }
    };
    placed_readings(map, calibration, place, cells, steps_rad)
}

/// [`pixel_readings`] for a camera that is not at the origin of the directions: `place` gives the place of a pixel at a
/// range from the camera, m, seen from that origin.
///
/// # Errors
/// Steps that are not positive or that go beyond the sphere.
pub fn placed_readings(
    map: &DisparityMap,
    calibration: &Calibration,
    place: impl Fn(f64, f64, f64) -> Spherical,
    [azimuth_cells, elevation_cells]: [usize; 2],
    [azimuth_step_rad, elevation_step_rad]: [f64; 2],
) -> Result<Vec<Option<PixelReading>>, VisionError> {
    check_axis("azimuth", azimuth_cells, azimuth_step_rad, TAU)?;
    check_axis("elevation", elevation_cells, elevation_step_rad, PI)?;
    let mut best: Vec<Option<PixelReading>> = vec![None; azimuth_cells * elevation_cells];
    let nowhere = Spherical { rho_m: f64::NAN, azimuth: f64::NAN, elevation: f64::NAN };
    let mut places = vec![nowhere; map.width];
    let instructions = pulp::Arch::new();
    for at in 0..map.disparity.len() {
        let (x, y) = (at % map.width, at / map.width);
        if x == 0 {
            // A row at once, without branches.
            let row = &map.disparity[at..at + map.width];
            instructions.dispatch(Row { calibration, row, y: y as f64, place: &place, places: &mut places });
        }
        let confidence = map.confidence[at];
        if confidence.is_nan() || confidence <= 0.0 {
            continue;
        }
        let Spherical { rho_m: range, azimuth, elevation } = places[x];
        if range.is_nan() {
            continue;
        }
        let column = cell_of(azimuth + PI, azimuth_step_rad, azimuth_cells);
        let row = cell_of(elevation + FRAC_PI_2, elevation_step_rad, elevation_cells);
        let (Some(column), Some(row)) = (column, row) else { continue };
        let reading = RangeReading { range_m: range as f32, confidence: SIGMA_MIN_PX / map.sigma_px(at) };
        let place = &mut best[row * azimuth_cells + column];
        if place.is_none_or(|held| beats(reading, held.reading)) {
            *place = Some(PixelReading { reading, pixel: at });
        }
    }
    Ok(best)
}

/// The places of the pixels of a row; NaN without a depth.
struct Row<'r, P> {
    calibration: &'r Calibration,
    row: &'r [f32],
    y: f64,
    place: &'r P,
    places: &'r mut [Spherical],
}

impl<P: Fn(f64, f64, f64) -> Spherical> pulp::NullaryFnOnce for Row<'_, P> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for (x, (place, disparity)) in self.places.iter_mut().zip(self.row).enumerate() {
            let x = x as f64;
            let range = self.calibration.range_m(x, self.y, f64::from(*disparity));
            *place = (self.place)(x, self.y, range.unwrap_or(f64::NAN));
        }
    }
}

/// Whether a reading replaces the current one of its direction.
fn beats(reading: RangeReading, held: RangeReading) -> bool {
    reading.confidence > held.confidence
        || (reading.confidence == held.confidence && reading.range_m < held.range_m)
}

/// The cell ]k·step, (k+1)·step] of an angle measured from the lower end of its axis; an angle that misses an
/// edge by rounding alone lies on it.
fn cell_of(angle_rad: f64, step_rad: f64, cells: usize) -> Option<usize> {
    let place = angle_rad / step_rad;
    let edge = place.round();
    let index = if (place - edge).abs() < 1e-9 { edge - 1.0 } else { place.ceil() - 1.0 };
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    /// Focal length 100 px, centre (2, 1), f·B = 50 px·m, no offset: disparity 25 is 2 m deep.
    fn calibration() -> Calibration {
        let text =
            "focal_px = 100\ncx_px = 2\ncy_px = 1\nbaseline_m = 0.5\ndoffs_px = 0\nmax_disparity_px = 30";
        Calibration::parse(text, Path::new("hand.toml"), None).unwrap()
    }

    /// A map 5×3 with estimates given as (x, y, disparity, confidence).
    fn map(claims: &[(usize, usize, f32, f32)]) -> DisparityMap {
        let mut map = DisparityMap {
            width: 5,
            height: 3,
            disparity: vec![f32::INFINITY; 15],
            confidence: vec![0.0; 15],
            spread: vec![f32::INFINITY; 15],
        };
        for &(x, y, disparity, confidence) in claims {
            map.disparity[y * 5 + x] = disparity;
            map.confidence[y * 5 + x] = confidence;
            // The spread for which λ of Eq. 3 is the given confidence.
            map.spread[y * 5 + x] = SIGMA_MIN_PX * (confidence.powi(-2) - 1.0).sqrt();
        }
        map
    }

    fn quadrants(map: &DisparityMap) -> Vec<Option<RangeReading>> {
        readings(map, &calibration(), 4, 2, FRAC_PI_2, FRAC_PI_2).unwrap()
    }

    #[test]
    fn the_upper_edge_belongs_to_a_cell() {
        // Straight ahead: azimuth 0 ends column 1, elevation 0 ends row 0.
        let found = quadrants(&map(&[(2, 1, 25.0, 0.5)]));
        let reading = found[1].unwrap();
        assert!(reading.range_m == 2.0 && (reading.confidence - 0.5).abs() < 1e-6);
        assert_eq!(found.iter().flatten().count(), 1);
    }

    #[test]
    fn left_and_up_are_positive() {
        let found = quadrants(&map(&[(0, 0, 25.0, 0.5)]));
        // Slopes −0.02 and −0.01: ρ = 2·√(1 + 0.0004 + 0.0001). Column 2 is ]0; 90°], to the left; row 1 is up.
        let reading = found[4 + 2].unwrap();
        assert!((f64::from(reading.range_m) - 2.0 * 1.0005f64.sqrt()).abs() < 1e-6);
        assert_eq!(found.iter().flatten().count(), 1);
    }

    #[test]
    fn the_most_confident_pixel_is_read_then_the_nearest() {
        let found = quadrants(&map(&[(4, 1, 25.0, 0.5), (3, 1, 10.0, 0.9), (2, 1, 20.0, 0.9)]));
        let reading = found[1].unwrap();
        assert!(reading.range_m == 2.5 && (reading.confidence - 0.9).abs() < 1e-6);
    }

    #[test]
    fn no_claim_no_reading() {
        // No estimate; a disparity of zero is at infinity.
        assert!(quadrants(&map(&[])).iter().all(Option::is_none));
        assert!(quadrants(&map(&[(2, 1, 0.0, 0.9)])).iter().all(Option::is_none));
    }

    #[test]
    fn one_degree_edges_survive_rounding() {
        let degree = 1f64.to_radians();
        for cell in 0..360 {
            assert_eq!(cell_of(f64::from(cell + 1) * degree, degree, 360), Some(cell as usize));
        }
        assert_eq!(cell_of(0.0, degree, 360), None);
        assert_eq!(cell_of(361.0 * degree, degree, 360), None);
    }

    #[test]
    fn impossible_grids_are_refused() {
        let (map, calibration) = (map(&[]), calibration());
        for (cells, step) in [(0, 0.1), (4, 0.0), (4, -1.0), (4, f64::NAN), (5, FRAC_PI_2)] {
            let error = readings(&map, &calibration, cells, 2, step, FRAC_PI_2).unwrap_err();
            assert!(error.to_string().contains("azimuth"), "{error}");
        }
        assert!(readings(&map, &calibration, 4, 3, FRAC_PI_2, FRAC_PI_2).is_err());
    }
}
