//! Dense stereo: the disparity of every pixel of the left view with a confidence, or no estimate.
//!
//! In: a rectified pair and the largest disparity to search. Out: [`DisparityMap`]. A point at column x of the left
//! image is at column x − d of the right one; the whole disparities 0..most are searched, as many as the
//! `numDisparities` of OpenCV or the `ndisp` of Middlebury. Two matchers, a folder each: Bayesian inference along scan
//! lines, and coherence detection; then estimates without support in their neighbourhood are removed. Invariant: a
//! pixel has either a finite disparity with confidence in ]0, 1], or infinity with confidence 0; the result does not
//! depend on the number of threads.

mod clean;
pub mod coherence;
mod lanes;
mod memory;
mod scanline;

pub(super) use scanline::long;

use super::error::VisionError;
use super::image::GreyImage;
use super::population::Population;
use serde::Serialize;

/// Limit of the candidates (pixels × disparities) of one search.
pub const MAX_CANDIDATES: usize = 1 << 30;

/// Least confidence of an estimate.
const LEAST_CONFIDENCE: f32 = 0.2;

/// The matching algorithm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Matcher {
    /// Bayesian inference along scan lines (`models/scanline.bp`).
    #[default]
    Scanline,
    /// Coherence detection (Henkel 1998).
    Coherence,
}

/// Disparities of a left view.
#[derive(Debug, Clone, PartialEq)]
pub struct DisparityMap {
    /// Width, pixels.
    pub width: usize,
    /// Height, pixels.
    pub height: usize,
    /// Disparity of each pixel, pixels, row by row; infinity without an estimate.
    pub disparity: Vec<f32>,
    /// Confidence λ of each pixel in ]0, 1]; 0 without an estimate.
    pub confidence: Vec<f32>,
    /// Standard deviation of the posterior of the disparity, pixels; infinity without an estimate.
    pub spread: Vec<f32>,
}

/// The estimate of a pixel before the rejection step.
#[derive(Clone, Copy, Debug)]
struct Estimate {
    /// The most probable integer disparity.
    winner: u16,
    /// Disparity, pixels.
    disparity: f32,
    /// λ in ]0, 1].
    confidence: f32,
    /// Standard deviation, pixels.
    spread: f32,
    /// The quality of the match of the pixel itself.
    support: Support,
}

/// The quality of a match at the estimated disparity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Support {
    /// Its cost there.
    cost: u8,
    /// Share of the disparities in the right image that match clearly worse, in 255ths.
    worse: u8,
}

impl Support {
    /// No estimate.
    const NONE: Self = Self { cost: u8::MAX, worse: 0 };
}

/// Standard deviation of a disparity that is otherwise certain, pixels: the resolution of pictures and windows.
pub const SIGMA_MIN_PX: f32 = 0.2;

impl DisparityMap {
    /// A map without estimates.
    fn empty(width: usize, height: usize) -> Self {
        let count = width * height;
        Self {
            width,
            height,
            disparity: vec![f32::INFINITY; count],
            confidence: vec![0.0; count],
            spread: vec![f32::INFINITY; count],
        }
    }

    /// Removes the estimate of a pixel.
    pub fn withdraw(&mut self, at: usize) {
        self.disparity[at] = f32::INFINITY;
        self.confidence[at] = 0.0;
        self.spread[at] = f32::INFINITY;
    }

    /// Standard deviation of a pixel's disparity, pixels: the spread of the posterior, and the least deviation.
    pub fn sigma_px(&self, at: usize) -> f32 {
        self.spread[at].hypot(SIGMA_MIN_PX)
    }

    /// Share of the pixels with an estimate, 0..=1.
    pub fn density(&self) -> f64 {
        let claims = self.confidence.iter().filter(|&&confidence| confidence > 0.0).count();
        claims as f64 / self.confidence.len().max(1) as f64
    }
}

/// Matches a rectified pair over the integer disparities `0..max_disparity`, pixels, with interpolation between them.
pub fn match_pair(
    left: &GreyImage,
    right: &GreyImage,
    max_disparity: usize,
    matcher: Matcher,
) -> Result<DisparityMap, VisionError> {
    matched(left, right, max_disparity, matcher, None)
}

/// [`match_pair`], and the posterior of every pixel; `None` for a matcher without a posterior.
pub fn match_pair_with_population(
    left: &GreyImage,
    right: &GreyImage,
    max_disparity: usize,
    matcher: Matcher,
) -> Result<(DisparityMap, Option<Population>), VisionError> {
    let mut kept = Vec::new();
    let map = matched(left, right, max_disparity, matcher, Some(&mut kept))?;
    let population = (matcher == Matcher::Scanline).then(|| Population::new(max_disparity, kept));
    Ok((map, population))
}

fn matched(
    left: &GreyImage,
    right: &GreyImage,
    max_disparity: usize,
    matcher: Matcher,
    kept: Option<&mut Vec<u8>>,
) -> Result<DisparityMap, VisionError> {
    let Levels { width, count: levels } = checked_levels(left, right, max_disparity)?;
    let (left, right) = alike(left, right);
    // Enter the thread pool once, rather than for each row.
    let mut map = rayon::scope(|_| match matcher {
        Matcher::Scanline => scanline::claims(&left, &right, width, levels, kept),
        Matcher::Coherence => coherence::detect(&left, &right, width, levels).left_claims(),
    });
    clean::drop_speckles(&mut map);
    Ok(map)
}

/// The disparities to search.
struct Levels {
    width: usize,
    /// The number of integer disparities.
    count: usize,
}

/// Refuses pairs that cannot be searched.
fn checked_levels(left: &GreyImage, right: &GreyImage, max_disparity: usize) -> Result<Levels, VisionError> {
    let (width, height) = (left.width(), left.height());
    if (width, height) != (right.width(), right.height()) {
        return Err(VisionError::PairSizes { left: (width, height), right: (right.width(), right.height()) });
    }
    if max_disparity == 0 || max_disparity >= width {
        return Err(VisionError::MaxDisparity { value: max_disparity, width });
    }
    let levels = max_disparity;
    if (width * height).checked_mul(levels).is_none_or(|count| count > MAX_CANDIDATES) {
        return Err(VisionError::TooLarge { width, height, levels, limit: MAX_CANDIDATES });
    }
    Ok(Levels { width, count: levels })
}

/// Both pictures in whole grey levels, the right one with the mean and the deviation of the left: cameras differ in
/// gain and offset.
fn alike(left: &GreyImage, right: &GreyImage) -> (Vec<u8>, Vec<u8>) {
    let whole =
        |image: &GreyImage| image.pixels().iter().map(|value| (value + 0.5) as u8).collect::<Vec<u8>>();
    let moments = |pixels: &[u8]| {
        let mut counts = [0usize; 256];
        pixels.iter().for_each(|pixel| counts[usize::from(*pixel)] += 1);
        let mean_of = |value: &dyn Fn(f64) -> f64| {
            let weighed = counts.iter().enumerate().map(|(level, count)| value(level as f64) * *count as f64);
            weighed.sum::<f64>() / pixels.len() as f64
        };
        let mean = mean_of(&|level| level);
        (mean, mean_of(&|level| (level - mean).powi(2)).sqrt())
    };
    let (left, mut right) = (whole(left), whole(right));
    let ((left_mean, left_deviation), (right_mean, right_deviation)) = (moments(&left), moments(&right));
    // A picture with a single grey level has no gain.
    let gain =
        if right_deviation > 0.0 && left_deviation > 0.0 { left_deviation / right_deviation } else { 1.0 };
    let turned: [u8; 256] =
        std::array::from_fn(|level| ((level as f64 - right_mean) * gain + left_mean).round() as u8);
    right.iter_mut().for_each(|pixel| *pixel = turned[usize::from(*pixel)]);
    (left, right)
}
