//! Dense stereo: the disparity of every pixel of the left view, with a confidence, or no claim.
//!
//! In: a rectified pair and the largest disparity to search. Out: [`DisparityMap`]. A point at column x of the
//! left image is at column x − d of the right one, 0 <= d <= largest. Four steps, a file each: matching costs
//! (census), semi-global aggregation, selection with left–right check, withdrawal of unsupported claims.
//! Invariant: a pixel either claims a finite disparity with confidence in ]0, 1], or holds infinity with
//! confidence 0; the result does not depend on the number of threads.

mod aggregate;
mod clean;
mod select;
mod volume;

use super::error::VisionError;
use super::image::GreyImage;

/// Most candidates (pixels × disparities) that are searched at once.
pub const MAX_CANDIDATES: usize = 1 << 30;

/// Least confidence of a claim.
const LEAST_CONFIDENCE: f32 = 0.3;

/// Disparities of a left view.
#[derive(Debug, Clone, PartialEq)]
pub struct DisparityMap {
    /// Width, pixels.
    pub width: usize,
    /// Height, pixels.
    pub height: usize,
    /// Disparity of each pixel, pixels, row by row; infinity where no claim is made.
    pub disparity: Vec<f32>,
    /// Confidence λ of each pixel in ]0, 1]; 0 where no claim is made.
    pub confidence: Vec<f32>,
}

impl DisparityMap {
    /// Part of the pixels that make a claim, 0..=1.
    pub fn density(&self) -> f64 {
        let claims = self.confidence.iter().filter(|&&confidence| confidence > 0.0).count();
        claims as f64 / self.confidence.len().max(1) as f64
    }
}

/// Matches a rectified pair over the disparities `0..=max_disparity`, pixels.
pub fn match_pair(
    left: &GreyImage,
    right: &GreyImage,
    max_disparity: usize,
) -> Result<DisparityMap, VisionError> {
    let (width, height) = (left.width(), left.height());
    if (width, height) != (right.width(), right.height()) {
        return Err(VisionError::PairSizes { left: (width, height), right: (right.width(), right.height()) });
    }
    if max_disparity == 0 || max_disparity >= width {
        return Err(VisionError::MaxDisparity { value: max_disparity, width });
    }
    let levels = max_disparity + 1;
    if (width * height).checked_mul(levels).is_none_or(|count| count > MAX_CANDIDATES) {
        return Err(VisionError::TooLarge { width, height, levels, limit: MAX_CANDIDATES });
    }
    let volume = volume::CostVolume::of_pair(left, right, levels);
    let sums = aggregate::aggregate(&volume, left.pixels());
    let mut claims = select::claims(&volume, &sums);
    claims.iter_mut().for_each(|claim| *claim = claim.filter(|claim| claim.confidence >= LEAST_CONFIDENCE));
    clean::drop_unsupported(&mut claims, width);
    clean::drop_speckles(&mut claims, width);
    Ok(DisparityMap {
        width,
        height,
        disparity: claims.iter().map(|claim| claim.map_or(f32::INFINITY, |claim| claim.disparity)).collect(),
        confidence: claims.iter().map(|claim| claim.map_or(0.0, |claim| claim.confidence)).collect(),
    })
}
