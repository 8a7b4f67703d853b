//! Comparison of disparities with the truth.
//!
//! In: a [`DisparityMap`] and the true disparities of its left picture. Out: the pixels that count, the error of each
//! estimate, and curves of errors. Invariant: a pixel counts if its truth is a positive finite number and the right
//! camera sees it, by a z-buffer of the truth: no nearer point falls on the same right pixel.

use super::stereo::DisparityMap;
use super::{GreyImage, VisionError, image, pfm};
use std::path::Path;

/// True disparities of a left picture.
#[derive(Clone, Debug)]
pub struct Truth {
    /// Width, pixels.
    pub width: usize,
    /// Disparities, pixels; infinity where unknown.
    pub disparity: Vec<f32>,
    /// Which pixels count.
    pub counts: Vec<bool>,
}

/// An estimate and its error.
#[derive(Clone, Copy, Debug)]
pub struct Scored {
    /// Estimate minus truth, pixels.
    pub error: f32,
    /// λ of the matcher.
    pub confidence: f32,
    /// Reported standard deviation, pixels.
    pub sigma: f32,
}

impl Truth {
    /// Reads the truth: PFM, or an image whose grey levels (0 is unknown) are `scale` times the disparity.
    ///
    /// # Errors
    /// A file that cannot be read, has neither format, or contains no known disparity.
    pub fn read(path: &Path, scale: f64) -> Result<Self, VisionError> {
        let is_pfm = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("pfm"));
        let (width, values) = if is_pfm {
            let field = pfm::read(path)?;
            (field.width, field.values)
        } else {
            let image = image::read(path)?;
            (image.width(), image.pixels().iter().map(|level| level / scale as f32).collect())
        };
        let truth = Self::new(width, values);
        if truth.count() == 0 {
            let reason = format!(
                "contains no truth: none of its {}x{} disparities is a finite number above 0 that the right camera sees",
                width,
                truth.disparity.len() / width
            );
            return Err(VisionError::File { path: path.to_path_buf(), reason });
        }
        Ok(truth)
    }

    /// The truth of rows of disparities.
    pub fn new(width: usize, values: Vec<f32>) -> Self {
        let known = |value: &f32| value.is_finite() && *value > 0.0;
        let disparity: Vec<f32> =
            values.iter().map(|value| if known(value) { *value } else { f32::INFINITY }).collect();
        let mut counts = vec![false; disparity.len()];
        for (counts, row) in counts.chunks_exact_mut(width.max(1)).zip(disparity.chunks_exact(width.max(1))) {
            let place = |x: usize| (x as f32 - row[x]).round();
            let mut nearest = vec![0f32; width];
            for x in (0..width).filter(|x| place(*x) >= 0.0) {
                let there = &mut nearest[place(x) as usize];
                *there = there.max(row[x]);
            }
            for (x, counts) in counts.iter_mut().enumerate() {
                *counts = place(x) >= 0.0 && row[x] >= nearest[place(x) as usize] - 1.0;
            }
        }
        Self { width, disparity, counts }
    }

    /// Pixels that count.
    pub fn count(&self) -> usize {
        self.counts.iter().filter(|counts| **counts).count()
    }

    /// Checks that the truth is that of a picture; `path` is only named in errors.
    ///
    /// # Errors
    /// A picture of another size.
    pub fn check_picture(&self, path: &Path, picture: &GreyImage) -> Result<(), VisionError> {
        let height = self.disparity.len() / self.width.max(1);
        match (picture.width(), picture.height()) == (self.width, height) {
            true => Ok(()),
            false => {
                let (width, expected) = (self.width, (picture.width(), picture.height()));
                let reason = format!(
                    "the truth is {width}x{height}, but the left picture is {}x{}",
                    expected.0, expected.1
                );
                Err(VisionError::File { path: path.to_path_buf(), reason })
            }
        }
    }

    /// All estimates that count, the most confident first. The map has the size of the truth.
    pub fn score(&self, map: &DisparityMap) -> Vec<Scored> {
        let claims = (0..map.disparity.len()).filter(|&at| self.counts[at] && map.disparity[at].is_finite());
        let mut scored: Vec<Scored> = claims
            .map(|at| Scored {
                error: map.disparity[at] - self.disparity[at],
                confidence: map.confidence[at],
                sigma: map.sigma_px(at),
            })
            .collect();
        scored.sort_by(|one, other| other.confidence.total_cmp(&one.confidence));
        scored
    }
}

/// Share of the estimates with an error of more than `most` pixels; `None` if there are none.
pub fn wrong(scored: &[Scored], most: f32) -> Option<f64> {
    part(scored, |claim| claim.error.abs() > most)
}

/// Share of the estimates that satisfy a condition; `None` if there are none.
pub fn part(scored: &[Scored], holds: impl Fn(&Scored) -> bool) -> Option<f64> {
    let count = scored.iter().filter(|claim| holds(claim)).count();
    (!scored.is_empty()).then(|| count as f64 / scored.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hidden_and_unknown_pixels_do_not_count() {
        // On the right, 3 at x = 4 covers 1 at x = 2 (both at 1), and x = 1 with 2 lies outside.
        let truth = Truth::new(6, vec![f32::NAN, 2.0, 1.0, f32::INFINITY, 3.0, 0.0]);
        assert_eq!(truth.counts, [false, false, false, false, true, false]);
        let map = DisparityMap {
            width: 6,
            height: 1,
            disparity: vec![f32::INFINITY, 2.0, 1.0, 5.0, 5.5, 1.0],
            confidence: vec![0.0, 1.0, 1.0, 1.0, 0.5, 1.0],
            spread: vec![0.0; 6],
        };
        let scored = truth.score(&map);
        assert_eq!(scored.len(), 1);
        assert_eq!((scored[0].error, wrong(&scored, 2.0), wrong(&scored, 3.0)), (2.5, Some(1.0), Some(0.0)));
    }
}
