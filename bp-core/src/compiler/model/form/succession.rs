//! From counts to probabilities: histogram, and Laplace's law of succession.
//!
//! In: the count of each value of the left-hand variable. Out: a [`Form`]. Invariant: by Laplace's law no value has
//! probability 0, and without observations all values have equal probability.
//!
//! histogram: P(X = i) = nᵢ / N.    Laplace: P(X = i) = (nᵢ + 1) / (N + k)  (k values, N observations).

use super::Form;
use crate::ids::ExpressionId;
use crate::model::ModelBuilder;
use crate::operators::Binary;

impl ModelBuilder {
    /// Relative frequencies.
    pub fn histogram(&mut self, counts: &[ExpressionId]) -> Form {
        self.proportional(counts)
    }

    /// Laplace's law of succession.
    pub fn laplace_succession(&mut self, counts: &[ExpressionId]) -> Form {
        let one = self.number(1.0);
        let more: Vec<ExpressionId> =
            counts.iter().map(|count| self.binary(Binary::Add, *count, one)).collect();
        self.proportional(&more)
    }
}
