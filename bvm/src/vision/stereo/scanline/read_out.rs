//! A row: its exact posterior given its columns, and what is read from it.
//!
//! In: the evidence of each pixel. Out: a [`Claim`] for each pixel whose match in the right image agrees. With
//! p(d) the posterior and w its maximum,
//!
//! ```text
//! rest = Σ_{|d − w| > 1} p(d)          λ = 1 − rest^¼        spread² = Σ p(d) (d − claim)²
//! claim = w + ½ (ln p(w+1) − ln p(w−1)) / (ln p(w) − min(ln p(w−1), ln p(w+1)))
//! ```
//!
//! ln p falls nearly linearly from its peak, as the costs of shifted windows rise, so the claim is the corner of the
//! V upside down through three values. The power ¼ makes up for the dependence of overlapping windows, which makes the
//! posterior too sure of itself; `bvm calibrate vision` shows how λ compares with the part that is right.
//! Consistency: of all left pixels that a right pixel may be, by p(d) each, the likeliest must name a disparity within
//! one pixel of the claim.
//! Invariant: λ lies in ]0, 1].

use super::chain::{LANES, Step, sum};
use super::{Claim, Frame, Tables};

/// Most disparities, in pixels, by which left and right view may differ.
const MOST_DISAGREEMENT: usize = 1;
/// Difference of matching costs that is no accident.
const CLEARLY: u8 = 5;
/// Low bits of a number that hold a disparity.
const INDEX: u32 = 0xffff;

/// Buffers of a row.
pub(super) struct ReadOut {
    forward: Vec<f32>,
    carried: Vec<f32>,
    message: Vec<f32>,
    posterior: Vec<f32>,
    /// For each right pixel, from right to left: the likeliest left pixel's p above, its disparity in the low bits.
    named: Vec<u32>,
}

impl ReadOut {
    pub(super) fn new(frame: &Frame<'_>) -> Self {
        let stride = frame.step.stride();
        Self {
            forward: vec![0.0; frame.width * stride],
            carried: vec![0.0; frame.step.carried()],
            message: vec![0.0; stride],
            posterior: vec![0.0; stride],
            named: vec![0; frame.width + stride],
        }
    }

    /// Reads a row.
    #[inline(always)]
    pub(super) fn row(
        &mut self,
        frame: &Frame<'_>,
        tables: &Tables,
        y: usize,
        evidence: &[f32],
        costs: &[u8],
        claims: &mut [Option<Claim>],
    ) {
        let Frame { width, levels, step, .. } = *frame;
        let stride = step.stride();
        let jump = |x: usize| tables.jump[frame.contrast(y * width + x, y * width + x + 1)];
        let mut total = 1.0;
        for x in 0..width {
            let message = &mut self.forward[x * stride..][..stride];
            match x.checked_sub(1) {
                None => step.begin(message),
                Some(before) => step.advance(&self.carried, total, jump(before), message),
            }
            total = step.carry(&evidence[x * stride..][..stride], message, &mut self.carried);
        }
        self.named.fill(0);
        for x in (0..width).rev() {
            match x + 1 < width {
                false => step.begin(&mut self.message),
                true => step.advance(&self.carried, total, jump(x), &mut self.message),
            }
            total = step.carry(&evidence[x * stride..][..stride], &self.message, &mut self.carried);
            self.believe(&step, x, stride);
            let seen = levels.min(x + 1);
            name(&self.posterior[..seen], &mut self.named[width - 1 - x..][..seen]);
            claims[x] = claim(&self.posterior, &costs[x * stride..][..levels], seen);
        }
        for (x, place) in claims.iter_mut().enumerate() {
            let agrees = |claim: &Claim| {
                let named = (self.named[width - 1 - x + claim.winner] & INDEX) as usize;
                named.abs_diff(claim.winner) <= MOST_DISAGREEMENT
            };
            *place = place.filter(agrees);
        }
    }

    /// The posterior of a pixel, of which the message from the right has just been carried.
    #[inline(always)]
    fn believe(&mut self, step: &Step<f32>, x: usize, stride: usize) {
        let carried = &self.carried[1..=stride];
        let forward = &self.forward[x * stride..][..stride];
        for ((belief, carried), forward) in self.posterior.iter_mut().zip(carried).zip(forward) {
            *belief = carried * forward;
        }
        debug_assert_eq!(self.posterior.len(), step.stride());
        let scale = 1.0 / sum(&self.posterior);
        self.posterior.iter_mut().for_each(|belief| *belief *= scale);
    }
}

/// Tells the right pixels, from right to left, which left pixel they may be.
#[inline(always)]
fn name(posterior: &[f32], named: &mut [u32]) {
    for (d, (named, p)) in named.iter_mut().zip(posterior).enumerate() {
        *named = (*named).max(p.to_bits() & !INDEX | d as u32);
    }
}

/// The claim of a pixel whose first `seen` disparities fall into the right image.
#[inline(always)]
fn claim(posterior: &[f32], costs: &[u8], seen: usize) -> Option<Claim> {
    let levels = costs.len();
    let winner = first_largest(posterior);
    if winner >= seen {
        return None;
    }
    let posterior = &posterior[..levels];
    let disparity = winner as f32 + finer(posterior, winner);
    let near = winner.saturating_sub(1)..(winner + 2).min(levels);
    let (mut rest, mut variance) = ([0f32; LANES], [0f32; LANES]);
    for (d, p) in posterior.iter().enumerate() {
        let off = d as f32 - disparity;
        rest[d % LANES] += if near.contains(&d) { 0.0 } else { *p };
        variance[d % LANES] += p * off * off;
    }
    let rest: f32 = rest.iter().sum();
    let total: u32 = costs[..seen].iter().map(|&cost| u32::from(cost)).sum();
    let clearly = costs[winner].saturating_add(CLEARLY);
    let worse = costs[..seen].iter().map(|&cost| u32::from(cost > clearly)).sum::<u32>();
    Some(Claim {
        winner,
        disparity,
        confidence: (1.0 - rest.sqrt().sqrt()).max(f32::MIN_POSITIVE),
        spread: variance.iter().sum::<f32>().sqrt(),
        cost: costs[winner],
        mean_cost: total as f32 / seen as f32,
        worse: worse as f32 / seen as f32,
    })
}

/// The first index of the largest value; the length is whole lanes.
#[inline(always)]
fn first_largest(values: &[f32]) -> usize {
    let mut most = [0f32; LANES];
    for chunk in values.as_chunks::<LANES>().0 {
        for (most, value) in most.iter_mut().zip(chunk) {
            *most = if *value > *most { *value } else { *most };
        }
    }
    let most = most.into_iter().fold(0f32, f32::max);
    let holds = |chunk: &[f32; LANES]| chunk.iter().fold(false, |holds, value| holds | (*value == most));
    let chunk = values.as_chunks::<LANES>().0.iter().position(holds).unwrap_or(0);
    let inside = values[chunk * LANES..].iter().position(|value| *value == most).unwrap_or(0);
    chunk * LANES + inside
}

/// Where the peak of ln p lies between its neighbours, −½..½.
#[inline(always)]
fn finer(posterior: &[f32], winner: usize) -> f32 {
    if winner == 0 || winner + 1 >= posterior.len() {
        return 0.0;
    }
    let [before, here, after] = [winner - 1, winner, winner + 1].map(|d| posterior[d].max(f32::MIN_POSITIVE).ln());
    let steeper = here - before.min(after);
    if steeper > 0.0 { 0.5 * (after - before) / steeper } else { 0.0 }
}
