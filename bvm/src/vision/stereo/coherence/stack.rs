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

impl WithSimd for Band<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (width, height) = (self.width, self.pictures[0].intensity.len() / self.width);
        // Sums over the rows of a window, for each layer and column.
        let mut products = vec![0i32; self.layers * width];
        let mut squares = vec![0i32; self.layers * width];
        let mut run = Run::new(width);
        let end = self.first + self.disparity.len() / width;
        for y in self.first.saturating_sub(RADIUS)..(self.first + RADIUS).min(height) {
            self.add::<1>(y, &mut products, &mut squares);
        }
        for y in self.first..end {
            if y + RADIUS < height {
                self.add::<1>(y + RADIUS, &mut products, &mut squares);
            }
            if let Some(gone) = y.checked_sub(RADIUS + 1).filter(|gone| gone + RADIUS >= self.first) {
                self.add::<-1>(gone, &mut products, &mut squares);
            }
            run.begin();
            for layer in 0..self.layers {
                let own = layer * width..(layer + 1) * width;
                run.estimate(layer, &products[own.clone()], &squares[own]);
                run.link();
            }
            let own = (y - self.first) * width..(y - self.first + 1) * width;
            run.read(&mut self.disparity[own.clone()], &mut self.members[own]);
        }
    }
}

impl Band<'_> {
    /// Adds a row to the sums, or takes it away.
    #[inline(always)]
    fn add<const SIGN: i32>(&self, y: usize, products: &mut [i32], squares: &mut [i32]) {
        let width = self.width;
        let own = y * width..(y + 1) * width;
        let [left, right] = self.pictures;
        let (left_value, left_slope) = (&left.intensity[own.clone()], &left.slope[own.clone()]);
        let (right_value, right_slope) = (&right.intensity[own.clone()], &right.slope[own]);
        for layer in 0..self.layers {
            let (ahead, behind) = (layer.div_ceil(2), layer / 2);
            if layer >= width {
                break;
            }
            let count = width - layer;
            let products = &mut products[layer * width + behind..][..count];
            let squares = &mut squares[layer * width + behind..][..count];
            let left = left_value[ahead + behind..].iter().zip(&left_slope[ahead + behind..]);
            let right = right_value[..count].iter().zip(&right_slope[..count]);
            let sums = products.iter_mut().zip(squares);
            for ((product, square), ((left, left_slope), (right, right_slope))) in sums.zip(left.zip(right)) {
                let slope = i32::from(left_slope + right_slope);
                *product += SIGN * slope * i32::from(right - left);
                *square += SIGN * slope * slope;
            }
        }
    }
}

/// Chains of coherent layers, for all directions of a row.
struct Run {
    estimate: Vec<f32>,
    before: Vec<f32>,
    sum: Vec<f32>,
    count: Vec<f32>,
    best_sum: Vec<f32>,
    best_count: Vec<f32>,
    padded: [Vec<i32>; 2],
    sums: [Vec<i32>; 2],
}

impl Run {
    fn new(width: usize) -> Self {
        let row = || vec![0.0; width];
        Self {
            estimate: row(),
            before: row(),
            sum: row(),
            count: row(),
            best_sum: row(),
            best_count: row(),
            sums: [vec![0; width], vec![0; width]],
            padded: [vec![0; width + 2 * RADIUS], vec![0; width + 2 * RADIUS]],
        }
    }

    #[inline(always)]
    fn begin(&mut self) {
        self.before.fill(f32::NAN);
        for values in [&mut self.sum, &mut self.count, &mut self.best_sum, &mut self.best_count] {
            values.fill(0.0);
        }
    }

    /// The estimates of a layer, from its sums over columns; NaN where a unit does not answer.
    #[inline(always)]
    fn estimate(&mut self, layer: usize, products: &[i32], squares: &[i32]) {
        let width = products.len();
        for (padded, values) in self.padded.iter_mut().zip([products, squares]) {
            padded[RADIUS..][..width].copy_from_slice(values);
        }
        let layer = layer as f32;
        let side = (2 * RADIUS + 1) as f32;
        // The slope of both pictures over two pixels each, at four times the intensity, is 16 times that of their mean.
        let least = 256.0 * LEAST_SLOPE * side * side;
        for (padded, sums) in self.padded.iter().zip(&mut self.sums) {
            window_sums(padded, sums);
        }
        let [products, squares] = &self.sums;
        for ((estimate, product), square) in self.estimate.iter_mut().zip(products).zip(squares) {
            let square = *square as f32;
            let rest = 4.0 * *product as f32 / square.max(1.0);
            let answers = (square >= least) & (rest.abs() <= RANGE);
            *estimate = if answers { layer + rest } else { f32::NAN };
        }
    }

    /// Continues the chains with the layer just estimated.
    #[inline(always)]
    fn link(&mut self) {
        let chains = self.sum.iter_mut().zip(&mut self.count);
        let best = self.best_sum.iter_mut().zip(&mut self.best_count);
        let own = self.estimate.iter().zip(&mut self.before);
        for (((sum, count), (best_sum, best_count)), (estimate, before)) in chains.zip(best).zip(own) {
            let coherent = (*estimate - *before).abs() < COHERENT;
            *sum = if coherent { *sum + *estimate } else { *estimate };
            *count = if coherent { *count + 1.0 } else { 1.0 };
            let larger = coherent & (*count > *best_count);
            *best_sum = if larger { *sum } else { *best_sum };
            *best_count = if larger { *count } else { *best_count };
            *before = *estimate;
        }
    }

    #[inline(always)]
    fn read(&self, disparity: &mut [f32], members: &mut [f32]) {
        members.copy_from_slice(&self.best_count);
        for ((disparity, sum), count) in disparity.iter_mut().zip(&self.best_sum).zip(&self.best_count) {
            *disparity = if *count > 0.0 { sum / count } else { f32::INFINITY };
        }
    }
}

/// Sums over the window's columns.
#[inline(always)]
fn window_sums(padded: &[i32], sums: &mut [i32]) {
    let width = sums.len();
    let [a, b, c, d, e, f, g]: [&[i32]; 2 * RADIUS + 1] = std::array::from_fn(|at| &padded[at..][..width]);
    for (x, sum) in sums.iter_mut().enumerate() {
        *sum = ((a[x] + b[x]) + (c[x] + d[x])) + ((e[x] + f[x]) + g[x]);
    }
}
