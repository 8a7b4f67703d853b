//! Diagnostics of a question: impossible contexts and invalid numbers.
//!
//! In: results as they are computed. Out: the number of suspect ones. Invariant: cells are checked while they are in
//! registers or the first-level cache; nothing is read or computed again unless one of them is suspect.

use super::super::Outputs;
use super::super::scalar::Scalar;
use super::tile::{Aligned, Doubt, TILE, Tile};
use crate::kernel::OutputKey;
use std::ops::Range;

/// The report of a question beside its answer.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Report {
    /// The number of contexts of probability zero, whose answers are zeros. A context is an element of the plate
    /// together with a value of each known variable without a given value.
    pub impossible: usize,
}

/// A marker for compiled questions, which no type implements: the method of a question that cannot be compiled requires
/// it, so that its callers get a compile-time error.
#[diagnostic::on_unimplemented(
    message = "this question is not compiled",
    label = "the documentation of its function gives the reason",
    note = "`bp_core::compiler::answer::ask` asks it of the program's `model()` at run time"
)]
pub trait Compiled {}

/// The number if it is one that its form can have, else NaN. Computations from the number do not wait for the
/// condition, which a selection of one of two values would do.
#[inline(always)]
pub fn only_if(holds: bool, number: f64) -> f64 {
    // A call that the compiler does not look through remains a branch.
    #[cold]
    #[inline(never)]
    fn refused() -> f64 {
        std::hint::black_box(f64::NAN)
    }
    if holds { number } else { refused() }
}

/// The number of totals that are not above the least safe one, or not finite.
#[inline(always)]
pub fn suspect_totals<T: Scalar>(totals: &[T], least: T) -> usize {
    totals.iter().filter(|total| is_suspect(**total, least)).count()
}

/// The number of NaNs.
#[inline(always)]
pub fn suspect_numbers<T: Scalar>(numbers: &[T]) -> usize {
    numbers.iter().filter(|number| is_nan(**number)).count()
}

/// The numbers of suspect totals in the tiles of a pass, lane by lane: a sum over lanes for each tile would take longer than
/// the rest of a small one.
pub type Suspects = Aligned<[u32; TILE]>;

impl Default for Suspects {
    #[inline(always)]
    fn default() -> Self {
        Self([0; TILE])
    }
}

/// Counts the suspect totals of a tile, from `from` to `count`.
#[inline(always)]
pub fn suspect_tile<T: Scalar>(found: &mut Suspects, tile: &Tile<T>, from: usize, count: usize, least: T) {
    if from > 0 || count < TILE {
        return suspect_part(found, *tile, from..count, least);
    }
    for (found, lane) in found.iter_mut().zip(tile.iter()) {
        *found += u32::from(is_suspect(*lane, least));
    }
}

#[cold]
#[inline(never)]
fn suspect_part<T: Scalar>(found: &mut Suspects, tile: Tile<T>, lanes: Range<usize>, least: T) {
    found[0] += tile[lanes].iter().filter(|lane| is_suspect(**lane, least)).count() as u32;
}

/// Their number.
#[inline(always)]
pub fn suspects_of(found: &Suspects) -> usize {
    found.iter().map(|count| *count as usize).sum()
}

/// The number of NaNs in these planes; they are searched only if the sum in `doubt` is NaN.
#[inline(always)]
pub fn suspect_planes<T: Scalar>(doubt: &Doubt<T>, planes: &[&mut [T]]) -> usize {
    #[cold]
    #[inline(never)]
    fn counted<T: Scalar>(planes: &[&mut [T]]) -> usize {
        planes.iter().map(|plane| suspect_numbers(plane)).sum()
    }
    if doubt.iter().any(|sum| is_nan(*sum)) { counted(planes) } else { 0 }
}

/// Written so that NaN, which compares as false, is suspect.
#[inline(always)]
fn is_suspect<T: Scalar>(total: T, least: T) -> bool {
    !((total > least) & total.is_below_infinity())
}

#[inline(always)]
fn is_nan<T: Scalar>(number: T) -> bool {
    number.partial_cmp(&number).is_none()
}

/// Whether one of these arrays contains NaN.
pub fn has_nan<T: Scalar>(outputs: &[&[T]]) -> bool {
    outputs.iter().any(|cells| cells.iter().any(|cell| is_nan(*cell)))
}

/// Replaces NaN by 0, the value of every cell of an impossible element.
pub fn without_nan<T: Scalar>(cells: &mut [T]) {
    cells.iter_mut().filter(|cell| is_nan(**cell)).for_each(|cell| *cell = T::ZERO);
}

/// Replaces an output by its recomputed values.
pub fn put<T: Scalar>(found: &Outputs<f64>, key: OutputKey, cells: &mut [T]) {
    for (cell, found) in cells.iter_mut().zip(found.get(key)) {
        *cell = T::from_f64(*found);
    }
}

#[cfg(test)]
mod tests {
    use super::super::tile::{doubt_numbers, write_numbers};
    use super::*;

    #[test]
    fn a_number_that_its_form_cannot_have_is_nan() {
        assert_eq!(only_if(true, 0.5), 0.5);
        assert!(only_if(false, 1.5).is_nan());
    }

    #[test]
    fn suspects_are_counted_once() {
        let mut lanes = [1f32; TILE];
        (lanes[0], lanes[3], lanes[5], lanes[TILE - 1]) = (0.0, f32::NAN, f32::INFINITY, -1.0);
        let tile = Aligned(lanes);
        let mut found = Suspects::default();
        for (from, count, suspects) in [(0, TILE, 4), (1, TILE, 4 + 3), (0, 3, 4 + 3 + 1)] {
            suspect_tile(&mut found, &tile, from, count, 0.0);
            assert_eq!(suspects_of(&found), suspects);
        }
        assert_eq!((suspect_totals(&lanes, 0.0), suspect_totals(&lanes, 1.0)), (4, TILE));
        assert_eq!(suspect_numbers(&lanes), 1);
        assert!(has_nan(&[&lanes[..3], &lanes[3..4]]) && !has_nan(&[&lanes[..3]]));
    }

    #[test]
    fn suspect_numbers_are_counted() {
        for (count, wrong, found) in [(TILE, TILE - 1, 1), (TILE, TILE, 0), (20, 19, 1), (20, 20, 0)] {
            let mut tile = Aligned([1f32; TILE]);
            tile.iter_mut().skip(wrong).for_each(|lane| *lane = f32::NAN);
            let (mut doubt, mut plane) = (Doubt::default(), vec![2f32; TILE + 3]);
            write_numbers(&mut plane, 3, count, tile, &mut doubt);
            let kept = plane[..3].iter().chain(&plane[3 + count..]);
            assert!(kept.into_iter().all(|number| *number == 2.0) && plane[3] == 1.0);
            assert_eq!(suspect_planes(&doubt, &[&mut plane[..]]), found, "{wrong} of {count}");
        }
        // Infinities are not NaN, though their sum may be.
        let mut doubt = Doubt::default();
        doubt_numbers(&mut doubt, &[f64::INFINITY; 40]);
        doubt_numbers(&mut doubt, &[f64::NEG_INFINITY]);
        assert_eq!(suspect_planes(&doubt, &[&mut [f64::INFINITY, f64::NEG_INFINITY][..]]), 0);
        doubt_numbers(&mut doubt, &[0.0, f64::NAN]);
        assert_eq!(suspect_planes(&doubt, &[&mut [0.0, f64::NAN][..], &mut [f64::NAN; 2][..]]), 3);
    }
}
