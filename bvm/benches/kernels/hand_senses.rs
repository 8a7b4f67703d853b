//! Hand-written loops for the range sensor and the choice of a gaze.
//!
//! In: planes of numbers, laid out as for the kernels. Out: the same answers. Invariant: as in [`crate::hand`].

use bp_core::compiler::exec::scalar::Scalar;

/// Rays that stay in the first-level cache.
const BLOCK: usize = 64;

/// P(z | O, C) of a range sensor over its rays, in O(N): `made` is `[occupied][cell][ray]`.
///
/// A normal about the first occupied cell k, read on bins: Φ at bin edges, which neighbouring k share. All cells except
/// C are occupied with probability ½, so the first occupied one is a recurrence along the ray.
#[inline(always)]
pub(crate) fn range_sensor(bins: usize, readings: &[f32], deviations: &[f32], made: &mut [f32]) {
    let rays = readings.len();
    let mut reach = vec![[0.0f32; BLOCK]; bins];
    for start in (0..rays).step_by(BLOCK) {
        let width = BLOCK.min(rays - start);
        let (mut z, mut sigma, mut upper) = ([1.0f32; BLOCK], [1.0f32; BLOCK], [0.0f32; BLOCK]);
        z[..width].copy_from_slice(&readings[start..start + width]);
        sigma[..width].copy_from_slice(&deviations[start..start + width]);
        let edge: [f32; BLOCK] =
            std::array::from_fn(|ray| if z[ray] == 0.0 { bins as f32 + 1.0 } else { z[ray] });
        for ray in 0..BLOCK {
            upper[ray] = ((edge[ray] - 0.5) / sigma[ray]).normal_cumulative();
        }
        for (k, reach) in reach.iter_mut().enumerate() {
            for ray in 0..BLOCK {
                let lower = ((edge[ray] - k as f32 - 1.5) / sigma[ray]).normal_cumulative();
                let from = if z[ray] == 1.0 { 0.0 } else { lower };
                reach[ray] = if z[ray] == 0.0 { 1.0 } else { upper[ray] } - from;
                upper[ray] = lower;
            }
        }
        let mut beyond: [f32; BLOCK] = std::array::from_fn(|ray| if z[ray] == 0.0 { 1.0 } else { 0.0 });
        // First the cells beyond C, in the plane of the empty; then the cells before it are added to both.
        for c in (0..bins).rev() {
            made[c * rays + start..][..width].copy_from_slice(&beyond[..width]);
            for ray in 0..BLOCK {
                beyond[ray] = 0.5 * (reach[c][ray] + beyond[ray]);
            }
        }
        let (mut before, mut weight) = ([0.0f32; BLOCK], 1.0f32);
        for c in 0..bins {
            let (empty, full) = made.split_at_mut(bins * rays);
            let empty = &mut empty[c * rays + start..][..width];
            let full = &mut full[c * rays + start..][..width];
            for ray in 0..width {
                empty[ray] = before[ray] + weight * empty[ray];
                full[ray] = before[ray] + weight * reach[c][ray];
            }
            weight *= 0.5;
            for ray in 0..BLOCK {
                before[ray] += weight * reach[c][ray];
            }
        }
    }
}

/// The scores of the gaze program: (1 − P(O)) ‖∇H‖ at each direction's frontier cell, 0 elsewhere; and their best.
#[inline(always)]
pub(crate) fn gaze(
    extents: [usize; 3],
    eta: f32,
    occupied: &[f32],
    entropy: &[f32],
    made: &mut [f32],
) -> usize {
    let [depths, rows, lanes] = extents;
    let mut best = (0.0f32, 0);
    made.fill(0.0);
    let mut last = vec![0usize; lanes];
    let mut open = vec![true; lanes];
    for row in 0..rows {
        last.fill(0);
        open.fill(true);
        for depth in 0..depths {
            let here = &occupied[(depth * rows + row) * lanes..][..lanes];
            for ((open, last), p) in open.iter_mut().zip(last.iter_mut()).zip(here) {
                *open &= *p < 0.5 - eta;
                *last += usize::from(*open);
            }
        }
        for lane in 0..lanes {
            let first = row * lanes + lane;
            let unknown = last[lane] == 0 && (occupied[first] - 0.5).abs() <= eta;
            if last[lane] == 0 && !unknown {
                continue;
            }
            let depth = last[lane].saturating_sub(1);
            let at = (depth * rows + row) * lanes;
            let h = entropy[at + lane];
            // The gap is empty with certainty: its entropy is 0 (A14).
            let near = h - if depth > 0 { entropy[at - rows * lanes + lane] } else { 0.0 };
            let below = if row > 0 { h - entropy[at - lanes + lane] } else { 0.0 };
            let left = h - entropy[at + (lane + lanes - 1) % lanes];
            let score = (1.0 - occupied[at + lane]) * (near * near + below * below + left * left).sqrt();
            made[at + lane] = score;
            if score > best.0 {
                best = (score, at + lane);
            }
        }
    }
    best.1
}

/// [`range_sensor`], compiled for each instruction set.
pub(crate) struct Rays<'a> {
    /// Cells of a ray.
    pub(crate) bins: usize,
    /// The readings.
    pub(crate) readings: &'a [f32],
    /// Standard deviations, in cells.
    pub(crate) deviations: &'a [f32],
    /// The results.
    pub(crate) made: &'a mut [f32],
}

impl pulp::NullaryFnOnce for Rays<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        range_sensor(self.bins, self.readings, self.deviations, self.made);
    }
}

/// [`gaze`], compiled for each instruction set.
pub(crate) struct Gaze<'a> {
    /// Depth, rows, lanes.
    pub(crate) extents: [usize; 3],
    /// The margin below one half within which a cell does not count as empty.
    pub(crate) eta: f32,
    /// P(O).
    pub(crate) occupied: &'a [f32],
    /// H(O V).
    pub(crate) entropy: &'a [f32],
    /// The scores.
    pub(crate) made: &'a mut [f32],
}

impl pulp::NullaryFnOnce for Gaze<'_> {
    type Output = usize;

    #[inline(always)]
    fn call(self) -> usize {
        gaze(self.extents, self.eta, self.occupied, self.entropy, self.made)
    }
}
