//! Dense stereo: the disparity of every pixel of the left view, with a confidence, or no claim.
//!
//! In: a rectified pair and the largest disparity to search. Out: [`DisparityMap`]. A point at column x of the
//! left image is at column x − d of the right one, 0 <= d <= largest. Two matchers, a folder each: Bayesian inference
//! along scan lines, and coherence detection; then the claims that their neighbourhood does not support are withdrawn.
//! Invariant: a pixel either claims a finite disparity with confidence in ]0, 1], or holds infinity with
//! confidence 0; the result does not depend on the number of threads.

mod clean;
mod scanline;

use super::error::VisionError;
use super::image::GreyImage;

/// Most candidates (pixels × disparities) that are searched at once.
pub const MAX_CANDIDATES: usize = 1 << 30;

/// Least confidence of a claim.
const LEAST_CONFIDENCE: f32 = 0.2;

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
    /// Standard deviation of what is believed of the disparity, pixels; infinity where no claim is made.
    pub spread: Vec<f32>,
}

/// What a pixel says before its neighbours have been asked.
#[derive(Clone, Copy, Debug)]
struct Claim {
    /// The whole disparity that is believed most.
    winner: usize,
    /// Disparity, pixels.
    disparity: f32,
    /// λ in ]0, 1].
    confidence: f32,
    /// Standard deviation, pixels.
    spread: f32,
    /// Matching cost of the pixel itself at the disparity claimed.
    cost: u8,
    /// Matching cost of the pixel itself, averaged over all disparities that the right image shows.
    mean_cost: f32,
    /// Part of these disparities that match clearly worse than the one claimed.
    worse: f32,
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
    let (left, right) = alike(left, right);
    let mut claims = scanline::claims(&left, &right, width, levels);
    claims.iter_mut().for_each(|claim| *claim = claim.filter(|claim| claim.confidence >= LEAST_CONFIDENCE));
    clean::drop_unsupported(&mut claims, width);
    clean::drop_speckles(&mut claims, width);
    Ok(DisparityMap {
        width,
        height,
        disparity: claims.iter().map(|claim| claim.map_or(f32::INFINITY, |claim| claim.disparity)).collect(),
        confidence: claims.iter().map(|claim| claim.map_or(0.0, |claim| claim.confidence)).collect(),
        spread: claims.iter().map(|claim| claim.map_or(f32::INFINITY, |claim| claim.spread)).collect(),
    })
}

/// Both pictures in whole grey levels, the right one with the mean and the deviation of the left: cameras differ in
/// gain and offset.
fn alike(left: &GreyImage, right: &GreyImage) -> (Vec<u8>, Vec<u8>) {
    let moments = |image: &GreyImage| {
        let count = image.pixels().len() as f64;
        let mean = image.pixels().iter().map(|&value| f64::from(value)).sum::<f64>() / count;
        let squares = image.pixels().iter().map(|&value| (f64::from(value) - mean).powi(2)).sum::<f64>();
        (mean as f32, (squares / count).sqrt() as f32)
    };
    let whole = |value: f32| (value + 0.5) as u8;
    let ((left_mean, left_deviation), (right_mean, right_deviation)) = (moments(left), moments(right));
    // A picture of one grey has no gain.
    let gain = if right_deviation > 0.0 && left_deviation > 0.0 { left_deviation / right_deviation } else { 1.0 };
    let turned = |value: &f32| whole((value - right_mean) * gain + left_mean);
    (left.pixels().iter().map(|value| whole(*value)).collect(), right.pixels().iter().map(turned).collect())
}
