//! Arrays of values for SIMD.
//!
//! In: arrays of [`LANES`] values. Out: the same, or their sum. An array of known length compiles to one or a few
//! registers of any instruction set. Invariant: sums have a fixed order, so every instruction set gives the same bits.

use nalgebra::RealField;
use std::hint::black_box;

/// An array of lanes.
pub(super) const LANES: usize = 16;

/// A function of two values, in each lane.
#[inline(always)]
pub(super) fn both<T: Copy>(one: &[T; LANES], other: &[T; LANES], of: impl Fn(T, T) -> T) -> [T; LANES] {
    std::array::from_fn(|lane| of(one[lane], other[lane]))
}

/// The sum of the lanes.
#[inline(always)]
pub(super) fn across<T: RealField + Copy>(lanes: [T; LANES]) -> T {
    // The call is hidden from the optimiser, which would otherwise shuffle the lanes inside the loop for this sum.
    let lanes = black_box(lanes);
    let eight: [T; 8] = std::array::from_fn(|lane| lanes[lane] + lanes[lane + 8]);
    let four: [T; 4] = std::array::from_fn(|lane| eight[lane] + eight[lane + 4]);
    (four[0] + four[2]) + (four[1] + four[3])
}
