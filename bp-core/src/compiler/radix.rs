//! Positions in a table over several finite variables, the last one fastest: numbers of mixed radix.
//!
//! In: the number of values of each variable, and the ordinals of their values or a position. Out: the other.
//! Invariant: all conversions between positions and ordinals are here.

/// The position of (ordinal, count) pairs, the first variable slowest.
#[inline]
pub(crate) fn position(digits: impl IntoIterator<Item = (usize, usize)>) -> usize {
    digits.into_iter().fold(0, |position, (ordinal, count)| position * count + ordinal)
}

/// The same, where an ordinal may lie outside: then there is no position.
#[inline]
pub(crate) fn position_inside(digits: impl IntoIterator<Item = Option<(usize, usize)>>) -> Option<usize> {
    digits.into_iter().try_fold(0, |position, digit| digit.map(|(ordinal, count)| position * count + ordinal))
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

/// The strides of the axes of a table, of which the last is contiguous.
pub(crate) fn strides(lengths: &[usize]) -> Vec<usize> {
    let mut strides = vec![1; lengths.len()];
    for axis in (1..lengths.len()).rev() {
        strides[axis - 1] = strides[axis] * lengths[axis];
    }
    strides
}

/// The stride of an axis in a table over some axes, of which the last is contiguous; 0 if the table does not have it.
pub(crate) fn stride<T: PartialEq>(axes: &[T], axis: &T, count: impl Fn(&T) -> usize) -> usize {
    match axes.iter().position(|own| own == axis) {
        Some(place) => axes[place + 1..].iter().map(count).product(),
        None => 0,
    }
}

/// Writes the ordinals at a position of a table over some slots to the values of these slots, the last slot fastest.
pub(crate) fn assign(position: usize, slots: &[usize], count: impl Fn(usize) -> usize, values: &mut [f64]) {
    let counts = slots.iter().rev().map(|slot| count(*slot));
    for (slot, ordinal) in slots.iter().rev().zip(ordinals(position, counts)) {
        values[*slot] = ordinal as f64;
    }
}

/// The offset of each cell of a table in an array, for axes with these lengths and strides in the array, the last axis
/// fastest. An axis that the array does not have has the stride 0.
pub(crate) fn offsets(axes: Vec<(usize, usize)>) -> impl Iterator<Item = usize> {
    let cells = axes.iter().map(|(length, _)| *length).product();
    let (mut ordinals, mut next) = (vec![0; axes.len()], 0);
    (0..cells).map(move |_| {
        let offset = next;
        for (ordinal, (length, stride)) in ordinals.iter_mut().zip(&axes).rev() {
            *ordinal += 1;
            next += stride;
            if *ordinal < *length {
                break;
            }
            next -= stride * *ordinal;
            *ordinal = 0;
        }
        offset
    })
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
                    let inside = [Some((first, 2)), Some((second, 3)), Some((third, 4))];
                    assert_eq!(position_inside(inside), Some(expected));
                    let found: Vec<usize> = ordinals(expected, [4, 3, 2]).collect();
                    assert_eq!(found, [third, second, first]);
                    assert_eq!(in_order(expected, [2, 3, 4].into_iter()), [first, second, third]);
                    let mut values = [0.5; 5];
                    assign(expected, &[4, 0, 2], |slot| [3, 0, 4, 0, 2][slot], &mut values);
                    assert_eq!(values, [second as f64, 0.5, third as f64, 0.5, first as f64]);
                    expected += 1;
                }
            }
        }
        assert_eq!(position_inside([Some((1, 2)), None]), None);
    }

    /// A table of 2, 3 and 4 values read in another order of its axes, with an axis that it does not have.
    #[test]
    fn offsets_are_those_of_loops() {
        let [first, second, third] = [0, 1, 2].map(|axis| strides(&[2, 3, 4])[axis]);
        assert_eq!([first, second, third], [12, 4, 1]);
        let by_name = ["a", "b", "c", "d"].map(|axis| {
            stride(&["a", "b", "c"], &axis, |own| [2, 3, 4][usize::from(own.as_bytes()[0] - b'a')])
        });
        assert_eq!(by_name, [12, 4, 1, 0]);
        let mut expected = Vec::new();
        for c in 0..4 {
            for a in 0..2 {
                for _ in 0..5 {
                    expected.extend((0..3).map(|b| 12 * a + 4 * b + c));
                }
            }
        }
        let found: Vec<usize> = offsets(vec![(4, third), (2, first), (5, 0), (3, second)]).collect();
        assert_eq!(found, expected);
        assert_eq!(offsets(Vec::new()).collect::<Vec<_>>(), [0]);
        assert_eq!(offsets(vec![(2, 1), (0, 1)]).count(), 0);
    }
}
