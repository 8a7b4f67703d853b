//! The clock of a sensor: how much time each row stands for.
//!
//! In: rows with their stamps. Out: the rows in their order, each with an [`Interval`]. Invariant: the intervals of stamps that
//! increase sum to the time between the first and the last; rows that share a stamp share the time until the next one; nothing is
//! assumed about the sampling rate.

use super::reader::Row;

/// How many intervals the median is of.
const KEPT: usize = 31;

/// The most rows with one stamp.
const MOST_OF_STAMP: usize = 256;

/// A step of the clock that is longer, s, and longer than many periods, is a jump: no sensor was silent for so long.
const JUMP_S: f64 = 60.0;

/// The time that a row stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Interval {
    /// The first row.
    First,
    /// The seconds since the row before.
    Step(f64),
    /// The same, of a row that shares its stamp with others.
    Shared(f64),
    /// The clock ran back by some seconds: how much time went by is not known.
    Back(f64),
    /// The clock jumped ahead by some seconds.
    Jump(f64),
}

/// The clock.
#[derive(Clone, Debug, Default)]
pub(super) struct Clock {
    last: Option<i64>,
    /// Rows with the stamp `last`, but for the first of them.
    waiting: Vec<Row>,
    pace: Pace,
}

impl Clock {
    /// Takes a row; gives those whose time is known now.
    ///
    /// # Errors
    /// Too many rows with one stamp.
    pub(super) fn tick(&mut self, row: Row) -> Result<Vec<(Row, Interval)>, String> {
        let Some(last) = self.last else {
            self.last = Some(row.time);
            return Ok(vec![(row, Interval::First)]);
        };
        let step = row.time.saturating_sub(last);
        if step == 0 {
            if self.waiting.len() == MOST_OF_STAMP {
                return Err(format!(
                    "row {}: {MOST_OF_STAMP} rows have the same stamp: stamps were written with too few digits, or the clock \
                     stands still",
                    row.number
                ));
            }
            self.waiting.push(row);
            return Ok(Vec::new());
        }
        self.last = Some(row.time);
        let step = step as f64 * 1e-9;
        if step < 0.0 {
            let mut ready = self.flush();
            ready.push((row, Interval::Back(-step)));
            return Ok(ready);
        }
        let rows = (self.waiting.len() + 1) as f64;
        if step > JUMP_S && self.pace.median().is_some_and(|period| step > 100.0 * period * rows) {
            let mut ready = self.flush();
            ready.push((row, Interval::Jump(step)));
            return Ok(ready);
        }
        // Rows with a stamp of their own wait for nobody; a lost stretch belongs to the last row.
        let period = self.pace.median().unwrap_or(step / rows);
        let share = if step > 2.0 * rows * period { period.min(step / rows) } else { step / rows };
        let shared = self.waiting.drain(..).map(|row| (row, Interval::Shared(share))).collect::<Vec<_>>();
        let left = step - share * shared.len() as f64;
        self.pace.add(left);
        let own = if shared.is_empty() { Interval::Step(left) } else { Interval::Shared(left) };
        Ok(shared.into_iter().chain([(row, own)]).collect())
    }

    /// The rows that still wait at the end, or where the clock breaks: each stands for a usual period.
    pub(super) fn flush(&mut self) -> Vec<(Row, Interval)> {
        let period = self.pace.median().unwrap_or(0.0);
        self.waiting.drain(..).map(|row| (row, Interval::Shared(period))).collect()
    }

    /// The usual period, s.
    pub(super) fn period(&self) -> Option<f64> {
        self.pace.median()
    }
}

/// The median of the last intervals.
#[derive(Clone, Debug, Default)]
pub(super) struct Pace {
    last: Vec<f64>,
    next: usize,
    median: Option<f64>,
}

impl Pace {
    /// Adds an interval.
    pub(super) fn add(&mut self, interval: f64) {
        if self.last.len() < KEPT {
            self.last.push(interval);
        } else {
            self.last[self.next] = interval;
        }
        self.next = (self.next + 1) % KEPT;
        // A full window changes slowly: its median is taken anew once a round.
        if self.last.len() < KEPT || self.next == 0 {
            let mut sorted = self.last.clone();
            sorted.sort_by(f64::total_cmp);
            self.median = Some(sorted[sorted.len() / 2]);
        }
    }

    /// The median.
    pub(super) fn median(&self) -> Option<f64> {
        self.median
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn intervals(stamps: &[i64]) -> Vec<Interval> {
        let mut clock = Clock::default();
        let mut found = Vec::new();
        for (number, time) in stamps.iter().enumerate() {
            let row = Row { number: number as u64, time: time * 1_000_000, rate: None, force: None };
            found.extend(clock.tick(row).unwrap());
        }
        found.extend(clock.flush());
        assert!(
            found.iter().enumerate().all(|(number, (row, _))| row.number == number as u64),
            "in their order"
        );
        found.into_iter().map(|(_, interval)| interval).collect()
    }

    #[test]
    fn rows_that_share_a_stamp_share_its_time() {
        use Interval::{First, Shared, Step};
        assert_eq!(
            intervals(&[0, 10, 10, 30, 40]),
            [First, Step(0.01), Shared(0.01), Shared(0.01), Step(0.01)]
        );
        assert_eq!(
            intervals(&[0, 10, 20, 20]),
            [First, Step(0.01), Step(0.01), Shared(0.01)],
            "at the end a usual period"
        );
    }

    #[test]
    fn breaks_of_the_clock() {
        use Interval::{Back, Jump, Step};
        let of = |stamps: &[i64]| *intervals(stamps).last().unwrap();
        assert_eq!(of(&[0, 10, 20, 1020]), Step(1.0), "a gap");
        assert_eq!(of(&[0, 10, 20, -480]), Back(0.5));
        assert_eq!(of(&[0, 10, 20, 200_000_020]), Jump(200_000.0));
    }

    #[test]
    fn a_clock_that_stands_still_is_refused() {
        let mut clock = Clock::default();
        let row = Row { number: 9, time: 5, rate: None, force: None };
        let error = (0..1000).find_map(|_| clock.tick(row).err()).unwrap();
        assert!(error.contains("row 9") && error.contains("too few digits"), "{error}");
    }
}
