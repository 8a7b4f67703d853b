//! The equations of the forms, each written once, over an [`Arithmetic`].
//!
//! In: the numbers of a form and a value of its left-hand variable: as numbers, with separate exponents, or as nodes of
//! a kernel. Out: a probability, a density, or whether the numbers are valid for the form. Invariant: engines only loop
//! over values and look up entries; all equations are here, and those of the laws in `law/`.

pub(crate) mod bernoulli;
pub(crate) mod dirac;
pub(crate) mod law;
pub(crate) mod mixture;
pub(crate) mod normal_bins;
pub(crate) mod row;
pub(crate) mod surely;
pub(crate) mod truncated;
pub(crate) mod uniform;
pub(crate) mod weights;

use crate::law::Arithmetic;
use crate::operators::Binary;

/// Whether low ≤ x ≤ high.
pub(crate) fn between<A: Arithmetic>(by: &mut A, x: A::Number, low: A::Number, high: A::Number) -> A::Number {
    let above = by.binary(Binary::GreaterOrEqual, x, low);
    let below = by.binary(Binary::LessOrEqual, x, high);
    by.binary(Binary::And, above, below)
}

/// `part / total`; 0 where the total is 0.
pub(crate) fn share<A: Arithmetic>(by: &mut A, part: A::Number, total: A::Number) -> A::Number {
    let zero = by.constant(0.0);
    let nothing = by.binary(Binary::Equal, total, zero);
    let share = by.divide(part, total);
    by.select(nothing, zero, share)
}
