//! The number types of a tree: f64, and f64 with separate exponents where plain f64 may underflow.
//!
//! In: cells. Out: powers of two taken out of them; whether a product may underflow. Invariant: scaling by a power of
//! two is exact.

use super::compile::Tree;
use crate::exec::scalar::{Extended, Scalar};

/// A number type in which a tree computes.
pub(super) trait Cell: Scalar {
    /// Whether a product of two nonzero numbers may be zero.
    const MAY_LOSE: bool;

    /// The tables of a tree.
    fn tables(tree: &Tree) -> &[Self];

    /// Takes a power of two out of very small or very large cells; `None` if all are zero.
    fn rescale(cells: &mut [Self]) -> Option<i64>;

    /// The number with its exponent kept separately.
    fn extended(self) -> Extended;

    /// Whether a product of two tables may have a nonzero cell that this type rounds to zero.
    fn may_lose(one: &[Self], other: &[Self]) -> bool;
}

impl Cell for f64 {
    const MAY_LOSE: bool = true;

    fn tables(tree: &Tree) -> &[f64] {
        &tree.tables.values
    }

    fn rescale(cells: &mut [f64]) -> Option<i64> {
        const SMALL: f64 = 1e-90;
        const LARGE: f64 = 1e90;
        let largest = cells.iter().copied().fold(0.0, f64::max);
        match (SMALL..LARGE).contains(&largest) {
            true => Some(0),
            false => scale_by(cells, largest),
        }
    }

    fn extended(self) -> Extended {
        Extended::from_f64(self)
    }

    fn may_lose(one: &[f64], other: &[f64]) -> bool {
        let least = |cells: &[f64]| {
            cells.iter().fold(f64::INFINITY, |least, cell| if *cell > 0.0 { least.min(*cell) } else { least })
        };
        least(one) * least(other) < f64::MIN_POSITIVE
    }
}

impl Cell for Extended {
    const MAY_LOSE: bool = false;

    fn tables(tree: &Tree) -> &[Extended] {
        tree.extended
            .get_or_init(|| tree.tables.values.iter().map(|cell| Extended::from_f64(*cell)).collect())
    }

    fn rescale(cells: &mut [Extended]) -> Option<i64> {
        cells.iter().any(|cell| *cell > Extended::ZERO).then_some(0)
    }

    fn extended(self) -> Extended {
        self
    }

    fn may_lose(_: &[Extended], _: &[Extended]) -> bool {
        false
    }
}

/// Takes a power of two out of cells of which the largest is below 1. Returns it; 0 if all cells are zero.
pub(super) fn normalise(cells: &mut [f64]) -> i64 {
    let largest = cells.iter().copied().fold(0.0, f64::max);
    match largest < 1.0 {
        true => scale_by(cells, largest).unwrap_or(0),
        false => 0,
    }
}

fn scale_by(cells: &mut [f64], largest: f64) -> Option<i64> {
    if largest <= 0.0 {
        return None;
    }
    // Clamped to the range in which the power of two is a normal number.
    let exponent = largest.log2().floor().clamp(-1000.0, 1000.0) as i32;
    let factor = 2f64.powi(-exponent);
    cells.iter_mut().for_each(|cell| *cell *= factor);
    Some(exponent.into())
}
