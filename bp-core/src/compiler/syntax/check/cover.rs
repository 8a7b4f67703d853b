//! The values that the arms of a `match` do not cover.
//!
//! In: a domain, then one interval after another. Out: whether all of its values are covered; the first that is not.
//! Invariant: the time of an arm depends on the number of values that it covers, not on the earlier arms.

use crate::model::Domain;

/// The largest domain for which a `match` needs no `_`.
const MOST_COVERED: usize = 1 << 16;

/// The values of a domain that are not yet covered.
pub(super) struct LeftOut {
    /// The uncovered values, and the number of the first; none if the domain has no list of values, or a very long one.
    values: Option<(Vec<bool>, f64)>,
    count: usize,
}

impl LeftOut {
    pub(super) fn of(domain: Option<&Domain>) -> Self {
        let count = |domain: &Domain| domain.count().filter(|count| *count <= MOST_COVERED);
        let values = domain.and_then(|domain| Some((vec![true; count(domain)?], domain.base() as f64)));
        let count = values.as_ref().map_or(0, |(values, _)| values.len());
        Self { values, count }
    }

    /// Covers the values of an interval; returns whether none is left.
    pub(super) fn cover(&mut self, low: f64, high: f64) -> bool {
        let Some((values, base)) = &mut self.values else { return false };
        let end = values.len() as f64;
        let from = (low - *base).ceil().clamp(0.0, end) as usize;
        let to = ((high - *base).floor() + 1.0).clamp(0.0, end) as usize;
        for value in values.get_mut(from..to).unwrap_or_default() {
            self.count -= usize::from(std::mem::replace(value, false));
        }
        self.count == 0
    }

    /// The first value that no arm covers, if one can be named.
    pub(super) fn first(&self) -> Option<usize> {
        self.values.as_ref()?.0.iter().position(|left| *left)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_cover_a_domain_bit_by_bit() {
        let mut left = LeftOut::of(Some(&Domain::Boolean));
        assert!(!left.cover(1.0, 1.0) && left.first() == Some(0));
        assert!(!left.cover(0.5, 0.9) && !left.cover(3.0, 2.0));
        assert!(left.cover(f64::NEG_INFINITY, 0.0) && left.first().is_none());
    }
}
