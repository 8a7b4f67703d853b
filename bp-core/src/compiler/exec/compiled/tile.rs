//! Tiles: lanes that go through all nests of a pass together.
//!
//! In: lanes at a place. Out: an array of known length, which fits in registers. Invariant: whole tiles are moved by
//! few instructions; aligned ones do not cross cache lines.

use super::super::scalar::Scalar;
use std::ops::{Deref, DerefMut};

/// Lanes in a tile: few enough for registers and the first-level cache, enough to amortise address computation, and
/// enough that the compiler makes SIMD of the loop over them, which it would write out if they were fewer.
pub const TILE: usize = 32;

/// Numbers aligned to a cache line: spilled registers are then stored and loaded without crossing lines, which would
/// take twice the time.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub struct Aligned<A>(pub A);

impl<A> Deref for Aligned<A> {
    type Target = A;

    #[inline(always)]
    fn deref(&self) -> &A {
        &self.0
    }
}

impl<A> DerefMut for Aligned<A> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut A {
        &mut self.0
    }
}

/// Lanes in registers.
pub type Tile<T> = Aligned<[T; TILE]>;

/// The largest number of values in a cache line.
pub const LINE: usize = 16;

/// The part of a buffer that begins at a cache line: all but [`LINE`] numbers.
#[inline(always)]
pub fn on_a_line<T>(room: &mut [T]) -> &mut [T] {
    let count = room.len() - LINE;
    // `align_offset` may not know the offset; then any part will do.
    let skipped = room.as_ptr().align_offset(align_of::<Aligned<()>>()).min(LINE);
    &mut room[skipped..skipped + count]
}

/// Writes the first `count` lanes of a tile at `at`.
#[inline(always)]
pub fn write_tile<T: Scalar>(lanes: &mut [T], at: usize, count: usize, tile: Tile<T>) {
    match count == TILE {
        true => lanes[at..at + TILE].copy_from_slice(&tile.0),
        false => write_part(lanes, at, count, tile),
    }
}

/// Sums of a pass's results: a sum is NaN if one of its terms is.
pub type Doubt<T> = Aligned<[T; LINE]>;

impl<T: Scalar> Default for Doubt<T> {
    #[inline(always)]
    fn default() -> Self {
        Self([T::ZERO; LINE])
    }
}

/// [`write_tile`] for results that must not be NaN: they are added to `doubt` while they are in registers.
#[inline(always)]
pub fn write_numbers<T: Scalar>(
    lanes: &mut [T],
    at: usize,
    count: usize,
    tile: Tile<T>,
    doubt: &mut Doubt<T>,
) {
    if count < TILE {
        doubt[0] = doubt[0] + sum_of_part(&tile, count);
        return write_part(lanes, at, count, tile);
    }
    for (lanes, numbers) in lanes[at..at + TILE].chunks_exact_mut(LINE).zip(tile.chunks_exact(LINE)) {
        for (sum, number) in doubt.iter_mut().zip(numbers) {
            *sum = *sum + *number;
        }
        lanes.copy_from_slice(numbers);
    }
}

#[cold]
#[inline(never)]
fn sum_of_part<T: Scalar>(tile: &Tile<T>, count: usize) -> T {
    tile[..count].iter().copied().sum()
}

/// Adds numbers to the sums.
#[inline(always)]
pub fn doubt_numbers<T: Scalar>(doubt: &mut Doubt<T>, numbers: &[T]) {
    for numbers in numbers.chunks(LINE) {
        doubt.iter_mut().zip(numbers).for_each(|(sum, number)| *sum = *sum + *number);
    }
}

// A separate function with its own copy of the tile, so that whole tiles are written directly from registers.
#[cold]
#[inline(never)]
fn write_part<T: Scalar>(lanes: &mut [T], at: usize, count: usize, tile: Tile<T>) {
    lanes[at..at + count].copy_from_slice(&tile.0[..count]);
}
