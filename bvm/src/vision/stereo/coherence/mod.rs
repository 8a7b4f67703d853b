//! Coherence detection: many imprecise disparity estimates, of which the correct ones agree.
//!
//! In: a rectified pair in whole grey levels. Out: [`Cyclopean`], the disparity, the verification count and the picture
//! of an eye half way between the cameras, and the estimates of the left view. Three spatial scales, each half as fine
//! as the previous one, form one stack. The largest coherent class of a direction wins; classes of other scales that
//! agree are merged with it, and the finest gives the disparity. With N the number of units,
//!
//! ```text
//! λ = N(largest coherent class) / N(stack)        I_c(x) = ½ [I_L(x + d/2) + I_R(x − d/2)]
//! ```
//!
//! Invariant: directions are independent of each other; 0 <= λ <= 1.
//! Reference: R. D. Henkel, A simple and fast neural network approach to stereovision, NIPS 10, 1998.

mod stack;

use super::DisparityMap;
use crate::vision::{GreyImage, VisionError};
use pulp::{Arch, Simd, WithSimd};
use stack::{Classes, classes};

/// Tolerance, in pixels of the coarser scale, within which classes of two scales agree.
const AGREE: f32 = 0.6;
/// Spatial scales.
const SCALES: usize = 3;
/// Least number of units of a class with an estimate.
const LEAST_UNITS: f32 = 6.0;

/// Number of estimates to either side that are compared, and their spacing in pixels: twice the reach of the finest
/// scale's windows.
const NEIGHBOURS: usize = 3;
const STRIDE: usize = 2;
/// Largest difference between two estimates of one surface, pixels.
const SAME_SURFACE: f32 = 1.0;

/// The view of an eye half way between the cameras.
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
    // For each scale a row as wide as the picture: disparities in pixels of the picture, and members; empty for a scale
    // that is not used.
    let mut rows: [[Vec<f32>; 2]; SCALES] =
        std::array::from_fn(|_| [vec![f32::INFINITY; width], vec![0.0; width]]);
    let arch = Arch::new();
    let output = found.disparity.chunks_exact_mut(width).zip(found.verification.chunks_exact_mut(width));
    for (y, (disparity, verification)) in output.take(height).enumerate() {
        for (scale, ([disparities, members], (classes, size))) in rows.iter_mut().zip(&scales).enumerate() {
            let first = (y >> scale).min(classes.disparity.len() / size - 1) * size;
            let unit = (1u32 << scale) as f32;
            for (x, (disparity, members)) in disparities.iter_mut().zip(members).enumerate() {
                let place = first + (x >> scale).min(size - 1);
                (*disparity, *members) = (classes.disparity[place] * unit, classes.members[place]);
            }
        }
        let (units, most) = (units as f32, levels as f32 - 0.5);
        arch.dispatch(Directions { rows: &rows, units, most, disparity, verification });
    }
    found
}

/// Some directions, with the known classes of each scale.
struct Directions<'d> {
    rows: &'d [[Vec<f32>; 2]; SCALES],
    units: f32,
    most: f32,
    disparity: &'d mut [f32],
    verification: &'d mut [f32],
}

impl WithSimd for Directions<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let width = self.disparity.len();
        let rows = self.rows.each_ref().map(|[disparity, members]| (&disparity[..width], &members[..width]));
        for (x, (disparity, verification)) in self.disparity.iter_mut().zip(self.verification).enumerate() {
            let classes: [(f32, f32); SCALES] = rows.map(|(disparity, members)| (disparity[x], members[x]));
            // The largest class; among equals the finest.
            let larger = |held: (f32, f32), class: &(f32, f32)| if class.1 > held.1 { *class } else { held };
            let (best, _) = classes[1..].iter().fold(classes[0], larger);
            // Classes that agree are merged with it; the finest gives the disparity.
            let (mut total, mut finest) = (0.0, best);
            for scale in (0..SCALES).rev() {
                let (disparity, members) = classes[scale];
                let agrees = (members > 0.0) & ((disparity - best).abs() <= AGREE * (1u32 << scale) as f32);
                total += if agrees { members } else { 0.0 };
                finest = if agrees { disparity } else { finest };
            }
            let is_claimed = total >= LEAST_UNITS;
            *disparity = if is_claimed { finest.clamp(0.0, self.most) } else { f32::INFINITY };
            *verification = if is_claimed { total / self.units } else { 0.0 };
        }
    }
}

/// The view half way between the cameras of a rectified pair, with the disparities `0..max_disparity` (pixels).
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

    /// The estimates of the left view: each direction is half its disparity to the right; of two on one pixel the
    /// nearer occludes the other; a pixel between two of one surface belongs to it.
    pub(super) fn left_claims(&self) -> DisparityMap {
        let width = self.width;
        let mut map = DisparityMap::empty(width, self.disparity.len() / width.max(1));
        for (y, row) in self.disparity.chunks_exact(width).enumerate() {
            let mut before: Option<(f32, f32)> = None;
            for (x, &disparity) in row.iter().enumerate() {
                if !disparity.is_finite() {
                    before = None;
                    continue;
                }
                let place = x as f32 + 0.25 + disparity / 2.0;
                // Positions are not negative: the conversion rounds down.
                let from = match before {
                    Some((seen, other)) if (disparity - other).abs() <= 1.0 && place - seen < 2.0 => {
                        let whole = seen as usize;
                        whole + usize::from(whole as f32 != seen)
                    }
                    _ => (place + 0.5) as usize,
                };
                let end = (place as usize).max(from);
                for at in y * width + from..y * width + (end + 1).min(width) {
                    if map.confidence[at] == 0.0 || map.disparity[at] < disparity {
                        map.disparity[at] = disparity;
                        map.confidence[at] = self.verification[y * width + x];
                        map.spread[at] = stack::COHERENT;
                    }
                }
                before = Some((place, disparity));
            }
        }
        map.confidence = supported(&map);
        map
    }
}

/// λ of each estimate, times the share of its surroundings on the same surface. Across the border of a near surface the
/// windows of its units, at the coarse scales most of all, still agree: the count is high there, and wrong.
fn supported(map: &DisparityMap) -> Vec<f32> {
    let (width, height) = (map.width, map.height);
    let mut confidence = map.confidence.clone();
    let reach = NEIGHBOURS * STRIDE;
    let offsets = || (0..=2 * reach).step_by(STRIDE);
    // Rows padded beyond both ends.
    let mut padded = vec![f32::INFINITY; (width + 2 * reach) * height];
    for (padded, row) in padded.chunks_exact_mut(width + 2 * reach).zip(map.disparity.chunks_exact(width)) {
        padded[reach..][..width].copy_from_slice(row);
    }
    let arch = Arch::new();
    let mut agree = vec![0f32; width];
    for y in 0..height {
        agree.fill(0.0);
        let own = &map.disparity[y * width..][..width];
        for other in offsets().filter_map(|offset| (y + offset).checked_sub(reach)).filter(|y| *y < height) {
            let others = &padded[other * (width + 2 * reach)..][..width + 2 * reach];
            arch.dispatch(Agree { agree: &mut agree, own, others });
        }
        let places = (2 * NEIGHBOURS + 1).pow(2) as f32;
        for (confidence, agree) in confidence[y * width..][..width].iter_mut().zip(&agree) {
            *confidence *= agree / places;
        }
    }
    confidence
}

/// Counts the estimates of a row, a few positions to either side, that agree with each of another.
struct Agree<'a> {
    agree: &'a mut [f32],
    own: &'a [f32],
    others: &'a [f32],
}

impl WithSimd for Agree<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let others: [&[f32]; 2 * NEIGHBOURS + 1] =
            std::array::from_fn(|at| &self.others[at * STRIDE..][..self.own.len()]);
        for (x, (agree, own)) in self.agree.iter_mut().zip(self.own).enumerate() {
            for other in others {
                // Infinity minus infinity is NaN, which never agrees.
                *agree += if (own - other[x]).abs() <= SAME_SURFACE { 1.0 } else { 0.0 };
            }
        }
    }
}

/// Half the size: means of four.
fn halved(picture: &[u8], width: usize) -> Vec<u8> {
    let mut half = Vec::with_capacity(picture.len() / 4);
    for rows in picture.chunks_exact(2 * width) {
        let (upper, lower) = rows.split_at(width);
        let pairs = upper.as_chunks::<2>().0.iter().zip(lower.as_chunks::<2>().0);
        let sums = pairs
            .map(|([a, b], [c, d])| [a, b, c, d].into_iter().map(|level| u16::from(*level)).sum::<u16>());
        half.extend(sums.map(|sum| ((sum + 2) / 4) as u8));
    }
    half
}
