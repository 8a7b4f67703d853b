//! The matching cost of every pixel at every disparity.
//!
//! In: a rectified pair. Out: [`CostVolume`], costs in 0..=139, index `(y * width + x) * stride + d`.
//! Each pixel becomes a census word: one bit for each neighbour in a 9×7 window, set where the neighbour is
//! darker than the centre. The cost of disparity d at (x, y) is the Hamming distance between the left word at
//! x and the right word at x − d, summed over a 3×3 window and divided by 4. The census looks at the order of
//! intensities only, so gain and offset between the cameras do not matter.
//! Invariant: a candidate that falls outside the right image costs [`UNSEEN_BITS`] bits, better than chance
//! and worse than a match; the lanes `d >= levels` that pad the stride hold 255.
//! Reference: Zabih and Woodfill, Non-parametric local transforms for computing visual correspondence,
//! ECCV 1994.

use rayon::prelude::*;

use crate::vision::image::GreyImage;

/// Bits that a candidate outside the right image costs.
const UNSEEN_BITS: u8 = 20;

const HALF_WIDTH: usize = 4;
const HALF_HEIGHT: usize = 3;
const LANES: usize = 8;

/// Costs of all candidates of a left view.
pub(super) struct CostVolume {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Disparities 0..levels.
    pub(super) levels: usize,
    /// Distance between the costs of two neighbouring pixels: `levels`, padded for vector lanes.
    pub(super) stride: usize,
    pub(super) costs: Vec<u8>,
}

impl CostVolume {
    /// Costs of the disparities `0..levels` of a pair of images of one size.
    pub(super) fn of_pair(left: &GreyImage, right: &GreyImage, levels: usize) -> Self {
        let (width, height) = (left.width(), left.height());
        let stride = levels.next_multiple_of(LANES);
        let (left_words, right_words) = (census(left), census(right));
        let mut bits = vec![0u8; width * height * stride];
        bits.par_chunks_mut(width * stride)
            .zip(left_words.par_chunks(width).zip(right_words.par_chunks(width)))
            .for_each(|(row, (left, right))| hamming_row(row, left, right, levels, stride));
        let costs = sum_windows(&bits, width, height, levels, stride);
        Self { width, height, levels, stride, costs }
    }

    /// Costs of one pixel at the disparities `0..levels`.
    pub(super) fn at(&self, pixel: usize) -> &[u8] {
        &self.costs[pixel * self.stride..][..self.levels]
    }
}

/// Census words of an image; beyond the border the nearest pixel counts.
fn census(image: &GreyImage) -> Vec<u64> {
    let (width, height) = (image.width(), image.height());
    let padded_width = width + 2 * HALF_WIDTH;
    let padded_row = |y: usize| {
        let row = &image.pixels()[y * width..][..width];
        (0..padded_width).map(move |x| row[x.saturating_sub(HALF_WIDTH).min(width - 1)])
    };
    let padded: Vec<f32> = (0..height).flat_map(padded_row).collect();
    let mut words = vec![0u64; width * height];
    words.par_chunks_mut(width).enumerate().for_each(|(y, words)| {
        let row_of = |y: usize| &padded[y * padded_width..][..padded_width];
        let centres = &row_of(y)[HALF_WIDTH..][..width];
        for dy in 0..=2 * HALF_HEIGHT {
            let neighbours = row_of((y + dy).saturating_sub(HALF_HEIGHT).min(height - 1));
            for dx in (0..=2 * HALF_WIDTH).filter(|&dx| (dx, dy) != (HALF_WIDTH, HALF_HEIGHT)) {
                for ((word, centre), neighbour) in words.iter_mut().zip(centres).zip(&neighbours[dx..]) {
                    *word = *word << 1 | u64::from(neighbour < centre);
                }
            }
        }
    });
    words
}

/// Hamming distances of one row; unseen and padding lanes get their constants.
fn hamming_row(row: &mut [u8], left: &[u64], right: &[u64], levels: usize, stride: usize) {
    for (x, (cell, left_word)) in row.chunks_exact_mut(stride).zip(left).enumerate() {
        let seen = levels.min(x + 1);
        let candidates = right[x + 1 - seen..=x].iter().rev();
        for (bits, right_word) in cell.iter_mut().zip(candidates) {
            *bits = (left_word ^ right_word).count_ones() as u8;
        }
        cell[seen..].fill(UNSEEN_BITS);
    }
}

/// Sums of 3×3 windows at one disparity, divided by 4.
fn sum_windows(bits: &[u8], width: usize, height: usize, levels: usize, stride: usize) -> Vec<u8> {
    let row_length = width * stride;
    let mut costs = vec![0u8; bits.len()];
    costs.par_chunks_mut(row_length).enumerate().for_each_init(
        || vec![0u16; row_length],
        |column_sums, (y, row)| {
            let row_of = |y: usize| &bits[y * row_length..][..row_length];
            let (above, here, below) =
                (row_of(y.saturating_sub(1)), row_of(y), row_of((y + 1).min(height - 1)));
            for (((sum, a), b), c) in column_sums.iter_mut().zip(above).zip(here).zip(below) {
                *sum = u16::from(*a) + u16::from(*b) + u16::from(*c);
            }
            for (x, cell) in row.chunks_exact_mut(stride).enumerate() {
                let sums_of = |x: usize| &column_sums[x * stride..][..stride];
                let (before, here, after) =
                    (sums_of(x.saturating_sub(1)), sums_of(x), sums_of((x + 1).min(width - 1)));
                for (((cost, a), b), c) in cell.iter_mut().zip(before).zip(here).zip(after) {
                    *cost = ((a + b + c) >> 2) as u8;
                }
                cell[levels..].fill(u8::MAX);
            }
        },
    );
    costs
}
