//! The posterior of a row given its columns, and its estimates.
//!
//! In: the evidence of each pixel. Out: a [`Estimate`] for each pixel whose match in the right image agrees. With p(d)
//! the posterior and w its maximum,
//!
//! ```text
//! rest = Σ_{|d − w| > 1} p(d)          λ = 1 − rest^¼        spread² = Σ p(d) (d − claim)²
//! claim = w + ½ (ln p(w+1) − ln p(w−1)) / (ln p(w) − min(ln p(w−1), ln p(w+1)))
//! ```
//!
//! ln p falls nearly linearly from its peak, as the costs of shifted windows rise, so the estimate is the corner of an
//! inverted V through three values. The power ¼ corrects the overconfidence from overlapping windows; `bvm calibrate
//! vision` measures the reliability of λ. Consistency: of all left pixels that may match a right pixel, the one with
//! the largest p(d) must have a disparity within one pixel of the estimate. Invariant: λ lies in ]0, 1]; there are at
//! most 2^16 disparities.

use super::super::lanes::{LANES, across, both};
use super::super::{Estimate, LEAST_CONFIDENCE, Support};
use super::{Frame, Tables, short};
use pulp::{Simd, WithSimd};
use std::hint::black_box;

/// Largest difference of disparity, in pixels, between left and right view.
const MOST_DISAGREEMENT: u32 = 1;
/// Least significant difference of matching costs.
const CLEARLY: u8 = 5;
/// Number of low bits that hold a disparity.
const INDEX: u32 = 0xffff;

/// Buffers of a row.
pub(super) struct ReadOut {
    forward: Vec<f32>,
    backward: Vec<f32>,
    carried: [Vec<f32>; 2],
    posterior: Vec<f32>,
    /// For each right pixel, from right to left: the likeliest left pixel's p above, its disparity in the low bits.
    named: Vec<u32>,
    claims: Vec<Option<Estimate>>,
}

impl ReadOut {
    pub(super) fn new(frame: &Frame<'_>) -> Self {
        let stride = frame.step.stride();
        Self {
            forward: vec![0.0; frame.width * stride],
            backward: vec![0.0; frame.width * stride],
            carried: [vec![0.0; frame.step.carried()], vec![0.0; frame.step.carried()]],
            posterior: vec![0.0; stride],
            named: vec![0; frame.width + stride],
            claims: vec![None; frame.width],
        }
    }
}

/// The output of a row.
pub(super) struct RowEstimates<'s> {
    pub(super) disparity: &'s mut [f32],
    pub(super) confidence: &'s mut [f32],
    pub(super) spread: &'s mut [f32],
    pub(super) support: &'s mut [Support],
}

/// The input of a row.
pub(super) struct Row<'f> {
    pub(super) read_out: &'f mut ReadOut,
    pub(super) frame: &'f Frame<'f>,
    pub(super) tables: &'f Tables,
    pub(super) y: usize,
    pub(super) evidence: &'f [f32],
    pub(super) costs: &'f [u8],
    pub(super) estimates: RowEstimates<'f>,
    /// The output of the posteriors of pixels, `levels` each, if they are kept.
    pub(super) kept: Option<&'f mut [u8]>,
}

impl WithSimd for Row<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) {
        self.pass();
        let Frame { width, levels, step, .. } = *self.frame;
        let (stride, ReadOut { forward, backward, posterior, named, claims, .. }) =
            (step.stride(), self.read_out);
        named.fill(0);
        for (x, place) in claims.iter_mut().enumerate() {
            let own = x * stride..(x + 1) * stride;
            let (total, winner) = believe(
                &self.evidence[own.clone()],
                &forward[own.clone()],
                &backward[own.clone()],
                posterior,
            );
            if let Some(kept) = &mut self.kept {
                let kept = &mut kept[x * levels..][..levels];
                kept.iter_mut().zip(&*posterior).for_each(|(kept, belief)| *kept = short(belief / total));
            }
            let seen = levels.min(x + 1);
            name(&posterior[..seen], 1.0 / total, &mut named[width - 1 - x..][..seen]);
            let costs = &self.costs[own][..levels];
            *place = (winner < seen).then(|| claim(posterior, total, winner, &costs[..seen]));
        }
        let RowEstimates { disparity, confidence, spread, support } = self.estimates;
        for (x, claim) in claims.iter().enumerate() {
            let agrees = |claim: &&Estimate| {
                let named = named[width - 1 - x + usize::from(claim.winner)] & INDEX;
                named.abs_diff(u32::from(claim.winner)) <= MOST_DISAGREEMENT
                    && claim.confidence >= LEAST_CONFIDENCE
            };
            if let Some(claim) = claim.as_ref().filter(agrees) {
                (disparity[x], confidence[x], spread[x]) = (claim.disparity, claim.confidence, claim.spread);
                support[x] = claim.support;
            }
        }
    }
}

impl Row<'_> {
    /// The messages from the left and from the right, computed together so that neither waits for the other's sums.
    #[inline(always)]
    fn pass(&mut self) {
        let Frame { width, step, .. } = *self.frame;
        let (stride, first) = (step.stride(), self.y * width);
        let ReadOut { forward, backward, carried: [from_left, from_right], .. } = &mut *self.read_out;
        let mut totals = [1.0; 2];
        for x in 0..width {
            let own = x * stride..(x + 1) * stride;
            let message = &mut forward[own.clone()];
            match x.checked_sub(1) {
                None => step.begin(message),
                Some(before) => {
                    let jump = self.tables.jump[self.frame.contrast(first + before, first + x)];
                    step.advance(from_left, totals[0], jump, message);
                }
            }
            totals[0] = step.carry(&self.evidence[own], message, from_left);
            let x = width - 1 - x;
            let own = x * stride..(x + 1) * stride;
            let message = &mut backward[own.clone()];
            match x + 1 < width {
                false => step.begin(message),
                true => {
                    let jump = self.tables.jump[self.frame.contrast(first + x, first + x + 1)];
                    step.advance(from_right, totals[1], jump, message);
                }
            }
            totals[1] = step.carry(&self.evidence[own], message, from_right);
        }
    }
}

/// The unnormalised posterior of a pixel, its sum, and the first most probable disparity.
#[inline(always)]
fn believe(evidence: &[f32], forward: &[f32], backward: &[f32], posterior: &mut [f32]) -> (f32, usize) {
    let larger = |one: f32, other: f32| if one > other { one } else { other };
    let (mut total, mut most) = ([0f32; LANES], [0f32; LANES]);
    let messages = forward.as_chunks::<LANES>().0.iter().zip(backward.as_chunks::<LANES>().0);
    let own = posterior.as_chunks_mut().0.iter_mut().zip(evidence.as_chunks::<LANES>().0);
    for ((belief, evidence), (forward, backward)) in own.zip(messages) {
        *belief = std::array::from_fn(|lane| evidence[lane] * forward[lane] * backward[lane]);
        total = both(&total, belief, |total, belief| total + belief);
        most = both(&most, belief, larger);
    }
    let most = black_box(most);
    let eight: [f32; 8] = std::array::from_fn(|lane| larger(most[lane], most[lane + 8]));
    let four: [f32; 4] = std::array::from_fn(|lane| larger(eight[lane], eight[lane + 4]));
    let most = larger(larger(four[0], four[2]), larger(four[1], four[3]));
    let holds = |chunk: &[f32; LANES]| chunk.iter().fold(false, |holds, value| holds | (*value == most));
    let chunks = posterior.as_chunks::<LANES>().0;
    let chunk = chunks.iter().position(holds).unwrap_or(0);
    let inside = chunks[chunk].iter().position(|value| *value == most).unwrap_or(0);
    (across(total), chunk * LANES + inside)
}

/// Updates the right pixels, from right to left, with their possible left pixel.
#[inline(always)]
fn name(posterior: &[f32], scale: f32, named: &mut [u32]) {
    for (d, (named, belief)) in named.iter_mut().zip(posterior).enumerate() {
        *named = (*named).max((belief * scale).to_bits() & !INDEX | d as u32);
    }
}

/// The estimate of a pixel, with the costs of the disparities in the right image.
#[inline(always)]
fn claim(posterior: &[f32], total: f32, winner: usize, costs: &[u8]) -> Estimate {
    let disparity = winner as f32 + finer(posterior, winner);
    let (mut rest, mut moment) = ([0f32; LANES], [0f32; LANES]);
    let mut from_winner: [f32; LANES] = std::array::from_fn(|lane| lane as f32 - winner as f32);
    let claimed = disparity - winner as f32;
    for chunk in posterior.as_chunks::<LANES>().0 {
        // Summed separately: the difference from one would be lost in rounding.
        let far = both(chunk, &from_winner, |belief, from| if from.abs() > 1.5 { belief } else { 0.0 });
        rest = both(&rest, &far, |rest, belief| rest + belief);
        let square = |belief: f32, from: f32| belief * (from - claimed) * (from - claimed);
        let squares = both(chunk, &from_winner, square);
        moment = both(&moment, &squares, |moment, square| moment + square);
        from_winner = from_winner.map(|from| from + LANES as f32);
    }
    let clearly = costs[winner].saturating_add(CLEARLY);
    let worse = costs.iter().fold(0u16, |worse, cost| worse + u16::from(*cost > clearly));
    Estimate {
        winner: winner as u16,
        disparity,
        confidence: (1.0 - (across(rest) / total).sqrt().sqrt()).max(f32::MIN_POSITIVE),
        spread: (across(moment) / total).sqrt(),
        support: Support { cost: costs[winner], worse: (255 * usize::from(worse) / costs.len()) as u8 },
    }
}

/// The base-2 logarithm of a positive number, to 1e-4: its exponent, and a polynomial of its fraction.
#[inline(always)]
fn logarithm(value: f32) -> f32 {
    let bits = value.to_bits();
    let fraction = f32::from_bits(bits & 0x007f_ffff | 0x3f80_0000);
    let exponent = (bits >> 23) as f32 - 127.0;
    let part = -2.794_153_7
        + fraction
            * (5.069_756_3
                + fraction
                    * (-3.520_218_8
                        + fraction * (1.610_177_6 + fraction * (-0.409_475_6 + fraction * 0.043_928_6))));
    exponent + part
}

/// The position of the peak of ln p between its neighbours, −½..½.
#[inline(always)]
fn finer(posterior: &[f32], winner: usize) -> f32 {
    if winner == 0 || winner + 1 >= posterior.len() {
        return 0.0;
    }
    let at = |d: usize| logarithm(posterior[d].max(f32::MIN_POSITIVE));
    let (before, here, after) = (at(winner - 1), at(winner), at(winner + 1));
    if here > before.min(after) { 0.5 * (after - before) / (here - before.min(after)) } else { 0.0 }
}
