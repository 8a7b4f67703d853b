//! The most probable value of a distribution, and the rule for ties.
//!
//! In: numbers proportional to probabilities. Out: the position of the largest. Invariant: numbers that differ by less
//! than the tolerance are tied; of these the first is taken, or the one with the smallest value of a field.

use super::super::scalar::Scalar;

/// Relative tolerance for ties.
const TIE: f64 = 1e-9;

/// The least score that ties with the largest.
pub fn least_tied<T: Scalar>(largest: T) -> T {
    // In f32 adjacent numbers differ by more than the tolerance; about ten times their spacing is used instead.
    let spacing = if T::from_f64(1.0 + TIE) == T::ONE { 1e-6 } else { TIE };
    T::from_f64(largest.to_f64() * (1.0 - spacing))
}

/// The distributions in an array of `outer` × `width` × `inner` numbers, each along the second index.
#[derive(Clone, Copy, Debug)]
pub struct Distributions<'s, T> {
    /// The numbers.
    pub scores: &'s [T],
    /// The number of values of a distribution.
    pub width: usize,
    /// The stride between its numbers.
    pub inner: usize,
    /// A field that breaks ties: one number for each value, or for each value of each distribution.
    pub nearest: Option<&'s [T]>,
}

impl<T: Scalar> Distributions<'_, T> {
    /// The number of distributions.
    pub fn count(&self) -> usize {
        self.scores.len() / self.width.max(1)
    }

    /// The position and value of the maximum of a distribution; `None` where no number is positive.
    pub fn best(&self, context: usize) -> Option<(usize, T)> {
        let start = context / self.inner * (self.width * self.inner) + context % self.inner;
        let score = |value: usize| self.scores[start + value * self.inner];
        let largest = (0..self.width).fold(T::ZERO, |largest, value| largest.maximum(score(value)));
        if largest <= T::ZERO {
            return None;
        }
        let least = least_tied(largest);
        let mut tied = (0..self.width).filter(|value| score(*value) >= least);
        let best = match self.nearest {
            None => tied.next(),
            Some(field) => {
                let away = |value: usize| match field.len() == self.width {
                    true => field[value],
                    false => field[start + value * self.inner],
                };
                tied.reduce(|best, other| if away(other) < away(best) { other } else { best })
            }
        };
        best.map(|value| (value, score(value)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_of_equals_is_taken_or_the_nearest() {
        let scores = [0.1, 0.3, 0.3 * (1.0 - 1e-12), 0.3];
        let mut of = Distributions { scores: &scores, width: 4, inner: 1, nearest: None };
        assert_eq!(of.best(0), Some((1, 0.3)));
        of.nearest = Some(&[0.0, 3.0, 1.0, 2.0]);
        assert_eq!(of.best(0), Some((2, scores[2])));
        assert_eq!(of.count(), 1);
    }

    #[test]
    fn distributions_stand_along_the_second_index() {
        // Two outer contexts, two values, two inner contexts.
        let scores = [0.1f32, 0.0, 0.9, 0.0, 0.6, 0.5, 0.4, 0.5];
        let of = Distributions { scores: &scores, width: 2, inner: 2, nearest: None };
        let found: Vec<_> = (0..of.count()).map(|context| of.best(context)).collect();
        assert_eq!(found, [Some((1, 0.9)), None, Some((0, 0.6)), Some((0, 0.5))]);
        let field = [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0];
        assert_eq!(Distributions { nearest: Some(&field), ..of }.best(3), Some((1, 0.5)));
    }
}
