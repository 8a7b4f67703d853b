//! Sums of logarithms that are compared with each other: ln of the weights of values, draws or components.
//!
//! In: the terms of each sum. Out: weights that sum to one, and ln of their total. Invariant: large terms that all sums share cancel
//! exactly, and take no digits from the small ones; what the rounding of large terms would decide is refused.

use crate::error::Error;
use crate::spelling::number;

/// From this size on the rounding of a term is kept apart.
const LARGE: f64 = 1e6;
/// The largest error of a difference of logarithms, which is the relative error of odds, in exact answers, and in estimates.
pub(crate) const EXACT: f64 = 1e-6;
pub(crate) const ESTIMATED: f64 = 1e-2;
/// Roundings of a large term, in units of its last place: of the distance, of the deviation, and of its square.
const ROUNDINGS: f64 = 4.0;
/// A weight that is smaller than the largest by e to this power is 0 beside it.
const NOTHING: f64 = 45.0;

/// A sum of logarithms.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct LnTerms {
    small: f64,
    /// The sum of the large terms, and what its rounding leaves.
    large: [f64; 2],
}

/// The rounded sum of two numbers, and the rest (Knuth, *The Art of Computer Programming*, vol. 2, 4.2.2, theorem B).
pub(crate) fn exact_sum(one: f64, other: f64) -> [f64; 2] {
    let sum = one + other;
    let second = sum - one;
    [sum, (one - (sum - second)) + (other - second)]
}

impl LnTerms {
    /// Adds a term.
    pub(crate) fn add(&mut self, term: f64) {
        if term.abs() >= LARGE && term.is_finite() {
            let [sum, rest] = exact_sum(self.large[0], term);
            self.large = exact_sum(sum, self.large[1] + rest);
        } else {
            self.small += term;
        }
    }

    /// The sum.
    pub(crate) fn total(&self) -> f64 {
        self.large[0] + (self.large[1] + self.small)
    }

    /// Whether the weight is 0.
    pub(crate) fn is_nothing(&self) -> bool {
        self.total() == f64::NEG_INFINITY
    }

    /// The sum less another one.
    fn above(&self, other: &Self) -> f64 {
        (self.large[0] - other.large[0]) + (self.large[1] - other.large[1]) + (self.small - other.small)
    }
}

/// The weights of sums of logarithms, which sum to one, and ln of the sum of their exponentials.
///
/// # Errors
/// Large terms whose rounding changes odds by more than `most_error`.
pub(crate) fn weights(
    all: &[LnTerms],
    most_error: f64,
    question: impl Fn() -> String,
) -> Result<(Vec<f64>, f64), Error> {
    let largest = all.iter().max_by(|one, other| one.total().total_cmp(&other.total()));
    let Some(largest) = largest.filter(|largest| largest.total().is_finite()) else {
        return Ok((vec![0.0; all.len()], largest.map_or(f64::NEG_INFINITY, LnTerms::total)));
    };
    let above: Vec<f64> =
        all.iter().map(|own| if own.is_nothing() { f64::NEG_INFINITY } else { own.above(largest) }).collect();
    let most = above.iter().copied().fold(0.0, f64::max);
    let error = |own: &LnTerms| match own.large == largest.large {
        true => 0.0,
        false => ROUNDINGS * f64::EPSILON * own.large[0].abs().max(largest.large[0].abs()),
    };
    let is_lost = |(own, above): &(&LnTerms, &f64)| {
        let error = error(own);
        error > most_error && **above > most - NOTHING - error
    };
    if let Some((own, _)) = all.iter().zip(&above).find(is_lost) {
        let (total, error) = (number(own.total()), number(error(own)));
        let reason = format!(
            "what is observed lies so far from all that the program expects (ln P is about {total}) that rounding, by {error} here, \
             decides between values: check the unit of the observations, or take a larger deviation"
        );
        return Err(Error::Unplanned { question: question(), reason });
    }
    let mut weights: Vec<f64> = above.iter().map(|above| (above - most).exp()).collect();
    let total: f64 = weights.iter().sum();
    weights.iter_mut().for_each(|weight| *weight /= total);
    let ln_total = LnTerms { small: largest.small + most + total.ln(), ..*largest }.total();
    Ok((weights, ln_total))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sum(terms: &[f64]) -> LnTerms {
        let mut sum = LnTerms::default();
        terms.iter().for_each(|term| sum.add(*term));
        sum
    }

    #[test]
    fn shared_terms_cancel_and_rounded_ones_are_refused() {
        let all = [sum(&[-0.25, -5e13, 0.5, -3e12]), sum(&[-5e13, -3e12])];
        let (weights, ln_total) = weights(&all, EXACT, String::new).unwrap();
        // Odds e^¼ by hand.
        assert!((weights[0] / weights[1] - 0.25f64.exp()).abs() < 1e-15);
        assert!((ln_total - (-5.3e13 + (1.0 + 0.25f64.exp()).ln())).abs() < 0.01, "{ln_total}");
        let close = [sum(&[-5e13]), sum(&[-5e13 - 1.0])];
        assert!(super::weights(&close, EXACT, String::new).is_err());
        let apart = [sum(&[-5e13]), sum(&[-6e13])];
        assert_eq!(super::weights(&apart, EXACT, String::new).unwrap().0, [1.0, 0.0]);
    }
}
