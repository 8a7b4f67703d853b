//! Population codes: the likelihood of every range in a direction.
//!
//! In: the posterior of each pixel over its disparity, and a grid. Out: for each direction the likelihood of "No
//! Detection" and of each cell, up to a factor. An integer disparity represents the interval of one pixel around it;
//! disparities within one pixel of the estimate are placed around the estimate, with total probability λ, which is
//! calibrated:
//!
//! ```text
//! p'(d) = λ p(d) / Σ_near p  near the claim,    (1 − λ) p(d) / Σ_far p  elsewhere
//! code(z) = p'(disparities that lie in bin z) / (length of disparities searched in bin z)
//! ```
//!
//! The matcher has a uniform prior over disparities, so that its posterior divided by the length of a bin is a
//! likelihood. Without a posterior, the remainder 1 − λ is uniform. Invariant: codes are finite, not negative, and sum
//! to one.

use super::readings::PixelReading;
use super::{Calibration, DisparityMap, FrameEvidence};
use crate::grid::Grid;

/// Distance from the estimate, pixels, within which disparities are near it.
const NEAR: f32 = 1.5;

/// The posterior of every pixel over its disparity: eight bits for each integer disparity, its logarithm in steps of
/// 1/16 or less.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Population {
    levels: usize,
    kept: Vec<u8>,
}

/// Codes of directions: `None` without an estimate, else N + 1 numbers, the first for "No Detection".
pub type Codes = Vec<Option<Vec<f32>>>;

impl Population {
    /// The posteriors of all pixels, `levels` each.
    pub(super) fn new(levels: usize, kept: Vec<u8>) -> Self {
        Self { levels, kept }
    }

    /// P(D = d) of a pixel.
    pub fn belief(&self, pixel: usize) -> impl Iterator<Item = f32> {
        let own = &self.kept[pixel * self.levels..][..self.levels];
        // The least number means zero.
        own.iter().map(|kept| if *kept == 0 { 0.0 } else { super::stereo::long(*kept) })
    }
}

/// The codes of the selected pixels. Without a population, only each estimate and its λ are known.
pub fn codes(
    pixel_readings: &[Option<PixelReading>],
    map: &DisparityMap,
    heard: &FrameEvidence<'_>,
    calibration: &Calibration,
    grid: &Grid,
) -> Codes {
    let code = |reading: &Option<PixelReading>| {
        let pixel = reading.as_ref()?.pixel;
        let places = places(map, heard.population, calibration.max_disparity_px(), pixel);
        Some(in_bins(&places, &edges(map, calibration, grid, pixel, heard.camera_m)))
    };
    pixel_readings.iter().map(code).collect()
}

/// Intervals of disparities with their probabilities: from, to, P.
type Places = Vec<[f64; 3]>;

fn places(map: &DisparityMap, population: Option<&Population>, levels: usize, pixel: usize) -> Places {
    let (claim, lambda) = (map.disparity[pixel], f64::from(map.confidence[pixel]));
    let belief: Vec<f32> = match population {
        Some(population) => population.belief(pixel).collect(),
        None => vec![1.0; levels],
    };
    let is_near = |d: usize| (d as f32 - claim).abs() < NEAR;
    let far: f64 = (0..levels).filter(|d| !is_near(*d)).map(|d| f64::from(belief[d])).sum();
    let about = |at: f64, p: f64| [at - 0.5, at + 0.5, p];
    let sure = if far > 0.0 { lambda } else { 1.0 };
    // A given truth may lie outside the searched disparities.
    let mut places = vec![about(f64::from(claim).clamp(0.0, levels as f64 - 1.0), sure)];
    if far > 0.0 {
        let rest = (1.0 - lambda) / far;
        places.extend(
            (0..levels).filter(|d| !is_near(*d)).map(|d| about(d as f64, rest * f64::from(belief[d]))),
        );
    }
    places
}

/// The disparities of each bin along the line of sight of a pixel, lower end first; bin 0 is "No Detection". The first
/// cell includes nearer ranges; disparities that were not searched have no length.
fn edges(
    map: &DisparityMap,
    calibration: &Calibration,
    grid: &Grid,
    pixel: usize,
    camera: [f64; 3],
) -> Vec<[f64; 2]> {
    let (x, y) = ((pixel % map.width) as f64, (pixel / map.width) as f64);
    let searched = [-0.5, calibration.max_disparity_px() as f64 - 0.5];
    // The range from the camera at which the line of sight is at a range from the origin: |camera + r ray| = range.
    let ray = calibration.ray(x, y);
    let length = ray.iter().map(|part| part * part).sum::<f64>().sqrt();
    let along = (0..3).map(|axis| camera[axis] * ray[axis] / length).sum::<f64>();
    let away = camera.iter().map(|part| part * part).sum::<f64>();
    let from_camera = |range: f64| match away {
        0.0 => range,
        away => (along * along - away + range * range).max(0.0).sqrt() - along,
    };
    let of_range =
        |range: &f64| calibration.disparity_px(x, y, from_camera(*range)).clamp(searched[0], searched[1]);
    let mut ends: Vec<f64> = grid.edges_m().iter().map(of_range).collect();
    ends[0] = searched[1];
    let cells = ends.windows(2).map(|ends| [ends[1], ends[0]]);
    std::iter::once([searched[0], ends[ends.len() - 1]]).chain(cells).collect()
}

fn in_bins(places: &Places, bins: &[[f64; 2]]) -> Vec<f32> {
    let density = |&[low, high]: &[f64; 2]| {
        let inside = |&[from, to, p]: &[f64; 3]| p * (to.min(high) - from.max(low)).max(0.0) / (to - from);
        if high > low { places.iter().map(inside).sum::<f64>() / (high - low) } else { 0.0 }
    };
    let densities: Vec<f64> = bins.iter().map(density).collect();
    let total: f64 = densities.iter().sum();
    densities.iter().map(|density| (density / total) as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::GridConfiguration;
    use crate::vision::readings::pixel_readings;
    use std::path::Path;

    /// f·B = 8 px·m and no offset: ranges of 1, 2 and 4 m on the axis are disparities of 8, 4 and 2.
    fn calibration() -> Calibration {
        let text =
            "focal_px = 100\ncx_px = 0\ncy_px = 0\nbaseline_m = 0.08\ndoffs_px = 0\nmax_disparity_px = 10";
        Calibration::parse(text, Path::new("hand.toml"), None).unwrap()
    }

    fn code(disparity: f32, confidence: f32, population: Option<&Population>) -> Vec<f32> {
        let map = DisparityMap {
            width: 1,
            height: 1,
            disparity: vec![disparity],
            confidence: vec![confidence],
            spread: vec![0.0],
        };
        let grid = Grid::new(GridConfiguration {
            cells_rho: 2,
            rho_min_m: 1.0,
            rho_max_m: 4.0,
            azimuth_cells: 4,
            elevation_cells: 2,
        })
        .unwrap();
        let rig = calibration();
        let direction = |x, y| rig.direction(x, y);
        let steps = [grid.azimuth_step(), grid.elevation_step()];
        let pixel_readings = pixel_readings(&map, &rig, direction, [4, 2], steps).unwrap();
        let heard = FrameEvidence { population, ..FrameEvidence::default() };
        let codes = codes(&pixel_readings, &map, &heard, &rig, &grid);
        assert_eq!(codes.iter().flatten().count(), 1);
        codes.into_iter().flatten().next().unwrap()
    }

    fn close(found: &[f32], expected: [f32; 3]) {
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-3), "{found:?}, not {expected:?}");
    }

    #[test]
    fn codes_by_hand() {
        // Searched: −½ to 9½. "No Detection" is 2½ pixels long, the nearer cell, to its end, 5½, the farther one 2.
        close(&code(3.0, 1.0, None), [0.0, 0.0, 1.0]);
        // Half a pixel either side of the border at 4.
        let (near, far) = (0.5 / 5.5, 0.5 / 2.0);
        close(&code(4.0, 1.0, None), [0.0, near / (near + far), far / (near + far)]);
        // A truth that was not searched is in the first cell.
        close(&code(30.0, 1.0, None), [0.0, 1.0, 0.0]);
    }

    #[test]
    fn the_rest_goes_where_the_posterior_is() {
        // The estimate, at 3, has probability λ; the rest is at 7.
        let short = |p: f32| ((p.to_bits() >> 19) - (112 << 4)) as u8;
        let mut kept = vec![0; 10];
        (kept[3], kept[7]) = (short(0.75), short(0.25));
        let population = Population::new(10, kept);
        assert_eq!(population.belief(0).collect::<Vec<_>>()[3], 0.75);
        let (near, far) = (0.4 / 5.5, 0.6 / 2.0);
        close(&code(3.0, 0.6, Some(&population)), [0.0, near / (near + far), far / (near + far)]);
    }
}
