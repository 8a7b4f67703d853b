//! The matching cost of each pixel at each disparity: `Cost[k]` of `models/scanline.bp`.
//!
//! In: a rectified pair in whole grey levels. Out: [`Costs`], 0..=157, index `(y * width + x) * stride + d`. Each
//! pixel becomes a census word of 24 bits, one for each neighbour in a 5×5 window, set where the neighbour is darker.
//! With h the number of bits in which the left word at x and the right word at x − d differ, and |ΔI| the difference
//! of intensity,
//!
//! ```text
//! e = 5 h + min(|ΔI|, 20)        cost = ⌊Σ_{3×3} e / 8⌋
//! ```
//!
//! The census is invariant to gain and offset of the cameras; the intensity distinguishes pixels with the same order,
//! and weighs at most four bits. A candidate outside the right image costs [`UNSEEN`]: less than a random match, more
//! than a correct one. Invariant: rows do not depend on their distribution among threads; the fill of the stride is not
//! defined. Reference: Zabih and Woodfill, Non-parametric local transforms for computing visual correspondence, ECCV
//! 1994.

use super::super::memory::Bytes;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

const HALF: usize = 2;
const PER_BIT: u8 = 5;
const MOST_DIFFERENCE: u8 = 20;
const UNSEEN: u8 = 42;
/// Rows in one task of a thread.
const BAND: usize = 32;

/// Costs of all candidates of a left view.
pub(super) struct Costs {
    pub(super) stride: usize,
    values: Bytes,
}

impl Costs {
    /// Costs of the disparities `0..levels`, `levels <= stride`.
    pub(super) fn of_pair(left: &[u8], right: &[u8], width: usize, levels: usize, stride: usize) -> Self {
        let (left, right) = (Words::of(left, width), Words::of(right, width).reversed(stride));
        let mut values = Bytes::zeros(left.intensity.len() * stride);
        let arch = Arch::new();
        values.par_chunks_mut(width * stride * BAND).enumerate().for_each(|(band, rows)| {
            let pair = Pair { left: &left, right: &right, width, levels, stride };
            arch.dispatch(Band { pair, first: band * BAND, rows });
        });
        Self { stride, values }
    }

    /// Costs of the pixels of a row, pixel by pixel.
    pub(super) fn row(&self, y: usize, width: usize) -> &[u8] {
        &self.values[y * width * self.stride..][..width * self.stride]
    }
}

/// Census words in three bytes, and intensities.
struct Words {
    width: usize,
    census: [Vec<u8>; 3],
    intensity: Vec<u8>,
}

impl Words {
    fn of(pixels: &[u8], width: usize) -> Self {
        let height = pixels.len() / width;
        let padded = |y: usize| -> Vec<u8> {
            let row = &pixels[y * width..][..width];
            (0..width + 2 * HALF).map(|x| row[x.saturating_sub(HALF).min(width - 1)]).collect()
        };
        let rows: Vec<Vec<u8>> = (0..height).map(padded).collect();
        let mut census: [Vec<u8>; 3] = std::array::from_fn(|_| vec![0; pixels.len()]);
        let arch = Arch::new();
        for (y, centres) in rows.iter().enumerate() {
            let offsets = (0..5usize).flat_map(|dy| (0..5usize).map(move |dx| (dy, dx)));
            for (bit, (dy, dx)) in offsets.filter(|at| *at != (HALF, HALF)).enumerate() {
                let neighbours = &rows[(y + dy).saturating_sub(HALF).min(height - 1)][dx..][..width];
                let words = &mut census[bit / 8][y * width..][..width];
                arch.dispatch(Darker { centres: &centres[HALF..][..width], neighbours, words });
            }
        }
        Self { width, census, intensity: pixels.to_vec() }
    }

    /// Each row from right to left, followed by `fill` zeros: the candidates of a pixel lie side by side.
    fn reversed(self, fill: usize) -> Self {
        let width = self.width;
        let turn = |values: Vec<u8>| {
            let mut turned = vec![0; values.len() / width * (width + fill)];
            for (turned, row) in turned.chunks_exact_mut(width + fill).zip(values.chunks_exact(width)) {
                turned[..width].copy_from_slice(row);
                turned[..width].reverse();
            }
            turned
        };
        Self { width: self.width + fill, census: self.census.map(turn), intensity: turn(self.intensity) }
    }
}

/// One bit of each word of a row.
struct Darker<'w> {
    centres: &'w [u8],
    neighbours: &'w [u8],
    words: &'w mut [u8],
}

impl WithSimd for Darker<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for ((word, centre), neighbour) in self.words.iter_mut().zip(self.centres).zip(self.neighbours) {
            *word = *word << 1 | u8::from(neighbour < centre);
        }
    }
}

struct Pair<'w> {
    left: &'w Words,
    right: &'w Words,
    width: usize,
    levels: usize,
    stride: usize,
}

/// Some rows of costs, the first of which is `first`.
struct Band<'w> {
    pair: Pair<'w>,
    first: usize,
    rows: &'w mut [u8],
}

impl WithSimd for Band<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Band { pair, first, rows } = self;
        let length = pair.width * pair.stride;
        let height = pair.left.intensity.len() / pair.width;
        let clamp = |y: isize| y.clamp(0, height as isize - 1) as usize;
        // The three rows that a window spans, in turn.
        let mut single: [Vec<u8>; 3] = std::array::from_fn(|_| vec![0; length]);
        // A pixel more on either side.
        let mut columns = vec![0u16; length + 2 * pair.stride];
        for (offset, row) in single.iter_mut().enumerate().take(2) {
            pair.single(clamp((first + offset) as isize - 1), row);
        }
        for (offset, row) in rows.chunks_exact_mut(length).enumerate() {
            let y = first + offset;
            pair.single(clamp(y as isize + 1), &mut single[(offset + 2) % 3]);
            let [a, b, c] = &single;
            let middle = &mut columns[pair.stride..][..length];
            for (((sum, a), b), c) in middle.iter_mut().zip(a).zip(b).zip(c) {
                *sum = u16::from(*a) + u16::from(*b) + u16::from(*c);
            }
            columns.copy_within(pair.stride..2 * pair.stride, 0);
            columns.copy_within(length..length + pair.stride, length + pair.stride);
            let (left, right) = (&columns[..length], &columns[2 * pair.stride..][..length]);
            let middle = &columns[pair.stride..][..length];
            for (((cost, a), b), c) in row.iter_mut().zip(left).zip(middle).zip(right) {
                *cost = ((*a + *b + *c) >> 3) as u8;
            }
        }
    }
}

impl Pair<'_> {
    /// The costs of single pixels.
    #[inline(always)]
    fn single(&self, y: usize, row: &mut [u8]) {
        for (x, cells) in row.chunks_exact_mut(self.stride).enumerate() {
            let at = y * self.width + x;
            let from = y * self.right.width + self.width - 1 - x;
            let [a, b, c] = self.left.census.each_ref().map(|word| word[at]);
            let own = self.left.intensity[at];
            let [d, e, f] = self.right.census.each_ref().map(|words| &words[from..][..cells.len()]);
            let other = &self.right.intensity[from..][..cells.len()];
            for ((((cell, d), e), f), other) in cells.iter_mut().zip(d).zip(e).zip(f).zip(other) {
                // Three bits of one place are a sum and a carry: two bytes to count, rather than three.
                let (x, y, z) = (a ^ d, b ^ e, c ^ f);
                let (sum, carry) = (x ^ y ^ z, x & y | z & (x | y));
                let bits = sum.count_ones() as u8 + 2 * carry.count_ones() as u8;
                *cell = PER_BIT * bits + own.abs_diff(*other).min(MOST_DIFFERENCE);
            }
            if x + 1 < self.levels {
                cells[x + 1..].fill(UNSEEN);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_by_hand() {
        // A bright pixel in the middle of 5×1 on the left, one further left on the right.
        let (left, right) = ([10, 10, 200, 10, 10], [10, 200, 10, 10, 10]);
        let costs = Costs::of_pair(&left, &right, 5, 3, 8);
        // Rows beyond the picture repeat it. At disparity 1 all bits agree, except for candidates outside.
        let row = costs.row(0, 5);
        assert_eq!(row[2 * 8 + 1], 0);
        assert_eq!(row[4 * 8 + 1], 0);
        // At disparity 0 the pixel x = 4 and its neighbours: pixel 3 has the bit of pixel 2 (in 5 rows) on the left,
        // but not on the right ... counted one by one below.
        let brute = |x: usize, d: usize| -> u8 {
            let word = |row: &[u8; 5], x: usize| -> Vec<bool> {
                let at = |dx: isize| row[(x as isize + dx).clamp(0, 4) as usize];
                let row: Vec<bool> = (-2..=2).map(|dx| at(dx) < at(0)).collect();
                (0..5).flat_map(|_| row.clone()).collect()
            };
            let single = |x: usize| -> u32 {
                if d > x {
                    return u32::from(UNSEEN);
                }
                let bits = word(&left, x).iter().zip(word(&right, x - d)).filter(|(a, b)| **a != *b).count();
                5 * bits as u32 + u32::from(left[x].abs_diff(right[x - d]).min(20))
            };
            let sum: u32 = (-1..=1).map(|dx| single((x as isize + dx).clamp(0, 4) as usize)).sum();
            (3 * sum / 8) as u8
        };
        for x in 0..5 {
            for d in 0..3 {
                assert_eq!(row[x * 8 + d], brute(x, d), "x {x}, d {d}");
            }
        }
    }
}
