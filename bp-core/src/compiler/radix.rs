//! Positions in a table over several finite variables, the last one fastest: numbers of mixed radix.
//!
//! In: the number of values of each variable, and the ordinals of their values or a position. Out: the other.
//! Invariant: all conversions between positions and ordinals are here.

/// The position of (ordinal, count) pairs, the first variable slowest.
#[inline]
pub(crate) fn position(digits: impl IntoIterator<Item = (usize, usize)>) -> usize {
    digits.into_iter().fold(0, |position, (ordinal, count)| position * count + ordinal)
}

/// The ordinals at a position. Counts and ordinals are in the order from the last variable, which is the fastest, to
/// the first.
#[inline]
pub(crate) fn ordinals(
    mut position: usize,
    counts: impl IntoIterator<Item = usize>,
) -> impl Iterator<Item = usize> {
    counts.into_iter().map(move |count| {
        let ordinal = position % count;
        position /= count;
        ordinal
    })
}

/// The ordinals at a position, the first variable first.
pub(crate) fn in_order(position: usize, counts: impl DoubleEndedIterator<Item = usize>) -> Vec<usize> {
    let mut all: Vec<usize> = ordinals(position, counts.rev()).collect();
    all.reverse();
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A table of 2, 3 and 4 values, against three nested loops.
    #[test]
    fn positions_are_those_of_loops() {
        let mut expected = 0;
        for first in 0..2 {
            for second in 0..3 {
                for third in 0..4 {
                    assert_eq!(position([(first, 2), (second, 3), (third, 4)]), expected);
                    let found: Vec<usize> = ordinals(expected, [4, 3, 2]).collect();
                    assert_eq!(found, [third, second, first]);
                    assert_eq!(in_order(expected, [2, 3, 4].into_iter()), [first, second, third]);
                    expected += 1;
                }
            }
        }
    }
}
