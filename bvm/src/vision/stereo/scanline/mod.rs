//! Stereo by Bayesian inference: every pixel gets a posterior over disparities.
//!
//! In: a rectified pair and the number of disparities. Out: for each row the [`Claim`]s that its posteriors make.
//! What one line says is `models/scanline.bp`. The lines are combined in a tree:
//!
//! ```text
//! column x:  u(x, d) = P(D = d | its column)^γ     exact, by a pass down and a pass up
//! row:       P(D = d | its row, the columns of all its pixels) ∝ u(x, d) · forward(x, d) · backward(x, d)
//! ```
//!
//! With γ = 1 this is the exact posterior of a tree that hangs every column on the row by its pixel there, so that each
//! pixel of the picture is heard once by each other, along the column and then along the row (Bleyer and Gelautz 2008
//! maximise over such a tree; here all is summed). Neighbouring columns see nearly the same windows and are no
//! independent witnesses; γ = ½ takes them for half of that. Given u, a row is exact.
//!
//! Order of work, which the memory decides: all costs; down, keeping the messages; up, and each row as soon as its
//! columns are complete. Invariant: the result does not depend on the number of threads or the instruction set.

mod chain;
mod cost;
mod law;
mod read_out;

use super::Claim;
use chain::Step;
use cost::Costs;
pub(super) use law::Law;
use pulp::Arch;
use rayon::prelude::*;
use read_out::ReadOut;

/// Pixels of a row that a thread takes at once.
const CHUNK: usize = 128;

/// A picture to be matched.
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

/// The law, worked out for every cost and contrast that there is.
struct Tables {
    likelihood: [f32; 256],
    jump: [f32; 256],
}

/// The claims of all pixels, from pictures in whole grey levels.
pub(super) fn claims(left: &[u8], right: &[u8], width: usize, levels: usize) -> Vec<Option<Claim>> {
    let law = Law::of_the_program();
    let tables = Tables {
        likelihood: std::array::from_fn(|cost| law.likelihood(cost as f64) as f32),
        jump: std::array::from_fn(|contrast| law.jump(contrast as f64) as f32),
    };
    let step = Step::new(levels, law.slant);
    let frame = Frame { left, width, height: left.len() / width, levels, step };
    let costs = Costs::of_pair(left, right, width, levels, step.stride());
    let down = down(&frame, &costs, &tables);
    up(&frame, &costs, &down, &tables)
}

/// What a column carries from row to row, for each pixel of the row.
struct Carried {
    beliefs: Vec<f32>,
    totals: Vec<f32>,
}

impl Carried {
    fn new(frame: &Frame<'_>) -> Self {
        Self { beliefs: vec![0.0; frame.width * frame.step.carried()], totals: vec![1.0; frame.width] }
    }
}

/// The messages from above, in 16 bits.
fn down(frame: &Frame<'_>, costs: &Costs, tables: &Tables) -> Vec<u16> {
    let (width, stride) = (frame.width, frame.step.stride());
    let mut messages = vec![0u16; width * frame.height * stride];
    let mut carried = Carried::new(frame);
    let arch = Arch::new();
    for (y, kept) in messages.chunks_exact_mut(width * stride).enumerate() {
        let costs = costs.row(y, width);
        kept.par_chunks_mut(CHUNK * stride)
            .zip(carried.beliefs.par_chunks_mut(CHUNK * frame.step.carried()))
            .zip(carried.totals.par_chunks_mut(CHUNK))
            .enumerate()
            .for_each(|(chunk, ((kept, beliefs), totals))| {
                let pixels = Pixels { frame, tables, y, first: chunk * CHUNK, before: y.checked_sub(1) };
                arch.dispatch(|| {
                    pixels.each(costs, beliefs, totals, |at, message, _| {
                        for (kept, value) in kept[at * stride..][..stride].iter_mut().zip(message) {
                            *kept = short(*value);
                        }
                    });
                });
            });
    }
    messages
}

/// The messages from below, with what came from above the evidence of a row, and the rows.
fn up(frame: &Frame<'_>, costs: &Costs, down: &[u16], tables: &Tables) -> Vec<Option<Claim>> {
    let (width, stride) = (frame.width, frame.step.stride());
    let mut claims = vec![None; width * frame.height];
    let mut carried = Carried::new(frame);
    let arch = Arch::new();
    // As many rows as can be worked on at once wait for their columns.
    let together = rayon::current_num_threads();
    let mut evidence = vec![0f32; together * width * stride];
    let mut rows: Vec<ReadOut> = (0..together).map(|_| ReadOut::new(frame)).collect();
    for (block, claims) in claims.chunks_mut(together * width).enumerate().rev() {
        let first = block * together;
        let count = claims.len() / width;
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
                    let pixels = Pixels { frame, tables, y, first: chunk * CHUNK, before };
                    let down = &down[chunk * CHUNK * stride..];
                    arch.dispatch(|| {
                        pixels.each(costs, beliefs, totals, |at, message, likelihood| {
                            let column = message.iter().zip(likelihood).zip(&down[at * stride..][..stride]);
                            let evidence = &mut evidence[at * stride..][..stride];
                            for (evidence, ((message, likelihood), down)) in evidence.iter_mut().zip(column) {
                                *evidence = (message * likelihood * long(*down)).sqrt();
                            }
                        });
                    });
                });
        }
        claims
            .par_chunks_exact_mut(width)
            .zip(evidence.par_chunks_exact(width * stride))
            .zip(&mut rows)
            .enumerate()
            .for_each(|(row, ((claims, evidence), read_out))| {
                let y = first + row;
                let costs = costs.row(y, width);
                arch.dispatch(|| read_out.row(frame, tables, y, evidence, costs, claims));
            });
    }
    claims
}

/// Some pixels of a row, in the passes along columns.
struct Pixels<'f> {
    frame: &'f Frame<'f>,
    tables: &'f Tables,
    y: usize,
    /// Column of the first.
    first: usize,
    /// The row that was passed before this one.
    before: Option<usize>,
}

impl Pixels<'_> {
    /// One step of each pixel's column; `keep` is told the pixel, the message that reaches it and its likelihood.
    #[inline(always)]
    fn each(
        &self,
        costs: &[u8],
        beliefs: &mut [f32],
        totals: &mut [f32],
        mut keep: impl FnMut(usize, &[f32], &[f32]),
    ) {
        let Frame { width, levels, step, .. } = *self.frame;
        let stride = step.stride();
        let (mut message, mut likelihood) = (vec![0f32; stride], vec![0f32; stride]);
        let pixels = beliefs.chunks_exact_mut(step.carried()).zip(totals).enumerate();
        for (at, (belief, total)) in pixels {
            let x = self.first + at;
            match self.before {
                None => step.begin(&mut message),
                Some(before) => {
                    let contrast = self.frame.contrast(self.y * width + x, before * width + x);
                    step.advance(belief, *total, self.tables.jump[contrast], &mut message);
                }
            }
            let costs = &costs[x * stride..][..stride];
            for (likelihood, cost) in likelihood.iter_mut().zip(costs) {
                *likelihood = self.tables.likelihood[usize::from(*cost)];
            }
            likelihood[levels..].fill(0.0);
            *total = step.carry(&likelihood, &message, belief);
            keep(at, &message, &likelihood);
        }
    }
}

/// The upper half of a number's bits, rounded: its relative error is 2^-9 at most.
#[inline(always)]
fn short(value: f32) -> u16 {
    ((value.to_bits() + 0x8000) >> 16) as u16
}

#[inline(always)]
fn long(kept: u16) -> f32 {
    f32::from_bits(u32::from(kept) << 16)
}
