//! Tiles: lanes that go through all nests of a pass at once.
//!
//! In: lanes that stand at a place. Out: an array of known length, which lives in registers. Invariant: whole tiles are
//! moved by few instructions, of which none crosses the lines of the cache for what is only put aside.

use super::super::scalar::Scalar;
use std::ops::{Deref, DerefMut};

/// Lanes in a tile: few enough for registers and the first cache, enough to pay for finding them.
pub const TILE: usize = 64;

/// Numbers that begin with a line of the cache: what registers cannot hold is put aside and read again without crossing
/// from line to line, which takes twice the time.
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

/// The lanes that registers hold.
pub type Tile<T> = Aligned<[T; TILE]>;

/// Numbers in a line of the cache, at most.
pub const LINE: usize = 16;

/// The part of some room that begins with a line of the cache: all but [`LINE`] numbers.
#[inline(always)]
pub fn on_a_line<T>(room: &mut [T]) -> &mut [T] {
    let count = room.len() - LINE;
    // Where that cannot be told, any part will do.
    let skipped = room.as_ptr().align_offset(align_of::<Aligned<()>>()).min(LINE);
    &mut room[skipped..skipped + count]
}

/// Puts `count` lanes of a tile where they belong, from `at` on.
#[inline(always)]
pub fn write_tile<T: Scalar>(lanes: &mut [T], at: usize, count: usize, tile: Tile<T>) {
    match count == TILE {
        true => lanes[at..at + TILE].copy_from_slice(&tile.0),
        false => write_part(lanes, at, count, tile),
    }
}

/// Sums of the numbers that a pass makes: one of them is NaN where one of the numbers is.
pub type Doubt<T> = Aligned<[T; LINE]>;

impl<T: Scalar> Default for Doubt<T> {
    #[inline(always)]
    fn default() -> Self {
        Self([T::ZERO; LINE])
    }
}

/// [`write_tile`] of numbers none of which may be NaN: they are added up while registers hold them.
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

// Apart, and of a tile of its own, so that whole tiles go from registers to where they belong.
#[cold]
#[inline(never)]
fn write_part<T: Scalar>(lanes: &mut [T], at: usize, count: usize, tile: Tile<T>) {
    lanes[at..at + count].copy_from_slice(&tile.0[..count]);
}
