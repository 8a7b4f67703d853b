//! What emitted Rust calls: sharing out a plate among threads, and fetching lanes.
//!
//! In: slices. Out: pieces of slices, blocks of lanes. Invariant: pieces are disjoint and each is computed alike
//! whatever the number of threads; nothing is allocated inside a block.

use super::scalar::Scalar;
use crate::error::Error;
use rayon::prelude::*;

/// Lanes in a block of emitted code: a few dozen arrays of as many stay in the caches of one core.
pub const LANES: usize = 512;

/// Work for a thread at a time, in cells.
const CHUNK_CELLS: usize = 8192;

/// The planes of one buffer that a piece makes.
pub type Planes<'p, T> = Vec<&'p mut [T]>;

/// Runs `run(first, count, planes)` over consecutive units (rows, or lanes of the only row) of the plate.
///
/// `made` are the buffers that are made, each a number of planes of `units · unit` cells; a piece gets its part of
/// each plane, in their order.
pub fn each_piece<T: Scalar>(
    units: usize,
    unit: usize,
    made: Vec<&mut [T]>,
    run: impl Fn(usize, usize, &mut [Planes<'_, T>]) + Sync,
) {
    let per_piece = (CHUNK_CELLS / unit.max(1)).clamp(1, units.max(1));
    let buffers = made.len();
    let mut pieces: Vec<(usize, Vec<Planes<'_, T>>)> = (0..units.div_ceil(per_piece))
        .map(|piece| (piece * per_piece, (0..buffers).map(|_| Vec::new()).collect()))
        .collect();
    for (number, cells) in made.into_iter().enumerate() {
        for plane in cells.chunks_mut((units * unit).max(1)) {
            for ((_, parts), part) in pieces.iter_mut().zip(plane.chunks_mut(per_piece * unit)) {
                parts[number].push(part);
            }
        }
    }
    let run = |(first, parts): &mut (usize, Vec<Planes<'_, T>>)| {
        run(*first, per_piece.min(units - *first), parts);
    };
    match pieces.len() {
        1 => pieces.iter_mut().for_each(run),
        _ => pieces.par_iter_mut().for_each(run),
    }
}

/// `width` consecutive numbers from `start`.
#[inline(always)]
pub fn fetch<T: Scalar>(source: &[T], start: usize, width: usize) -> &[T] {
    &source[start..start + width]
}

/// The same number in all lanes.
#[inline(always)]
pub fn splat<T: Scalar>(copy: &mut [T; LANES], number: T, width: usize) -> &[T] {
    copy[..width].fill(number);
    &copy[..width]
}

/// Lanes of one row of `extent` numbers that begins at `base`, from lane `from` on, which may lie beyond its ends:
/// there it goes round, or is `outside`.
#[inline(always)]
#[allow(clippy::too_many_arguments)] // emitted code names them all; a struct would only rename them
pub fn fetch_turned<'f, T: Scalar>(
    copy: &'f mut [T; LANES],
    source: &'f [T],
    base: usize,
    from: isize,
    extent: usize,
    wraps: bool,
    width: usize,
    outside: T,
) -> &'f [T] {
    let row = &source[base..base + extent];
    if from >= 0 && from as usize + width <= extent {
        return &row[from as usize..][..width];
    }
    turned(&mut copy[..width], row, from, wraps, outside);
    &copy[..width]
}

/// Copies a row that is turned, in stretches.
#[inline(never)]
fn turned<T: Scalar>(copy: &mut [T], row: &[T], from: isize, wraps: bool, outside: T) {
    let (extent, mut at, mut rest) = (row.len() as isize, from, copy);
    while !rest.is_empty() {
        if wraps {
            at = at.rem_euclid(extent);
        }
        let inside = (0..extent).contains(&at);
        let until = match (inside, at < 0) {
            (true, _) => extent,
            (false, true) => 0,
            (false, false) => isize::MAX,
        };
        let count = rest.len().min((until - at) as usize);
        let (stretch, after) = rest.split_at_mut(count);
        match inside {
            true => stretch.copy_from_slice(&row[at as usize..][..count]),
            false => stretch.fill(outside),
        }
        (rest, at) = (after, at + count as isize);
    }
}

/// Checks the length of an input.
///
/// # Errors
/// It is another than expected.
pub fn check_length(name: &str, found: usize, expected: usize) -> Result<(), Error> {
    match found == expected {
        true => Ok(()),
        false => Err(Error::input(name, format!("{found} numbers were given, but {expected} are expected"))),
    }
}

/// Checks the length of an input that may also be given once for the whole plate.
///
/// # Errors
/// It is another than the two that are possible.
pub fn check_broadcast(name: &str, found: usize, whole: usize, once: usize) -> Result<(), Error> {
    match found == whole || found == once {
        true => Ok(()),
        false => {
            let message =
                format!("{found} numbers were given, but {whole} (or {once}, for all alike) are expected");
            Err(Error::input(name, message))
        }
    }
}

/// A position along an axis, gone round where its ends meet.
#[inline(always)]
pub fn turn(at: isize, extent: usize, wraps: bool) -> isize {
    if wraps { at.rem_euclid(extent as isize) } else { at }
}
