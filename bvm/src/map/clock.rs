//! The clock of a map: to which of its instants a sample belongs.
//!
//! In: the stamps of samples. Out: how many instants the map has to predict until a sample's own. Invariant: instants are a period
//! apart from the first sample on, whatever the rates of the senses, and never run back: the instants between two samples add up
//! to the time between them. A sample that is older than the map is late: a filter cannot go back, so that it is not fused.

/// The longest time that is predicted instant by instant; after it the content of a map has long dispersed.
pub const MOST_INSTANTS: i64 = 200;

/// The clock.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    period_ns: i64,
    first: Option<i64>,
    now: i64,
}

/// What a map does with a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Due {
    /// It predicts this many instants, at least one and at most [`MOST_INSTANTS`], and fuses the sample in the last one. More than
    /// one: samples are missing.
    After(i64),
    /// The sample belongs to the instant that the map is at: it was predicted already.
    Now,
    /// The sample belongs to an instant that has passed, by this many.
    Late(i64),
}

impl Clock {
    /// A clock of this period, ns, before its first sample.
    pub fn new(period_ns: i64) -> Self {
        Self { period_ns: period_ns.max(1), first: None, now: 0 }
    }

    /// The median time between stamps that increase, ns; `None` for fewer than two.
    pub fn period_of(stamps: impl IntoIterator<Item = i64>) -> Option<i64> {
        let stamps: Vec<i64> = stamps.into_iter().collect();
        let mut steps: Vec<i64> = stamps.windows(2).map(|pair| pair[1].saturating_sub(pair[0])).collect();
        steps.retain(|step| *step > 0);
        steps.sort_unstable();
        steps.get(steps.len() / 2).copied()
    }

    /// The period, ns.
    pub fn period_ns(&self) -> i64 {
        self.period_ns
    }

    /// A sample of this stamp, ns, arrives.
    pub fn tick(&mut self, stamp: i64) -> Due {
        let Some(first) = self.first else {
            self.first = Some(stamp);
            return Due::After(1);
        };
        let elapsed = stamp.saturating_sub(first);
        let instant = elapsed.saturating_add(self.period_ns / 2).div_euclid(self.period_ns);
        let steps = instant - self.now;
        if steps < 0 {
            return Due::Late(-steps);
        }
        self.now = instant;
        if steps == 0 { Due::Now } else { Due::After(steps.min(MOST_INSTANTS)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instants_follow_the_stamps_of_jittered_late_and_missing_samples() {
        let mut clock = Clock::new(50);
        let due = [1000, 1049, 1102, 1260, 1255, 1300, 1149, 100_000].map(|stamp| clock.tick(stamp));
        // Rounded to periods of 50 since 1000: 0, 1, 2, 5 (two are missing), 5 again, 6, 3 (late by three), 1980.
        let expected = [
            Due::After(1),
            Due::After(1),
            Due::After(1),
            Due::After(3),
            Due::Now,
            Due::After(1),
            Due::Late(3),
            Due::After(MOST_INSTANTS),
        ];
        assert_eq!(due, expected);
    }

    #[test]
    fn the_period_is_that_of_most_frames() {
        assert_eq!(Clock::period_of([0, 50, 101, 300, 350, 350, 400]), Some(50));
        assert_eq!(Clock::period_of([7]), None);
    }
}
