//! The numbers of an answer: a range of an array that several parts of it share.
//!
//! In: an array of numbers. Out: [`Numbers`], which read as a slice. Invariant: neither a clone, nor a range, nor the
//! concatenation of ranges that follow each other in one array copies numbers.

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt::{self, Debug, Formatter};
use std::ops::{Deref, Range};
use std::sync::Arc;

/// A range of a shared array of numbers.
#[derive(Clone, Default)]
pub struct Numbers {
    array: Arc<Vec<f64>>,
    range: Range<usize>,
}

impl Numbers {
    /// Some of the numbers, by their positions.
    ///
    /// # Panics
    /// The range exceeds the numbers.
    pub fn range(&self, range: Range<usize>) -> Self {
        assert!(range.start <= range.end && range.end <= self.len(), "internal: a range of other numbers");
        let start = self.range.start;
        Self { array: Arc::clone(&self.array), range: start + range.start..start + range.end }
    }

    /// All of these numbers, one range after the other.
    pub fn concatenated<'n>(all: impl Iterator<Item = &'n Self> + Clone) -> Self {
        let mut rest = all.clone();
        let Some(first) = rest.next() else { return Self::from(Vec::new()) };
        let mut end = first.range.end;
        let follows = |next: &Self| {
            let follows = Arc::ptr_eq(&next.array, &first.array) && next.range.start == end;
            end = next.range.end;
            follows
        };
        match rest.all(follows) {
            true => Self { array: Arc::clone(&first.array), range: first.range.start..end },
            false => all.flat_map(|numbers| numbers.iter().copied()).collect(),
        }
    }
}

impl Deref for Numbers {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.array[self.range.clone()]
    }
}

impl From<Vec<f64>> for Numbers {
    fn from(array: Vec<f64>) -> Self {
        Self { range: 0..array.len(), array: Arc::new(array) }
    }
}

impl FromIterator<f64> for Numbers {
    fn from_iter<I: IntoIterator<Item = f64>>(numbers: I) -> Self {
        Self::from(numbers.into_iter().collect::<Vec<f64>>())
    }
}

impl<'n> IntoIterator for &'n Numbers {
    type Item = &'n f64;
    type IntoIter = std::slice::Iter<'n, f64>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl PartialEq for Numbers {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl PartialEq<Vec<f64>> for Numbers {
    fn eq(&self, other: &Vec<f64>) -> bool {
        **self == **other
    }
}

impl Debug for Numbers {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}

impl Serialize for Numbers {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        (**self).serialize(serializer)
    }
}

impl<'d> Deserialize<'d> for Numbers {
    fn deserialize<D: Deserializer<'d>>(deserializer: D) -> Result<Self, D::Error> {
        Vec::deserialize(deserializer).map(Self::from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_that_follow_each_other_are_not_copied() {
        let all = Numbers::from((0..12).map(f64::from).collect::<Vec<f64>>());
        let thirds: Vec<Numbers> = (0..3).map(|at| all.range(4 * at..4 * (at + 1))).collect();
        let joined = Numbers::concatenated(thirds.iter());
        assert!(Arc::ptr_eq(&joined.array, &all.array));
        assert_eq!(joined, all);
        assert_eq!(joined.range(4..8).range(1..3), vec![5.0, 6.0]);
        let turned = Numbers::concatenated([&thirds[2], &thirds[0]].into_iter());
        assert_eq!(turned, vec![8.0, 9.0, 10.0, 11.0, 0.0, 1.0, 2.0, 3.0]);
        assert!(Numbers::concatenated(std::iter::empty()).is_empty());
    }
}
