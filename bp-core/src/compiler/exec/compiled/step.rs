//! The runtime of emitted filters: sums over instants, and the moments of a normal law.
//!
//! In: the numbers of an instant. Out: totals, moments. Invariant: a law is its means, then its covariances, row by row up to the
//! diagonal; over a plate each of them is the numbers of all elements.

use crate::exec::scalar::Scalar;

/// Adds ln P(evidence) of an instant, for each element of a plate.
pub fn add_up<T: Scalar>(sums: &mut Vec<f64>, more: &[T]) {
    sums.resize(more.len(), 0.0);
    sums.iter_mut().zip(more).for_each(|(sum, more)| *sum += more.to_f64());
}

/// The place of a covariance in a law of `count` numbers.
const fn covariance_place(count: usize, one: usize, other: usize) -> usize {
    let (row, column) = if one > other { (one, other) } else { (other, one) };
    count + row * (row + 1) / 2 + column
}

/// The number of moments of a law of `count` numbers.
const fn moments(count: usize) -> usize {
    count + count * (count + 1) / 2
}

/// A mean of a law of `count` numbers, for each element of the plate; empty before the first instant.
#[inline]
pub fn means<T>(law: &[T], count: usize, row: usize) -> &[T] {
    let plate = law.len() / moments(count);
    &law[row * plate..][..plate]
}

/// A covariance of a law of `count` numbers, for each element of the plate; empty before the first instant.
#[inline]
pub fn covariances<T>(law: &[T], count: usize, one: usize, other: usize) -> &[T] {
    let plate = law.len() / moments(count);
    &law[covariance_place(count, one, other) * plate..][..plate]
}

/// The place of the largest number of an element of the plate; the first of several.
pub fn largest<T: Scalar>(cells: &[T], plate: usize, element: usize) -> usize {
    let mut best = 0;
    for place in 1..cells.len() / plate.max(1) {
        if cells[place * plate + element] > cells[best * plate + element] {
            best = place;
        }
    }
    best
}

/// The only number, or 0 before the first instant.
#[inline]
pub fn number<T: Scalar>(numbers: &[T]) -> T {
    numbers.first().copied().unwrap_or(T::ZERO)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_have_their_places() {
        // m0 m1, then c00, c10 c11; of two elements.
        let law = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10];
        assert_eq!(means(&law, 2, 1), [3, 4]);
        assert_eq!((covariances(&law, 2, 0, 1), covariances(&law, 2, 1, 1)), (&[7, 8][..], &[9, 10][..]));
        assert!(means::<f64>(&[], 2, 1).is_empty() && number::<f64>(&[]) == 0.0);
        assert_eq!(
            (largest(&[0.5, 1.0, 0.5, 0.0, 0.25, 2.0], 2, 0), largest(&[0.5, 1.0, 0.5, 0.0], 2, 1)),
            (0, 0)
        );
        let mut sums = Vec::new();
        [[0.5f32, 1.0], [0.25, 2.0]].iter().for_each(|more| add_up(&mut sums, more));
        assert_eq!(sums, [0.75, 3.0]);
    }
}
