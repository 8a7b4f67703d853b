//! One spatial scale of the stack: layers of disparity units, and their largest coherent class.
//!
//! In: a pair in whole grey levels. Out: [`Classes`]: for each cyclopean direction the number of units that agree, and
//! their disparity. Layer s sees the left picture shifted by ⌈s/2⌉ pixels and the right one by ⌊s/2⌋ in the opposite direction. Its
//! unit estimates by least squares over a small window w
//!
//! ```text
//! d_s = s + Σ_w (I_R − I_L) ∂Ī / Σ_w (∂Ī)²,      Ī = ½ (I_L + I_R)
//! ```
//!
//! which is correct if the residual disparity is within the working range of the unit, less than half the shortest
//! wavelength, and random otherwise. Neighbouring layers whose estimates differ by less than ε are coherent; a class is
//! a chain of such neighbours, and its mean is the estimate. Invariant: sums are integers, so a running sum is exact
//! and the result does not depend on the threads.

use super::super::lanes::{LANES, both};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// ε, pixels.
pub(super) const COHERENT: f32 = 0.3;
/// Half the side of the window, pixels.
const RADIUS: usize = 3;
/// Least mean square of the gradient of intensity for a valid unit, grey levels per pixel squared.
const LEAST_SLOPE: f32 = 0.5;
/// Largest distance of a unit's estimate from its layer, pixels.
const RANGE: f32 = 2.5;
/// Rows in one task of a thread.
const BAND: usize = 96;

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
        Band { pictures: &pictures, width, layers, first: band * BAND, disparity, members }.detect(arch);
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
            let sum =
                |[before, here, after]: [u8; 3]| i16::from(before) + 2 * i16::from(here) + i16::from(after);
            let last = width - 1;
            across[0] = sum([row[0], row[0], row[1.min(last)]]);
            across[last] = sum([row[last.saturating_sub(1)], row[last], row[last]]);
            for (across, near) in across[1..].iter_mut().zip(row.array_windows::<3>()) {
                *across = sum(*near);
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

impl Band<'_> {
    /// Finds the classes of all rows.
    fn detect(self, arch: Arch) {
        let (width, height) = (self.width, self.pictures[0].intensity.len() / self.width);
        let stride = width.next_multiple_of(LANES) + 2 * RADIUS;
        let row = || vec![0; self.layers * stride];
        let mut sums = Sums { stride, products: row(), squares: row() };
        let Self { pictures, layers, first, disparity, members, .. } = self;
        let slide = |come: Option<usize>, gone: Option<usize>, sums: &mut Sums| {
            arch.dispatch(Slide { pictures, width, layers, come, gone, sums });
        };
        for y in first.saturating_sub(RADIUS)..(first + RADIUS).min(height) {
            slide(Some(y), None, &mut sums);
        }
        let rows = disparity.chunks_exact_mut(width).zip(members.chunks_exact_mut(width));
        for (y, (disparity, members)) in (first..).zip(rows) {
            let come = Some(y + RADIUS).filter(|come| *come < height);
            let gone = y.checked_sub(RADIUS + 1).filter(|gone| gone + RADIUS >= first);
            slide(come, gone, &mut sums);
            arch.dispatch(Row { sums: &sums, layers, disparity, members });
        }
    }
}

/// The classes of a row.
struct Row<'s> {
    sums: &'s Sums,
    layers: usize,
    disparity: &'s mut [f32],
    members: &'s mut [f32],
}

impl WithSimd for Row<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let mut chunk = ([0f32; LANES], [0f32; LANES]);
        let chunks = self.disparity.chunks_mut(LANES).zip(self.members.chunks_mut(LANES));
        for (at, (disparity, members)) in chunks.enumerate() {
            largest_class(self.sums, self.layers, at * LANES, &mut chunk);
            disparity.copy_from_slice(&chunk.0[..disparity.len()]);
            members.copy_from_slice(&chunk.1[..members.len()]);
        }
    }
}

/// The window moves: one row enters, one leaves.
struct Slide<'p> {
    pictures: &'p [Picture; 2],
    width: usize,
    layers: usize,
    come: Option<usize>,
    gone: Option<usize>,
    sums: &'p mut Sums,
}

impl WithSimd for Slide<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) {
        match (self.come, self.gone) {
            (Some(come), Some(gone)) => self.exchange([come, gone]),
            (Some(come), None) => self.add::<1>(come),
            (None, Some(gone)) => self.add::<-1>(gone),
            (None, None) => {}
        }
    }
}

impl<'p> Slide<'p> {
    /// Adds a row to the sums, or subtracts it.
    #[inline(always)]
    fn add<const SIGN: i32>(&mut self, y: usize) {
        for layer in 0..self.layers.min(self.width) {
            let [left, right] = self.seen(y, layer);
            let (products, squares) = self.sums.of(layer, self.width - layer);
            for ((product, square), pixel) in products.iter_mut().zip(squares).zip(units(left, right)) {
                let [own, other] = unit(pixel);
                *product += SIGN * own;
                *square += SIGN * other;
            }
        }
    }

    /// Adds one row and subtracts another: the sums pass through the caches once.
    #[inline(always)]
    fn exchange(&mut self, [come, gone]: [usize; 2]) {
        for layer in 0..self.layers.min(self.width) {
            let [[left, right], [old_left, old_right]] = [self.seen(come, layer), self.seen(gone, layer)];
            let (products, squares) = self.sums.of(layer, self.width - layer);
            let pixels = units(left, right).zip(units(old_left, old_right));
            for ((product, square), (pixel, old)) in products.iter_mut().zip(squares).zip(pixels) {
                let ([own, other], [old_own, old_other]) = (unit(pixel), unit(old));
                *product += own - old_own;
                *square += other - old_other;
            }
        }
    }

    /// The part of a row that a layer uses: intensities and gradients of the left picture, and as many of the right
    /// one.
    #[inline(always)]
    fn seen(&self, y: usize, layer: usize) -> [(&'p [i16], &'p [i16]); 2] {
        let own = y * self.width..(y + 1) * self.width;
        let [left, right] = self.pictures;
        let count = self.width - layer;
        [
            (&left.intensity[own.clone()][layer..][..count], &left.slope[own.clone()][layer..][..count]),
            (&right.intensity[own.clone()][..count], &right.slope[own][..count]),
        ]
    }
}

impl Sums {
    /// The sums of a layer, where both pictures show it.
    #[inline(always)]
    fn of(&mut self, layer: usize, count: usize) -> (&mut [i32], &mut [i32]) {
        let start = layer * self.stride + RADIUS + layer / 2;
        (&mut self.products[start..][..count], &mut self.squares[start..][..count])
    }
}

/// Intensity and slope of one pixel in both pictures.
type Pixel<'p> = ((&'p i16, &'p i16), (&'p i16, &'p i16));

/// The pixels that both see.
#[inline(always)]
fn units<'p>(left: (&'p [i16], &'p [i16]), right: (&'p [i16], &'p [i16])) -> impl Iterator<Item = Pixel<'p>> {
    left.0.iter().zip(left.1).zip(right.0.iter().zip(right.1))
}

/// (I_R − I_L) ∂Ī and (∂Ī)² of a pixel, up to factors.
#[inline(always)]
fn unit(((left, left_slope), (right, right_slope)): Pixel<'_>) -> [i32; 2] {
    let slope = i32::from(left_slope + right_slope);
    [slope * i32::from(right - left), slope * slope]
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
        // An invalid unit is NaN, and coherent with no other.
        let estimate = both(&rest, &squares, |rest, square| {
            if (square >= least) & (rest.abs() <= RANGE) { layer as f32 + rest } else { f32::NAN }
        });
        let apart = both(&estimate, &before, |estimate, before| (estimate - before).abs());
        let carried = both(&sum, &apart, |sum, apart| if apart < COHERENT { sum } else { 0.0 });
        let linked = both(&count, &apart, |count, apart| if apart < COHERENT { count } else { 0.0 });
        sum = both(&carried, &estimate, |sum, estimate| sum + estimate);
        count = linked.map(|count| count + 1.0);
        // A single unit has no agreement.
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
