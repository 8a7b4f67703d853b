//! `normal_bins(m, s)`: a normal law on unit bins ]j − 1; j], j = 1 … N, after one label for "nothing".
//!
//! In: mean m and deviation s, in bins from the inner edge. Out: the probability of a bin, 0 being "nothing" (paper,
//! Eq. 4, made exact): Φ((j−m)/s) − Φ((j−1−m)/s), the whole lower tail for the first bin, the upper tail for "nothing".
//! Invariant: above the mean the difference is that of the upper tails, which do not cancel there; where the mean lies
//! beyond N + ½, "nothing" has probability 1.

use crate::law::Arithmetic;
use crate::operators::{Binary, Unary};

/// The probability of a bin where the mean is not beyond all bins.
pub(crate) fn within<A: Arithmetic>(
    by: &mut A,
    bin: A::Number,
    bins: A::Number,
    [mean, deviation]: [A::Number; 2],
) -> A::Number {
    let (zero, one) = (by.constant(0.0), by.constant(1.0));
    // The tail beyond an edge on the edge's side of the mean: Φ(−|z|), one Φ for each edge.
    let turned = by.unary(Unary::Negate, deviation);
    let tail = |by: &mut A, edge: A::Number| {
        let centred = by.subtract(edge, mean);
        let size = by.unary(Unary::Absolute, centred);
        let standard = by.divide(size, turned);
        by.unary(Unary::NormalCumulative, standard)
    };
    let nothing = by.binary(Binary::LessOrEqual, bin, zero);
    let first = by.binary(Binary::LessOrEqual, bin, one);
    // The upper edge of the bin, or N for "nothing"; the probability below its lower edge.
    let upper = by.select(nothing, bins, bin);
    let upper_tail = tail(by, upper);
    // Computed as the upper edge less one, so that neighbouring bins share the value.
    let lower = by.subtract(upper, one);
    let lower_tail = tail(by, lower);
    // The side of the mean on which an edge lies needs no division. At the mean both sides are equal.
    let centred = by.subtract(upper, mean);
    let upper_above = by.greater(centred, zero);
    let lower_above = by.greater(centred, one);
    // The probability below the upper edge; for "nothing", that above it.
    let is_rest = by.binary(Binary::NotEqual, upper_above, nothing);
    let rest = by.subtract(one, upper_tail);
    let up_to = by.select(is_rest, rest, upper_tail);
    let falling = by.subtract(lower_tail, upper_tail);
    let rising = by.subtract(up_to, lower_tail);
    let within = by.select(lower_above, falling, rising);
    // "Nothing" comes before the first.
    by.select(first, up_to, within)
}

/// The probability of a bin where the mean is beyond all of them.
pub(crate) fn beyond<A: Arithmetic>(by: &mut A, bin: A::Number) -> A::Number {
    let (zero, one) = (by.constant(0.0), by.constant(1.0));
    let nothing = by.binary(Binary::LessOrEqual, bin, zero);
    by.select(nothing, one, zero)
}

/// Distance of the mean beyond the last bin from which on "nothing" has probability 1.
pub(crate) const BEYOND: f64 = 0.5;

/// Whether the mean is beyond N bins.
pub(crate) fn is_beyond<A: Arithmetic>(by: &mut A, mean: A::Number, bins: A::Number) -> A::Number {
    let beyond = by.constant(BEYOND);
    let edge = by.add(bins, beyond);
    by.binary(Binary::GreaterOrEqual, mean, edge)
}
