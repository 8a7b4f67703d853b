//! What emitted Rust calls: sharing out a plate among threads, and fetching lanes.
//!
//! In: slices. Out: pieces of slices, blocks of lanes. Invariant: pieces are disjoint and each is computed alike
//! whatever the number of threads; nothing is allocated inside a block.

use super::scalar::Scalar;
use crate::error::Error;
use rayon::prelude::*;

/// Lanes in a block of emitted code.
pub const LANES: usize = 64;

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

/// `LANES` consecutive numbers from `start`: those of `source` itself where there are as many, else the `width`
/// that there are, copied.
#[inline(always)]
pub fn fetch<'f, T: Scalar>(
    copy: &'f mut [T; LANES],
    source: &'f [T],
    start: usize,
    width: usize,
) -> &'f [T; LANES] {
    if let Some(lanes) = source.get(start..).and_then(<[T]>::first_chunk::<LANES>) {
        return lanes;
    }
    copy[..width].copy_from_slice(&source[start..start + width]);
    copy
}

/// The same number in all lanes.
#[inline(always)]
pub fn splat<T: Scalar>(copy: &mut [T; LANES], number: T) -> &[T; LANES] {
    copy.fill(number);
    copy
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
) -> &'f [T; LANES] {
    if from >= 0 && from as usize + LANES <= extent {
        return fetch(copy, source, base + from as usize, width);
    }
    turned_slowly(copy, &source[base..base + extent], from, wraps, width, outside);
    copy
}

#[inline(never)]
fn turned_slowly<T: Scalar>(
    copy: &mut [T; LANES],
    row: &[T],
    start: isize,
    wraps: bool,
    width: usize,
    outside: T,
) {
    for (lane, copy) in copy[..width].iter_mut().enumerate() {
        let at = start + lane as isize;
        let at = if wraps { at.rem_euclid(row.len() as isize) } else { at };
        *copy = usize::try_from(at).ok().and_then(|at| row.get(at)).copied().unwrap_or(outside);
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
