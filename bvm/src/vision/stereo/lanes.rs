//! Values that are worked on side by side.
//!
//! In: arrays of [`LANES`] values. Out: the same, or their sum. An array of known length is a register, or a few, of any
//! instruction set. Invariant: sums are made in one order, so every instruction set gives the same bits.

use nalgebra::RealField;
use std::hint::black_box;

/// Values side by side.
pub(super) const LANES: usize = 16;

/// A function of two values, in each lane.
#[inline(always)]
pub(super) fn both<T: Copy>(one: &[T; LANES], other: &[T; LANES], of: impl Fn(T, T) -> T) -> [T; LANES] {
    std::array::from_fn(|lane| of(one[lane], other[lane]))
}

/// The sum of the lanes.
#[inline(always)]
pub(super) fn across<T: RealField + Copy>(lanes: [T; LANES]) -> T {
    // The optimiser would rather mix the lanes inside the loop, to suit this sum; it must not see it.
    let lanes = black_box(lanes);
    let eight: [T; 8] = std::array::from_fn(|lane| lanes[lane] + lanes[lane + 8]);
    let four: [T; 4] = std::array::from_fn(|lane| eight[lane] + eight[lane + 4]);
    (four[0] + four[2]) + (four[1] + four[3])
}
