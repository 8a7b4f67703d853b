//! The runtime of emitted Rust: division of a plate among threads, and reads of lanes.
//!
//! In: slices. Out: pieces of slices, blocks of lanes. Invariant: pieces are disjoint and computed in the same way for
//! any number of threads; nothing is allocated inside a block.

mod best;
mod door;
mod place;
mod report;
mod step;
mod tile;

pub use super::values::{Domain, Numbers};
pub use best::{Distributions, least_tied};
pub use door::{Value, bin, cell, cells, needed, place, whole};
pub use place::{Place, fetch, fetch_turned, fill, read_tile, row_at, splat, tile_of};
pub use report::{
    Compiled, Report, Suspects, has_nan, only_if, put, suspect_numbers, suspect_planes, suspect_tile,
    suspect_totals, suspects_of, without_nan,
};
pub use step::{add_up, covariances, largest, means, number};
pub use tile::{Aligned, Doubt, LINE, TILE, Tile, doubt_numbers, on_a_line, write_numbers, write_tile};

pub use crate::kernel::OutputKey;
pub use crate::operators::Unary;

use super::inputs::MOST_CELLS;
use super::scalar::Scalar;
use crate::error::Error;
use pulp::NullaryFnOnce;
use rayon::prelude::*;

/// Lanes in a block of emitted code: a few dozen arrays of this length stay in the caches of one core.
pub const LANES: usize = 512;

/// Pieces for each thread, where there are several: with small pieces no thread finishes much later than the others.
const PIECES: usize = 8;

/// The least work of a piece, in cells.
const LEAST_CELLS: usize = 2048;

/// The planes of one result buffer in a piece.
pub type Planes<'p, T> = Vec<&'p mut [T]>;

/// One pass of emitted code over a plate.
pub trait Pass<T>: Sync {
    /// Computes `count` consecutive units (rows, or lanes of the only row) from `first` on; `planes` are their parts of
    /// the result buffers. Always inlined, so that [`each_piece`] compiles it for each instruction set. Returns the
    /// number of suspect cells: totals that are not positive, numbers that are NaN.
    fn piece(&self, first: usize, count: usize, planes: &mut [Planes<'_, T>]) -> usize;
}

/// A call of [`Pass::piece`], compiled for each instruction set.
struct Call<'c, 'p, T, P> {
    pass: &'c P,
    first: usize,
    count: usize,
    planes: &'c mut [Planes<'p, T>],
}

impl<T, P: Pass<T>> NullaryFnOnce for Call<'_, '_, T, P> {
    type Output = usize;

    #[inline(always)]
    fn call(self) -> usize {
        self.pass.piece(self.first, self.count, self.planes)
    }
}

/// Runs a pass over consecutive pieces of the plate's units, each on one thread, with the widest SIMD instructions of
/// the processor.
///
/// `made` are the result buffers, each a number of planes of `units · unit` cells; a piece gets its part of each plane,
/// in their order. Returns the number of suspect cells.
pub fn each_piece<T: Scalar>(units: usize, unit: usize, made: Vec<&mut [T]>, pass: &impl Pass<T>) -> usize {
    let pieces = match rayon::current_num_threads() {
        1 => 1,
        threads => PIECES * threads,
    };
    let per_piece = units.div_ceil(pieces).max(LEAST_CELLS / unit.max(1)).clamp(1, units.max(1));
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
    let instructions = pulp::Arch::new();
    let run = |(first, planes): &mut (usize, Vec<Planes<'_, T>>)| {
        instructions.dispatch(Call { pass, first: *first, count: per_piece.min(units - *first), planes })
    };
    match pieces.len() {
        1 => pieces.iter_mut().map(run).sum(),
        _ => pieces.par_iter_mut().map(run).sum(),
    }
}

/// Cells of a plane that are rounded in one step: they stay in the caches of one core.
const ROUNDED_CELLS: usize = 4096;

/// A pass in f64 whose results are rounded.
struct Rounded<'p, P>(&'p P);

impl<T: Scalar, P: Pass<f64>> Pass<T> for Rounded<'_, P> {
    #[inline(always)]
    fn piece(&self, first: usize, count: usize, planes: &mut [Planes<'_, T>]) -> usize {
        let unit = planes.iter().flatten().next().map_or(1, |plane| plane.len() / count.max(1)).max(1);
        let at_once = (ROUNDED_CELLS / unit).clamp(1, count.max(1));
        let mut exact: Vec<Vec<Vec<f64>>> =
            planes.iter().map(|planes| vec![vec![0.0; at_once * unit]; planes.len()]).collect();
        let mut suspects = 0;
        for begin in (0..count).step_by(at_once) {
            let (units, cells) = (at_once.min(count - begin), at_once.min(count - begin) * unit);
            let mut made: Vec<Planes<'_, f64>> = (exact.iter_mut())
                .map(|planes| planes.iter_mut().map(|plane| &mut plane[..cells]).collect())
                .collect();
            suspects += self.0.piece(first + begin, units, &mut made);
            for (plane, exact) in planes.iter_mut().flatten().zip(made.iter().flatten()) {
                for (number, exact) in plane[begin * unit..][..cells].iter_mut().zip(exact.iter()) {
                    *number = T::from_f64(*exact);
                }
            }
        }
        suspects
    }
}

/// [`each_piece`] for a pass that computes in f64, for results of any precision.
pub fn each_piece_in_f64<T: Scalar>(
    units: usize,
    unit: usize,
    made: Vec<&mut [T]>,
    pass: &impl Pass<f64>,
) -> usize {
    each_piece(units, unit, made, &Rounded(pass))
}

/// Resizes a result array.
///
/// # Errors
/// It would exceed the limit of cells, or the memory.
#[inline]
pub fn make_room<T: Scalar>(name: &str, cells: usize, made: &mut Vec<T>) -> Result<(), Error> {
    // Repeated questions keep their arrays.
    if made.len() == cells { Ok(()) } else { make_other_room(name, cells, made) }
}

#[cold]
#[inline(never)]
fn make_other_room<T: Scalar>(name: &str, cells: usize, made: &mut Vec<T>) -> Result<(), Error> {
    let more = cells.saturating_sub(made.len());
    if cells as f64 > MOST_CELLS || made.try_reserve_exact(more).is_err() {
        let help = "ask a smaller question, or a part of the plate at a time".to_owned();
        return Err(Error::TooLarge { name: name.to_owned(), cells: cells as f64, most: MOST_CELLS, help });
    }
    made.resize(cells, T::ZERO);
    Ok(())
}

/// Checks the length of an input.
///
/// # Errors
/// It differs from the expected length.
pub fn check_length(name: &str, found: usize, expected: usize) -> Result<(), Error> {
    match found == expected {
        true => Ok(()),
        false => Err(Error::input(name, format!("{found} numbers were given, but {expected} are expected"))),
    }
}

/// Checks the length of an input that may also be given once for the whole plate.
///
/// # Errors
/// It differs from both possible lengths.
pub fn check_broadcast(name: &str, found: usize, whole: usize, once: usize) -> Result<(), Error> {
    match found == whole || found == once {
        true => Ok(()),
        false => {
            let message = format!(
                "{found} numbers were given, but {whole} (or {once} for the whole plate) are expected"
            );
            Err(Error::input(name, message))
        }
    }
}

/// A position along an axis, wrapped if the axis is periodic.
#[inline(always)]
pub fn turn(at: isize, extent: usize, wraps: bool) -> isize {
    if wraps { at.rem_euclid(extent as isize) } else { at }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_that_do_not_fit_are_refused_by_name() {
        let mut made: Vec<f32> = Vec::new();
        make_room("P(X)", 3, &mut made).unwrap();
        assert_eq!(made, [0.0; 3]);
        let message = make_room("P(X)", 2_000_000_000, &mut made).unwrap_err().to_string();
        assert!(message.contains("`P(X)`"), "{message}");
        assert_eq!(made.len(), 3, "nothing is half made");
    }
}
