//! Faults of a sensor that its own numbers show: readings at the end of the range.
//!
//! In: readings. Out: whether one is clipped. Invariant: a reading is clipped only if it repeats to the bit, at the largest value
//! so far, after readings that differed: a signal that is constant from the start is not clipped.

use super::rotation::Vector;

/// How many readings of the past must have differed.
const WINDOW: u32 = 20;

/// One axis.
#[derive(Clone, Copy, Debug, Default)]
struct Axis {
    last: f64,
    largest: f64,
    /// How often the last value has repeated.
    repeats: u32,
    /// Of the last readings, how many differed from the one before: a bit each.
    differed: u32,
    /// A value at which the sensor was clipped.
    end: Option<f64>,
}

impl Axis {
    fn is_clipped(&mut self, value: f64) -> bool {
        let size = value.abs();
        self.repeats = if value == self.last { self.repeats + 1 } else { 0 };
        // Noise of the past: readings before the plateau.
        let moved = (self.differed >> self.repeats.min(31)).count_ones();
        self.differed = self.differed << 1 | u32::from(value != self.last);
        self.last = value;
        self.largest = self.largest.max(size);
        if self.repeats >= 2 && size == self.largest && moved >= WINDOW / 2 {
            self.end = Some(size);
        }
        self.end.is_some_and(|end| size >= end)
    }
}

/// Clipping of three axes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Clipping {
    axes: [Axis; 3],
    /// The end of the range, where the user knows it.
    range: Option<f64>,
}

impl Clipping {
    /// A sensor whose range may be known.
    pub(super) fn new(range: Option<f64>) -> Self {
        Self { axes: [Axis::default(); 3], range }
    }

    /// The end of the range, if an axis of this reading is at it.
    pub(super) fn of(&mut self, reading: Vector) -> Option<f64> {
        let range = self.range;
        let mut end = None;
        for (axis, value) in self.axes.iter_mut().zip(reading) {
            let clipped = match range {
                Some(range) => value.abs() >= 0.999 * range,
                None => axis.is_clipped(value),
            };
            if clipped {
                end = Some(value.abs());
            }
        }
        end
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sine with a little noise that does not repeat, cut at `end`.
    fn clipped(end: f64) -> usize {
        let mut clipping = Clipping::new(None);
        let value = |step: i32| {
            let step = f64::from(step);
            (10.0 * (step * 0.05).sin() + 0.001 * (step * step).sin()).clamp(-end, end)
        };
        (0..400).filter(|step| clipping.of([value(*step), 0.0, 0.0]).is_some()).count()
    }

    #[test]
    fn plateaus_at_the_end_of_the_range() {
        assert_eq!(clipped(20.0), 0);
        // |10 sin| > 8 for 41 % of the time: 164 of 400, but for the first two of each axis.
        let found = clipped(8.0);
        assert!((155..=166).contains(&found), "{found}");
    }

    #[test]
    fn constant_signals_are_not_clipped() {
        let mut clipping = Clipping::new(None);
        let steps =
            (0..300).map(|step| if (100..200).contains(&step) { std::f64::consts::FRAC_PI_2 } else { 0.0 });
        assert_eq!(steps.filter(|rate| clipping.of([*rate, 0.0, 9.80665]).is_some()).count(), 0);
        let mut known = Clipping::new(Some(2.0));
        assert_eq!((known.of([1.9, 0.0, 0.0]), known.of([-2.0, 0.0, 0.0])), (None, Some(2.0)));
    }
}
