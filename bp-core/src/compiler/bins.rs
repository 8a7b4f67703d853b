//! Bins: a real line, or a circle, cut into intervals.
//!
//! In: bounds. Out: [`Bins`], with the bin of a number and the centre of a bin. Invariant: edges are finite and
//! ascending; bin i is [edge i; edge i+1[, and the last one contains its upper edge too, unless the ends meet: then
//! every number lies in some bin. A number that differs from an edge by rounding only, as 3 · 0.1 from 0.3, is that edge.

use serde::{Deserialize, Serialize};

/// A real in bins: `bins(-50, 50, 20)`, `bins[0, 1, 2, 5]`, `circle(0, 360, 36)`.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Bins {
    edges: Vec<f64>,
    even: bool,
    circle: bool,
    /// Where the values are numbers and not intervals: the number within each bin.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    points: Option<Vec<f64>>,
}

/// Limit of the number of bins of a domain.
pub const MOST_BINS: usize = 1 << 20;

impl Bins {
    /// `count` bins of equal width; where the ends meet, a circle. `None` without a width or a count.
    pub fn even(low: f64, high: f64, count: usize, circle: bool) -> Option<Self> {
        let width = (high - low) / count as f64;
        let valid = (1..=MOST_BINS).contains(&count) && width > 0.0 && width.is_finite();
        // Rounded as a decimal is: the edge 0.3 of `bins(0, 1, 10)` is the number 0.3, which 3 · 0.1 is not.
        let edge = |position: usize| {
            let (before, after) = (position as f64, (count - position) as f64);
            let edge = (low * after + high * before) / count as f64;
            match position {
                0 => low,
                position if position == count => high,
                _ if edge.is_finite() => edge,
                _ => low + width * before,
            }
        };
        valid.then(|| Self { edges: (0..=count).map(edge).collect(), even: true, circle, points: None })
    }

    /// Bins between these edges. `None` unless there are two or more and they ascend.
    pub fn between(edges: Vec<f64>) -> Option<Self> {
        let ascend = edges.len() > 1 && edges.windows(2).all(|pair| pair[0] < pair[1]);
        let valid = ascend && edges.len() <= MOST_BINS && edges.iter().all(|edge| edge.is_finite());
        valid.then_some(Self { edges, even: false, circle: false, points: None })
    }

    /// These numbers, ascending, as values: each has the bin of the points nearest to it. `None` if there are none, or
    /// too many.
    pub fn of_values(values: Vec<f64>) -> Option<Self> {
        let (low, high) = (*values.first()?, *values.last()?);
        let beyond = |value: f64| value.abs().max(1.0);
        let mut edges = vec![low - beyond(low)];
        edges.extend(values.windows(2).map(|pair| 0.5 * pair[0] + 0.5 * pair[1]));
        edges.push(high + beyond(high));
        Some(Self { points: Some(values), ..Self::between(edges)? })
    }

    /// The values, where they are numbers and not intervals.
    pub fn points(&self) -> Option<&[f64]> {
        self.points.as_deref()
    }

    /// The number of bins.
    pub fn count(&self) -> usize {
        self.edges.len() - 1
    }

    /// The edges, one more than the number of bins.
    pub fn edges(&self) -> &[f64] {
        &self.edges
    }

    /// The lowest and the highest edge.
    pub fn ends(&self) -> (f64, f64) {
        (self.edges[0], self.edges[self.count()])
    }

    /// Whether the ends meet.
    pub fn is_circle(&self) -> bool {
        self.circle
    }

    /// The common width of the bins, if there is one.
    pub fn width(&self) -> Option<f64> {
        let (low, high) = self.ends();
        self.even.then(|| (high - low) / self.count() as f64)
    }

    /// The centre of a bin.
    pub fn centre(&self, bin: usize) -> f64 {
        match (self.width(), &self.points) {
            (_, Some(points)) => points[bin],
            (Some(width), _) => self.edges[0] + width * (bin as f64 + 0.5),
            (None, _) => 0.5 * (self.edges[bin] + self.edges[bin + 1]),
        }
    }

    /// The bin of a number.
    pub fn holding(&self, number: f64) -> Option<usize> {
        holding(&self.edges, self.circle, number)
    }

    /// The distance from an edge within which a number is the edge itself.
    pub fn rounding(&self, edge: usize) -> f64 {
        rounding(&self.edges, edge)
    }

    /// The centre of a bin, with the digits that distinguish it from its neighbours by a billionth.
    pub fn name(&self, bin: usize) -> String {
        if let Some(points) = &self.points {
            return points[bin].to_string();
        }
        let digits = 10f64.powi(9 - (self.edges[bin + 1] - self.edges[bin]).log10().floor() as i32);
        let rounded = (self.centre(bin) * digits).round() / digits;
        // −0 is 0; numbers too large for such digits are written in full.
        if rounded.is_finite() { (rounded + 0.0).to_string() } else { self.centre(bin).to_string() }
    }
}

/// The bin between these edges that contains a number; the ends meet on a circle.
pub fn holding(edges: &[f64], circle: bool, number: f64) -> Option<usize> {
    let count = edges.len() - 1;
    let (low, high) = (edges[0], edges[count]);
    let number = if circle { low + (number - low).rem_euclid(high - low) } else { number };
    // The number of edges that are not above the number, but for rounding.
    let below = edges.partition_point(|edge| *edge <= number);
    let is_next = below <= count && edges[below] - number <= rounding(edges, below);
    match below + usize::from(is_next) {
        0 => None,
        below if below <= count => Some(below - 1),
        // The upper end, which is the lower one of a circle.
        _ if circle => Some(0),
        _ => (number - high <= rounding(edges, count)).then_some(count - 1),
    }
}

/// The distance from an edge within which a number is the edge itself: a few units in the last place of the edge, or of
/// the narrower bin beside it, which an edge at 0 needs.
fn rounding(edges: &[f64], at: usize) -> f64 {
    const UNITS: f64 = 4.0;
    let below = at.checked_sub(1).map(|before| edges[at] - edges[before]);
    let above = edges.get(at + 1).map(|after| after - edges[at]);
    let width = below.into_iter().chain(above).fold(f64::INFINITY, f64::min);
    (UNITS * f64::EPSILON * edges[at].abs().max(width)).min(0.25 * width)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_in_their_bins() {
        let bins = Bins::even(-50.0, 50.0, 20, false).unwrap();
        assert_eq!(
            (bins.holding(-50.0), bins.holding(-45.0), bins.holding(50.0)),
            (Some(0), Some(1), Some(19))
        );
        assert_eq!((bins.holding(-50.1), bins.holding(f64::NAN)), (None, None));
        assert_eq!((bins.centre(0), bins.name(0)), (-47.5, "-47.5".to_owned()));
        let given = Bins::between(vec![0.0, 1.0, 10.0]).unwrap();
        assert_eq!((given.holding(1.0), given.name(1)), (Some(1), "5.5".to_owned()));
    }

    #[test]
    fn angles_wrap() {
        let circle = Bins::even(0.0, 360.0, 36, true).unwrap();
        assert_eq!(
            (circle.holding(-1.0), circle.holding(360.0), circle.holding(725.0)),
            (Some(35), Some(0), Some(0))
        );
        assert_eq!(
            circle.holding(-1e-17),
            Some(0),
            "just below the lower end, which is the upper one when rounded"
        );
    }

    #[test]
    fn bins_that_cannot_be_are_none() {
        assert!(Bins::even(1.0, 1.0, 3, false).is_none() && Bins::even(0.0, 1.0, 0, false).is_none());
        assert!(Bins::even(0.0, f64::INFINITY, 3, false).is_none());
        assert!(Bins::between(vec![0.0]).is_none() && Bins::between(vec![0.0, 0.0]).is_none());
    }
}
