//! Stereo by Bayesian inference: every pixel gets a posterior over disparities.
//!
//! In: a rectified pair and the number of disparities. Out: for each row the [`Estimate`]s from its posteriors. The
//! program of one line is `models/scanline.bp`. The lines are combined in a tree:
//!
//! ```text
//! column x:  u(x, d) = P(D = d | its column)^γ     exact, by a pass down and a pass up
//! row:       P(D = d | its row, the columns of all its pixels) ∝ u(x, d) · forward(x, d) · backward(x, d)
//! ```
//!
//! With γ = 1 this is the exact posterior of a tree in which every column is attached to the row at its pixel there, so
//! that each pixel of the picture contributes once to each other, along the column and then along the row (Bleyer and
//! Gelautz 2008 maximise over such a tree; this is the sum). Neighbouring columns see overlapping windows and are not
//! independent; γ = ½ halves their weight. Given u, a row is exact.
//!
//! The order of computation is determined by memory: all costs; the downward pass, whose messages are stored; the
//! upward pass, and each row as soon as its columns are complete. Invariant: the result does not depend on the number
//! of threads or the instruction set.

mod chain;
mod cost;
mod law;
mod read_out;

use super::clean::drop_unsupported;
use super::memory::Bytes;
use super::{DisparityMap, Support};
use chain::Step;
use cost::Costs;
pub(super) use law::Law;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use read_out::{ReadOut, Row, RowEstimates};

/// Pixels of a row in one task of a thread.
const CHUNK: usize = 128;

/// A picture to match.
#[derive(Clone, Copy)]
struct Frame<'p> {
    left: &'p [u8],
    width: usize,
    height: usize,
    levels: usize,
    step: Step<f32>,
}

impl Frame<'_> {
    fn contrast(&self, one: usize, other: usize) -> usize {
        usize::from(self.left[one].abs_diff(self.left[other]))
    }
}

/// The law, and its jump probability for each possible contrast.
struct Tables {
    law: Law,
    jump: [f32; 256],
}

/// The estimates of all pixels, from pictures in integer grey levels; and all posteriors, if `kept` is given.
pub(super) fn claims(
    left: &[u8],
    right: &[u8],
    width: usize,
    levels: usize,
    kept: Option<&mut Vec<u8>>,
) -> DisparityMap {
    let law = Law::of_the_program();
    let tables = Tables { law, jump: std::array::from_fn(|contrast| law.jump(contrast as f64) as f32) };
    let step = Step::new(levels, law.slant);
    let frame = Frame { left, width, height: left.len() / width, levels, step };
    let costs = Costs::of_pair(left, right, width, levels, step.stride());
    let down = down(&frame, &costs, &tables);
    up(&frame, &costs, &down, &tables, kept)
}

/// The messages of the columns between rows, for each pixel of the row.
struct Carried {
    beliefs: Vec<f32>,
    totals: Vec<f32>,
}

impl Carried {
    fn new(frame: &Frame<'_>) -> Self {
        Self { beliefs: vec![0.0; frame.width * frame.step.carried()], totals: vec![1.0; frame.width] }
    }
}

/// The messages from above, in 8 bits.
fn down(frame: &Frame<'_>, costs: &Costs, tables: &Tables) -> Bytes {
    let (width, stride) = (frame.width, frame.step.stride());
    let mut messages = Bytes::zeros(width * frame.height * stride);
    let mut carried = Carried::new(frame);
    let arch = Arch::new();
    for (y, kept) in messages.chunks_exact_mut(width * stride).enumerate() {
        let costs = costs.row(y, width);
        kept.par_chunks_mut(CHUNK * stride)
            .zip(carried.beliefs.par_chunks_mut(CHUNK * frame.step.carried()))
            .zip(carried.totals.par_chunks_mut(CHUNK))
            .enumerate()
            .for_each(|(chunk, ((kept, beliefs), totals))| {
                let keep = Messages { kept, stride };
                let (first, before) = (chunk * CHUNK, y.checked_sub(1));
                arch.dispatch(Pixels { frame, tables, y, before, first, costs, beliefs, totals, keep });
            });
    }
    messages
}

/// The messages from below, which with those from above are the evidence of a row, and the rows.
fn up(
    frame: &Frame<'_>,
    costs: &Costs,
    down: &[u8],
    tables: &Tables,
    mut kept: Option<&mut Vec<u8>>,
) -> DisparityMap {
    let (width, stride) = (frame.width, frame.step.stride());
    let believed = width * frame.levels;
    if let Some(kept) = &mut kept {
        kept.resize(believed * frame.height, 0);
    }
    let mut map = DisparityMap::empty(width, frame.height);
    let mut support = vec![Support::NONE; width * frame.height];
    let mut carried = Carried::new(frame);
    let arch = Arch::new();
    // Rows are queued until there are enough for all threads.
    let together = rayon::current_num_threads();
    let mut evidence = vec![0f32; together * width * stride];
    let mut rows: Vec<ReadOut> = (0..together).map(|_| ReadOut::new(frame)).collect();
    for first in (0..frame.height).step_by(together).rev() {
        let count = together.min(frame.height - first);
        let block = first * width..(first + count) * width;
        for (row, evidence) in evidence.chunks_exact_mut(width * stride).enumerate().take(count).rev() {
            let y = first + row;
            let (costs, down) = (costs.row(y, width), &down[y * width * stride..][..width * stride]);
            evidence
                .par_chunks_mut(CHUNK * stride)
                .zip(carried.beliefs.par_chunks_mut(CHUNK * frame.step.carried()))
                .zip(carried.totals.par_chunks_mut(CHUNK))
                .enumerate()
                .for_each(|(chunk, ((evidence, beliefs), totals))| {
                    let before = Some(y + 1).filter(|before| *before < frame.height);
                    let first = chunk * CHUNK;
                    let down = &down[first * stride..];
                    let keep = Evidence { evidence, down, stride };
                    arch.dispatch(Pixels { frame, tables, y, before, first, costs, beliefs, totals, keep });
                });
        }
        let kept: Vec<Option<&mut [u8]>> = match &mut kept {
            Some(kept) => kept[first * believed..].chunks_exact_mut(believed).take(count).map(Some).collect(),
            None => (0..count).map(|_| None).collect(),
        };
        let estimates = (map.disparity[block.clone()].par_chunks_exact_mut(width))
            .zip(map.confidence[block.clone()].par_chunks_exact_mut(width))
            .zip(map.spread[block.clone()].par_chunks_exact_mut(width))
            .zip(support[block].par_chunks_exact_mut(width))
            .map(|(((disparity, confidence), spread), support)| RowEstimates {
                disparity,
                confidence,
                spread,
                support,
            });
        estimates
            .zip(evidence.par_chunks_exact(width * stride))
            .zip(&mut rows)
            .zip(kept)
            .enumerate()
            .for_each(|(row, (((estimates, evidence), read_out), kept))| {
                let y = first + row;
                let costs = costs.row(y, width);
                arch.dispatch(Row { read_out, frame, tables, y, evidence, costs, estimates, kept });
            });
    }
    drop_unsupported(&mut map, &support);
    map
}

/// The stored data of a pixel after its column has passed: the message that reached it, and its likelihood.
trait Keep {
    fn keep(&mut self, at: usize, message: &[f32], likelihood: &[f32]);
}

/// The messages from above.
struct Messages<'k> {
    kept: &'k mut [u8],
    stride: usize,
}

impl Keep for Messages<'_> {
    #[inline(always)]
    fn keep(&mut self, at: usize, message: &[f32], _: &[f32]) {
        for (kept, value) in self.kept[at * self.stride..][..self.stride].iter_mut().zip(message) {
            *kept = short(*value);
        }
    }
}

/// The posterior of a pixel given its column, to the power γ.
struct Evidence<'k> {
    evidence: &'k mut [f32],
    down: &'k [u8],
    stride: usize,
}

impl Keep for Evidence<'_> {
    #[inline(always)]
    fn keep(&mut self, at: usize, message: &[f32], likelihood: &[f32]) {
        let own = at * self.stride..(at + 1) * self.stride;
        let column = message.iter().zip(likelihood).zip(&self.down[own.clone()]);
        for (evidence, ((message, likelihood), down)) in self.evidence[own].iter_mut().zip(column) {
            *evidence = root(message * likelihood * long(*down));
        }
    }
}

/// One step of the columns of some pixels of a row.
struct Pixels<'f, K> {
    frame: &'f Frame<'f>,
    tables: &'f Tables,
    y: usize,
    /// The row that was passed before this one.
    before: Option<usize>,
    /// Column of the first.
    first: usize,
    /// Of the whole row.
    costs: &'f [u8],
    beliefs: &'f mut [f32],
    totals: &'f mut [f32],
    keep: K,
}

impl<K: Keep> WithSimd for Pixels<'_, K> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) {
        let Frame { width, levels, step, .. } = *self.frame;
        let stride = step.stride();
        let (mut message, mut likelihood) = (vec![0f32; stride], vec![0f32; stride]);
        let pixels = self.beliefs.chunks_exact_mut(step.carried()).zip(self.totals).enumerate();
        for (at, (belief, total)) in pixels {
            let x = self.first + at;
            match self.before {
                None => step.begin(&mut message),
                Some(before) => {
                    let contrast = self.frame.contrast(self.y * width + x, before * width + x);
                    step.advance(belief, *total, self.tables.jump[contrast], &mut message);
                }
            }
            self.tables.law.likelihoods(&self.costs[x * stride..][..stride], &mut likelihood);
            likelihood[levels..].fill(0.0);
            *total = step.carry(&likelihood, &message, belief);
            self.keep.keep(at, &message, &likelihood);
        }
    }
}

/// The square root, with a relative error of 2e-3 at most: the reciprocal root by halving the exponent, and one step of
/// Newton's method. Many times as fast as an exact one.
#[inline(always)]
fn root(value: f32) -> f32 {
    let guess = f32::from_bits(0x5f37_59df - (value.to_bits() >> 1));
    value * guess * (1.5 - 0.5 * value * guess * guess)
}

/// A probability in 8 bits: 4 of its exponent, from 2^-15 up, and 4 of its fraction, rounded. The relative error is at
/// most 2^-5, far below the effect of a unit of cost.
#[inline(always)]
fn short(value: f32) -> u8 {
    (((value.to_bits() + (1 << 18)) >> 19).saturating_sub(LEAST)).min(255) as u8
}

#[inline(always)]
pub(in crate::vision) fn long(kept: u8) -> f32 {
    f32::from_bits((u32::from(kept) + LEAST) << 19)
}

/// The upper bits of 2^-15.
const LEAST: u32 = (127 - 15) << 4;
