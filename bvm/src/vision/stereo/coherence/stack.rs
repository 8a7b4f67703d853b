//! One spatial scale of the stack: layers of disparity units, and their largest coherent class.
//!
//! In: a pair in whole grey levels. Out: [`Classes`]: for each cyclopean direction how many units agree, and on what.
//! Layer s sees the left picture shifted by ⌈s/2⌉ pixels and the right one by ⌊s/2⌋ the other way. Its unit estimates
//! by least squares over a small window w
//!
//! ```text
//! d_s = s + Σ_w (I_R − I_L) ∂Ī / Σ_w (∂Ī)²,      Ī = ½ (I_L + I_R)
//! ```
//!
//! which is right while the rest is within the working range of the unit, less than half the shortest wavelength, and
//! random beyond. Neighbouring layers whose estimates differ by less than ε are coherent; a class is a chain of such
//! neighbours, and its mean is read out.
//! Invariant: sums are whole numbers, so a running sum is exact and the result does not depend on the threads.

use super::super::lanes::{LANES, both};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// ε, pixels.
pub(super) const COHERENT: f32 = 0.3;
/// Half the side of the window, pixels.
const RADIUS: usize = 3;
/// Least mean square of the slope of intensity, grey levels per pixel squared, that a unit answers to.
const LEAST_SLOPE: f32 = 0.5;
/// Farthest that a unit's own answer may be from its layer, pixels.
const RANGE: f32 = 2.5;
/// Rows that a thread takes at once.
const BAND: usize = 48;

/// The largest coherent class of each direction.
pub(super) struct Classes {
    pub(super) layers: usize,
    /// Mean of the class, pixels of this scale.
    pub(super) disparity: Vec<f32>,
    /// Number of its units; 0 where no two agree.
    pub(super) members: Vec<f32>,
}

/// The classes of the layers `0..layers`.
pub(super) fn classes(left: &[u8], right: &[u8], width: usize, layers: usize) -> Classes {
    let pictures = [left, right].map(|picture| Picture::of(picture, width));
    let count = left.len();
    let mut found = Classes { layers, disparity: vec![0.0; count], members: vec![0.0; count] };
    let arch = Arch::new();
    let bands = found.disparity.par_chunks_mut(width * BAND).zip(found.members.par_chunks_mut(width * BAND));
    bands.enumerate().for_each(|(band, (disparity, members))| {
        arch.dispatch(Band { pictures: &pictures, width, layers, first: band * BAND, disparity, members });
    });
    found
}

/// Intensities, and their slopes over two pixels.
struct Picture {
    intensity: Vec<i16>,
    slope: Vec<i16>,
}

impl Picture {
    /// Smoothed by 1 2 1 both ways, which widens the working range; four times the intensity.
    fn of(pixels: &[u8], width: usize) -> Self {
        let height = pixels.len() / width;
        let mut across = vec![0i16; pixels.len()];
        for (across, row) in across.chunks_exact_mut(width).zip(pixels.chunks_exact(width)) {
            for (x, sum) in across.iter_mut().enumerate() {
                let [before, here, after] =
                    [x.saturating_sub(1), x, (x + 1).min(width - 1)].map(|x| i16::from(row[x]));
                *sum = before + 2 * here + after;
            }
        }
        let mut intensity = vec![0i16; pixels.len()];
        for (y, smooth) in intensity.chunks_exact_mut(width).enumerate() {
            let row = |y: usize| &across[y * width..][..width];
            let (above, here, below) = (row(y.saturating_sub(1)), row(y), row((y + 1).min(height - 1)));
            for (((smooth, a), b), c) in smooth.iter_mut().zip(above).zip(here).zip(below) {
                *smooth = (a + 2 * b + c) >> 2;
            }
        }
        let mut slope = vec![0; pixels.len()];
        for (slope, row) in slope.chunks_exact_mut(width).zip(intensity.chunks_exact(width)) {
            for x in 1..width.saturating_sub(1) {
                slope[x] = row[x + 1] - row[x - 1];
            }
        }
        Self { intensity, slope }
    }
}

struct Band<'p> {
    pictures: &'p [Picture; 2],
    width: usize,
    layers: usize,
    first: usize,
    disparity: &'p mut [f32],
    members: &'p mut [f32],
}

/// Sums over the rows of a window, for each layer and column; zeros beyond both ends of a row.
struct Sums {
    stride: usize,
    products: Vec<i32>,
    squares: Vec<i32>,
}

impl WithSimd for Band<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (width, height) = (self.width, self.pictures[0].intensity.len() / self.width);
        let stride = width.next_multiple_of(LANES) + 2 * RADIUS;
        let row = || vec![0; self.layers * stride];
        let mut sums = Sums { stride, products: row(), squares: row() };
        let end = self.first + self.disparity.len() / width;
        for y in self.first.saturating_sub(RADIUS)..(self.first + RADIUS).min(height) {
            self.add::<1>(y, &mut sums);
        }
        let mut chunk = ([0f32; LANES], [0f32; LANES]);
        for y in self.first..end {
            if y + RADIUS < height {
                self.add::<1>(y + RADIUS, &mut sums);
            }
            if let Some(gone) = y.checked_sub(RADIUS + 1).filter(|gone| gone + RADIUS >= self.first) {
                self.add::<-1>(gone, &mut sums);
            }
            let row = (y - self.first) * width;
            for x in (0..width).step_by(LANES) {
                largest_class(&sums, self.layers, x, &mut chunk);
                let count = LANES.min(width - x);
                self.disparity[row + x..][..count].copy_from_slice(&chunk.0[..count]);
                self.members[row + x..][..count].copy_from_slice(&chunk.1[..count]);
            }
        }
    }
}

impl Band<'_> {
    /// Adds a row to the sums, or takes it away.
    #[inline(always)]
    fn add<const SIGN: i32>(&self, y: usize, sums: &mut Sums) {
        let width = self.width;
        let [left, right] = self.pictures;
        let own = y * width..(y + 1) * width;
        let (left_value, left_slope) = (&left.intensity[own.clone()], &left.slope[own.clone()]);
        let (right_value, right_slope) = (&right.intensity[own.clone()], &right.slope[own]);
        for layer in 0..self.layers.min(width) {
            let behind = layer / 2;
            let count = width - layer;
            let start = layer * sums.stride + RADIUS + behind;
            let own = sums.products[start..][..count].iter_mut().zip(&mut sums.squares[start..][..count]);
            let left = left_value[layer..].iter().zip(&left_slope[layer..]);
            let right = right_value[..count].iter().zip(&right_slope[..count]);
            for ((product, square), ((left, left_slope), (right, right_slope))) in own.zip(left.zip(right)) {
                let slope = i32::from(left_slope + right_slope);
                *product += SIGN * slope * i32::from(right - left);
                *square += SIGN * slope * slope;
            }
        }
    }
}

/// The largest class of [`LANES`] directions, the first of which is `x`: the mean of its estimates, and their number.
#[inline(always)]
fn largest_class(sums: &Sums, layers: usize, x: usize, found: &mut ([f32; LANES], [f32; LANES])) {
    let side = (2 * RADIUS + 1) as f32;
    // The slope of both pictures over two pixels each, at four times the intensity, is 16 times that of their mean.
    let least = 256.0 * LEAST_SLOPE * side * side;
    let zero = [0f32; LANES];
    let (mut before, mut sum, mut count) = ([f32::NAN; LANES], zero, zero);
    let (mut best_sum, mut best_count) = (zero, zero);
    for layer in 0..layers {
        let window = layer * sums.stride + x..layer * sums.stride + x + LANES + 2 * RADIUS;
        let products = window_sums(&sums.products[window.clone()]);
        let squares = window_sums(&sums.squares[window]);
        let rest = both(&products, &squares, |product, square| 4.0 * product / square.max(1.0));
        // What does not answer is not a number, and coherent with nothing.
        let estimate = both(&rest, &squares, |rest, square| {
            if (square >= least) & (rest.abs() <= RANGE) { layer as f32 + rest } else { f32::NAN }
        });
        let apart = both(&estimate, &before, |estimate, before| (estimate - before).abs());
        let carried = both(&sum, &apart, |sum, apart| if apart < COHERENT { sum } else { 0.0 });
        let linked = both(&count, &apart, |count, apart| if apart < COHERENT { count } else { 0.0 });
        sum = both(&carried, &estimate, |sum, estimate| sum + estimate);
        count = linked.map(|count| count + 1.0);
        // A single unit agrees with nobody.
        let gain = both(&count, &best_count, |count, best| if count > best.max(1.0) { 1.0 } else { 0.0 });
        best_sum = std::array::from_fn(|lane| if gain[lane] > 0.0 { sum[lane] } else { best_sum[lane] });
        best_count =
            std::array::from_fn(|lane| if gain[lane] > 0.0 { count[lane] } else { best_count[lane] });
        before = estimate;
    }
    found.0 =
        both(&best_sum, &best_count, |sum, count| if count > 0.0 { sum / count } else { f32::INFINITY });
    found.1 = best_count;
}

/// Sums over the window's columns.
#[inline(always)]
fn window_sums(values: &[i32]) -> [f32; LANES] {
    let from = |offset: usize| &values[offset..][..LANES].as_chunks::<LANES>().0[0];
    let add = |sum, offset| both(&sum, from(offset), |sum, value| sum + value);
    (1..=2 * RADIUS).fold(*from(0), add).map(|sum| sum as f32)
}
