//! Coherence detection: many poor disparity estimates, of which the true ones agree.
//!
//! In: a rectified pair in whole grey levels. Out: [`Cyclopean`], the disparity, the verification count and the
//! picture of an eye half way between, and the claims of the left view. Three spatial scales, each half as fine as
//! the one before, are in one stack: of the coherent classes of a direction the largest speaks; where those
//! of other scales agree with it they are one class, and the finest says the disparity. With N the number of units,
//!
//! ```text
//! λ = N(largest coherent class) / N(stack)        I_c(x) = ½ [I_L(x + d/2) + I_R(x − d/2)]
//! ```
//!
//! Invariant: directions are independent of each other; 0 <= λ <= 1.
//! Reference: R. D. Henkel, A simple and fast neural network approach to stereovision, NIPS 10, 1998.

mod stack;

use super::Claim;
use crate::vision::{GreyImage, VisionError};
use stack::{Classes, classes};

/// How far, in pixels of the coarser scale, the classes of two scales may be apart and still agree.
const AGREE: f32 = 0.6;
/// Spatial scales.
const SCALES: usize = 3;
/// Fewest units of a class that makes a claim.
const LEAST_UNITS: f32 = 6.0;

/// What an eye half way between the two would see.
#[derive(Clone, Debug)]
pub struct Cyclopean {
    /// Width, pixels.
    pub width: usize,
    /// Disparity of each direction, pixels; infinity where no units agree.
    pub disparity: Vec<f32>,
    /// Verification count λ.
    pub verification: Vec<f32>,
}

/// Detects coherence over the disparities `0..levels`.
pub(super) fn detect(left: &[u8], right: &[u8], width: usize, levels: usize) -> Cyclopean {
    let mut scales: Vec<(Classes, usize)> = Vec::new();
    let (mut pictures, mut size) = ([left.to_vec(), right.to_vec()], width);
    let mut layers = levels;
    for _ in 0..SCALES {
        scales.push((classes(&pictures[0], &pictures[1], size, layers), size));
        if size < 16 || pictures[0].len() / size < 16 || layers < 4 {
            break;
        }
        pictures = pictures.map(|picture| halved(&picture, size));
        (size, layers) = (size / 2, layers.div_ceil(2));
    }
    let units: usize = scales.iter().map(|(classes, _)| classes.layers).sum();
    let height = left.len() / width;
    let mut found =
        Cyclopean { width, disparity: vec![f32::INFINITY; left.len()], verification: vec![0.0; left.len()] };
    for y in 0..height {
        for x in 0..width {
            let at = y * width + x;
            let mut told: [(f32, f32, f32); SCALES] = [(f32::INFINITY, 0.0, 1.0); SCALES];
            for (scale, (told, (classes, size))) in told.iter_mut().zip(&scales).enumerate() {
                let rows = classes.disparity.len() / size;
                let place = (y >> scale).min(rows - 1) * size + (x >> scale).min(size - 1);
                let unit = (1u32 << scale) as f32;
                *told = (classes.disparity[place] * unit, classes.members[place], unit);
            }
            // The largest class; of equals the finest.
            let (mut best, mut members) = (told[0].0, told[0].1);
            for &(disparity, count, _) in &told[1..] {
                if count > members {
                    (best, members) = (disparity, count);
                }
            }
            let agrees = |&(disparity, count, unit): &(f32, f32, f32)| {
                count > 0.0 && (disparity - best).abs() <= AGREE * unit.max(1.0)
            };
            let class = told.iter().filter(|told| agrees(told));
            let total: f32 = class.clone().map(|told| told.1).sum();
            if total < LEAST_UNITS {
                continue;
            }
            let disparity = class.clone().next().map_or(best, |told| told.0).clamp(0.0, levels as f32 - 0.5);
            found.disparity[at] = disparity;
            found.verification[at] = total / units as f32;
        }
    }
    found
}

/// What the eye half way between sees of a rectified pair, with the disparities `0..max_disparity` (pixels).
///
/// # Errors
/// Those of [`super::match_pair`].
pub fn cyclopean(
    left: &GreyImage,
    right: &GreyImage,
    max_disparity: usize,
) -> Result<(Cyclopean, Vec<u8>), VisionError> {
    let levels = super::checked_levels(left, right, max_disparity)?;
    let (left, right) = super::alike(left, right);
    let found = rayon::scope(|_| detect(&left, &right, levels.width, levels.count));
    let view = found.view(&left, &right);
    Ok((found, view))
}

impl Cyclopean {
    /// The fused picture, grey levels: 0 where no units agree.
    fn view(&self, left: &[u8], right: &[u8]) -> Vec<u8> {
        let fused = |(at, disparity): (usize, &f32)| {
            if !disparity.is_finite() {
                return 0;
            }
            let (row, x) = (at / self.width * self.width, (at % self.width) as f32);
            let sample = |picture: &[u8], place: f32| {
                f32::from(picture[row + ((place + 0.5).max(0.0) as usize).min(self.width - 1)])
            };
            let half = disparity / 2.0;
            (0.5 * (sample(left, x + half) + sample(right, x - half)) + 0.5) as u8
        };
        self.disparity.iter().enumerate().map(fused).collect()
    }

    /// The claims of the left view: each direction is seen half its disparity to the right; of two on one pixel the
    /// nearer hides the other; a pixel between two of one surface belongs to it.
    pub(super) fn left_claims(&self) -> Vec<Option<Claim>> {
        let mut claims: Vec<Option<Claim>> = vec![None; self.disparity.len()];
        for (row, claims) in claims.chunks_exact_mut(self.width).enumerate() {
            let mut before: Option<(f32, f32)> = None;
            for x in 0..self.width {
                let at = row * self.width + x;
                let (disparity, confidence) = (self.disparity[at], self.verification[at]);
                if !disparity.is_finite() {
                    before = None;
                    continue;
                }
                let place = x as f32 + 0.25 + disparity / 2.0;
                let from = match before {
                    Some((seen, other)) if (disparity - other).abs() <= 1.0 && place - seen < 2.0 => {
                        seen.ceil()
                    }
                    _ => (place + 0.5).floor(),
                };
                let end = place.max(from) as usize;
                let claim = Claim {
                    winner: (disparity + 0.5) as u16,
                    cost: 0,
                    disparity,
                    confidence,
                    spread: stack::COHERENT,
                    worse: 1.0,
                };
                for place in claims.iter_mut().take(end + 1).skip(from as usize) {
                    if place.is_none_or(|held| held.disparity < disparity) {
                        *place = Some(claim);
                    }
                }
                before = Some((place, disparity));
            }
        }
        claims
    }
}

/// Half the size: means of four.
fn halved(picture: &[u8], width: usize) -> Vec<u8> {
    let (columns, rows) = (width / 2, picture.len() / width / 2);
    let mean = |at: usize| {
        let corner = 2 * (at / columns) * width + 2 * (at % columns);
        let of = |offset: usize| u32::from(picture[corner + offset]);
        ((of(0) + of(1) + of(width) + of(width + 1) + 2) / 4) as u8
    };
    (0..columns * rows).map(mean).collect()
}
