//! The values that the arms of a `match` do not cover.
//!
//! In: a domain, then one interval after another. Out: whether all of its values are covered; the first that is not.
//! Invariant: the time of an arm depends on the number of values that it covers, not on the earlier arms.

use crate::model::Domain;

/// The largest domain for which a `match` needs no `_`.
const MOST_COVERED: usize = 1 << 16;

/// The values of a domain that are not yet covered.
pub(super) struct LeftOut {
    /// Whether each value is left.
    left: Vec<bool>,
    /// The numbers of the values, ascending; none if the domain has no list of values, or a very long one.
    numbers: Vec<f64>,
    count: usize,
}

impl LeftOut {
    pub(super) fn of(domain: Option<&Domain>) -> Self {
        let numbers = |domain: &Domain| {
            let count = domain.count().filter(|count| *count <= MOST_COVERED)?;
            Some((0..count).map(|ordinal| domain.number(ordinal)).collect())
        };
        let numbers: Vec<f64> = domain.and_then(numbers).unwrap_or_default();
        Self { left: vec![true; numbers.len()], count: numbers.len(), numbers }
    }

    /// Covers the values of an interval; returns whether none is left.
    pub(super) fn cover(&mut self, low: f64, high: f64) -> bool {
        let from = self.numbers.partition_point(|number| *number < low);
        let to = self.numbers.partition_point(|number| *number <= high);
        for value in self.left.get_mut(from..to).unwrap_or_default() {
            self.count -= usize::from(std::mem::replace(value, false));
        }
        self.count == 0 && !self.numbers.is_empty()
    }

    /// The first value that no arm covers, if one can be named.
    pub(super) fn first(&self) -> Option<usize> {
        self.left.iter().position(|left| *left)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Bins;

    #[test]
    fn intervals_cover_a_domain_bit_by_bit() {
        let mut left = LeftOut::of(Some(&Domain::Boolean));
        assert!(!left.cover(1.0, 1.0) && left.first() == Some(0));
        assert!(!left.cover(0.5, 0.9) && !left.cover(3.0, 2.0));
        assert!(left.cover(f64::NEG_INFINITY, 0.0) && left.first().is_none());
        // Bins of 0 to 10 with the centres 1, 3, 5, 7 and 9.
        let mut left = LeftOut::of(Bins::even(0.0, 10.0, 5, false).map(Domain::Bins).as_ref());
        assert!(!left.cover(0.0, 4.0) && left.first() == Some(2));
        assert!(left.cover(4.0, 10.0));
        assert!(!LeftOut::of(None).cover(f64::NEG_INFINITY, f64::INFINITY));
    }
}
