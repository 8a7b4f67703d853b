//! The most probable value of a distribution, and the rule by which ties are broken.
//!
//! In: numbers in proportion to probabilities. Out: where they are largest. Invariant: numbers that differ by less than the
//! tolerance are as good as each other; of these the first is taken, or the one at which a field is smallest.

use super::super::scalar::Scalar;

/// How close to the largest a score must be to be as good, as a fraction of it.
const TIE: f64 = 1e-9;

/// The least score that is as good as the largest.
pub fn least_tied<T: Scalar>(largest: T) -> T {
    // In f32 neighbouring numbers are further apart than the tolerance; their own spacing is used then.
    let spacing = if T::from_f64(1.0 + TIE) == T::ONE { 1e-6 } else { TIE };
    T::from_f64(largest.to_f64() * (1.0 - spacing))
}

/// The distributions of an array: `outer` times `width` times `inner` numbers, each distribution along the second index.
#[derive(Clone, Copy, Debug)]
pub struct Distributions<'s, T> {
    /// The numbers.
    pub scores: &'s [T],
    /// How many numbers a distribution has.
    pub width: usize,
    /// How far apart its numbers are.
    pub inner: usize,
    /// A field that breaks ties: one number for each value, or for each value of each distribution.
    pub nearest: Option<&'s [T]>,
}

impl<T: Scalar> Distributions<'_, T> {
    /// How many distributions there are.
    pub fn count(&self) -> usize {
        self.scores.len() / self.width.max(1)
    }

    /// Where a distribution is largest, and its number there; `None` where no number is above 0.
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
        // Two contexts outside, two values, two contexts inside.
        let scores = [0.1f32, 0.0, 0.9, 0.0, 0.6, 0.5, 0.4, 0.5];
        let of = Distributions { scores: &scores, width: 2, inner: 2, nearest: None };
        let found: Vec<_> = (0..of.count()).map(|context| of.best(context)).collect();
        assert_eq!(found, [Some((1, 0.9)), None, Some((0, 0.6)), Some((0, 0.5))]);
        let field = [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0];
        assert_eq!(Distributions { nearest: Some(&field), ..of }.best(3), Some((1, 0.5)));
    }
}
