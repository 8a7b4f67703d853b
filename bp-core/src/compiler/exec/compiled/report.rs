//! What a question reports besides its answer: contexts that cannot be, numbers that are invalid.
//!
//! In: cells as they are made. Out: how many are suspect. Invariant: cells are looked at while they are in registers or the
//! first cache; nothing is read or computed again unless one of them is suspect.

use super::super::Outputs;
use super::super::scalar::Scalar;
use super::tile::{Doubt, TILE, Tile};
use crate::kernel::OutputKey;

/// What a question reports besides its answer.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Report {
    /// How many contexts have probability zero: their answers are zeros. A context is an element of the plate, with a value
    /// of each known variable that was given none.
    pub impossible: usize,
}

/// A question that is compiled. No type is: the method of a question that cannot be compiled demands it, so
/// that the compiler refuses whoever asks it.
#[diagnostic::on_unimplemented(
    message = "this question is not compiled",
    label = "the documentation of its function gives the reason",
    note = "`bp_core::compiler::answer::ask` asks it of the program's `model()` at run time"
)]
pub trait Compiled {}

/// How many of these totals are not above the least one that is safe, or not finite.
#[inline(always)]
pub fn suspect_totals<T: Scalar>(totals: &[T], least: T) -> usize {
    totals.iter().filter(|total| is_suspect(**total, least)).count()
}

/// How many of these numbers are NaN.
#[inline(always)]
pub fn suspect_numbers<T: Scalar>(numbers: &[T]) -> usize {
    numbers.iter().filter(|number| is_nan(**number)).count()
}

/// How many lanes of a tile of totals are suspect, from `from` to `count`.
#[inline(always)]
pub fn suspect_tile<T: Scalar>(tile: &Tile<T>, from: usize, count: usize, least: T) -> usize {
    let lanes = if from == 0 && count == TILE { &tile[..] } else { &tile[from..count] };
    lanes.iter().fold(0u32, |suspects, lane| suspects + u32::from(is_suspect(*lane, least))) as usize
}

/// How many numbers of these planes are NaN: none unless their doubt is, so that they are rarely looked at.
#[inline(always)]
pub fn suspect_planes<T: Scalar>(doubt: &Doubt<T>, planes: &[&mut [T]]) -> usize {
    #[cold]
    #[inline(never)]
    fn counted<T: Scalar>(planes: &[&mut [T]]) -> usize {
        planes.iter().map(|plane| suspect_numbers(plane)).sum()
    }
    if doubt.iter().any(|sum| is_nan(*sum)) { counted(planes) } else { 0 }
}

/// NaN is above nothing.
#[inline(always)]
fn is_suspect<T: Scalar>(total: T, least: T) -> bool {
    !((total > least) & total.is_below_infinity())
}

#[inline(always)]
fn is_nan<T: Scalar>(number: T) -> bool {
    number.partial_cmp(&number).is_none()
}

/// Whether one of these arrays holds NaN.
pub fn has_nan<T: Scalar>(outputs: &[&[T]]) -> bool {
    outputs.iter().any(|cells| cells.iter().any(|cell| is_nan(*cell)))
}

/// Makes NaN 0, as every cell of an impossible element is.
pub fn without_nan<T: Scalar>(cells: &mut [T]) {
    cells.iter_mut().filter(|cell| is_nan(**cell)).for_each(|cell| *cell = T::ZERO);
}

/// Puts an output that was computed again in its place.
pub fn put<T: Scalar>(found: &Outputs<f64>, key: OutputKey, cells: &mut [T]) {
    for (cell, found) in cells.iter_mut().zip(found.get(key)) {
        *cell = T::from_f64(*found);
    }
}

#[cfg(test)]
mod tests {
    use super::super::tile::{Aligned, doubt_numbers, write_numbers};
    use super::*;

    #[test]
    fn suspects_are_counted_once() {
        let mut lanes = [1f32; TILE];
        (lanes[0], lanes[3], lanes[5], lanes[63]) = (0.0, f32::NAN, f32::INFINITY, -1.0);
        let tile = Aligned(lanes);
        assert_eq!(suspect_tile(&tile, 0, TILE, 0.0), 4);
        assert_eq!((suspect_tile(&tile, 1, TILE, 0.0), suspect_tile(&tile, 0, 3, 0.0)), (3, 1));
        assert_eq!((suspect_totals(&lanes, 0.0), suspect_totals(&lanes, 1.0)), (4, TILE));
        assert_eq!(suspect_numbers(&lanes), 1);
        assert!(has_nan(&[&lanes[..3], &lanes[3..4]]) && !has_nan(&[&lanes[..3]]));
    }

    #[test]
    fn what_is_in_doubt_is_counted() {
        for (count, wrong, found) in [(TILE, 63, 1), (TILE, TILE, 0), (40, 39, 1), (40, 40, 0)] {
            let mut tile = Aligned([1f32; TILE]);
            tile.iter_mut().skip(wrong).for_each(|lane| *lane = f32::NAN);
            let (mut doubt, mut plane) = (Doubt::default(), vec![2f32; TILE + 3]);
            write_numbers(&mut plane, 3, count, tile, &mut doubt);
            let kept = plane[..3].iter().chain(&plane[3 + count..]);
            assert!(kept.into_iter().all(|number| *number == 2.0) && plane[3] == 1.0);
            assert_eq!(suspect_planes(&doubt, &[&mut plane[..]]), found, "{wrong} of {count}");
        }
        // Infinities are no NaN, though their sum may be.
        let mut doubt = Doubt::default();
        doubt_numbers(&mut doubt, &[f64::INFINITY; 40]);
        doubt_numbers(&mut doubt, &[f64::NEG_INFINITY]);
        assert_eq!(suspect_planes(&doubt, &[&mut [f64::INFINITY, f64::NEG_INFINITY][..]]), 0);
        doubt_numbers(&mut doubt, &[0.0, f64::NAN]);
        assert_eq!(suspect_planes(&doubt, &[&mut [0.0, f64::NAN][..], &mut [f64::NAN; 2][..]]), 3);
    }
}
