//! What a question reports besides its answer: contexts that cannot be, numbers that are invalid.
//!
//! In: cells as they are made. Out: how many are suspect; at the end a [`Report`], or an error. Invariant: cells are looked at
//! while they are in registers or the first cache; nothing else is read again unless one of them is suspect.

use super::super::scalar::Scalar;
use super::tile::{TILE, Tile};
use crate::error::{Error, Impossible};

/// What a question reports besides its answer.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Report {
    /// How many contexts have probability zero: their answers are zeros. A context is an element of the plate, with a value
    /// of each known variable that was given none.
    pub impossible: usize,
}

/// The inputs of a question that is compiled. No type is: the module of a question that cannot be compiled demands it, so
/// that the compiler refuses whoever asks it.
#[diagnostic::on_unimplemented(
    message = "this question is not compiled",
    label = "the documentation of its module says why",
    note = "`bp_core::answer::ask` asks it of the program's `model()` at run time"
)]
pub trait Compiled {}

/// How many of these totals are not above 0.
#[inline(always)]
pub fn suspect_totals<T: Scalar>(totals: &[T]) -> usize {
    // NaN is not above 0 either.
    totals.iter().filter(|total| !is_above_zero(**total)).count()
}

/// How many of these numbers are NaN.
#[inline(always)]
pub fn suspect_numbers<T: Scalar>(numbers: &[T]) -> usize {
    numbers.iter().filter(|number| is_nan(**number)).count()
}

/// How many lanes of a tile are suspect, from `from` to `count`: totals, or numbers.
#[inline(always)]
pub fn suspect_tile<T: Scalar>(tile: &Tile<T>, from: usize, count: usize, totals: bool) -> usize {
    let lanes = if from == 0 && count == TILE { &tile[..] } else { &tile[from..count] };
    let mut suspects = 0u32;
    for lane in lanes {
        suspects += u32::from(if totals { !is_above_zero(*lane) } else { is_nan(*lane) });
    }
    suspects as usize
}

#[inline(always)]
fn is_above_zero<T: Scalar>(number: T) -> bool {
    number > T::ZERO
}

#[inline(always)]
fn is_nan<T: Scalar>(number: T) -> bool {
    number.partial_cmp(&number).is_none()
}

/// The end of a question: `suspects` cells were suspect. Where there is no plate, `contexts` says how many contexts there are.
///
/// # Errors
/// An output that is NaN: `invalid` names the number from which it came. No plate, and no context that is possible.
#[inline]
pub fn concluded<T: Scalar>(
    question: &str,
    suspects: usize,
    contexts: Option<usize>,
    outputs: &[(&str, &[T])],
    invalid: impl FnOnce(&str) -> Error,
) -> Result<Report, Error> {
    if suspects == 0 {
        return Ok(Report::default());
    }
    if let Some((name, _)) = outputs.iter().find(|(_, cells)| cells.iter().any(|cell| is_nan(*cell))) {
        return Err(invalid(name));
    }
    match contexts == Some(suspects) {
        true => Err(Error::Impossible(Impossible { question: question.to_owned(), reason: None })),
        false => Ok(Report { impossible: suspects }),
    }
}

/// The error of an output that is NaN, where nothing more is known.
pub fn not_a_number(output: &str) -> Error {
    Error::input(output, "its answer is not a number: a divisor or a standard deviation may be 0")
}

#[cfg(test)]
mod tests {
    use super::super::tile::Aligned;
    use super::*;

    #[test]
    fn suspects_are_counted_once() {
        let mut lanes = [1f32; TILE];
        (lanes[0], lanes[3], lanes[63]) = (0.0, f32::NAN, -1.0);
        let tile = Aligned(lanes);
        assert_eq!(suspect_tile(&tile, 0, TILE, true), 3);
        assert_eq!((suspect_tile(&tile, 1, TILE, true), suspect_tile(&tile, 0, 3, true)), (2, 1));
        assert_eq!(suspect_tile(&tile, 0, TILE, false), 1);
        assert_eq!((suspect_totals(&lanes), suspect_numbers(&lanes)), (3, 1));
    }

    #[test]
    fn a_report_tells_zeros_from_invalid_numbers() {
        let report = |suspects, contexts, cells: &[f64]| {
            concluded("P(X)", suspects, contexts, &[("P(X)", cells)], not_a_number)
        };
        assert_eq!(report(0, Some(1), &[f64::NAN]).unwrap(), Report::default());
        assert_eq!(report(2, None, &[0.0, 1.0]).unwrap(), Report { impossible: 2 });
        assert_eq!(report(2, Some(3), &[0.0, 1.0]).unwrap(), Report { impossible: 2 });
        assert!(matches!(report(1, Some(1), &[0.0]), Err(Error::Impossible(_))));
        assert!(matches!(report(1, None, &[0.0, f64::NAN]), Err(Error::Input { .. })));
    }
}
