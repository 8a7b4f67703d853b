//! From rows of a sensor to estimates: clock, faults, rest and filter, one row after the other.
//!
//! In: rows in the order of the file. Out: an [`Instant`] for each, in the same order. Invariant: the memory that is used does not
//! grow; whatever was not measured widens the deviations and is said ([`Event`]).

use super::clock::{Clock, Interval, Pace};
use super::consistency::{Consistency, Verdict};
use super::faults::Clipping;
use super::human::{DT, Human};
use super::inertial::{Estimate, Inertial};
use super::noise::Noise;
use super::reader::Row;
use super::rest::Rest;
use super::rotation::Vector;
use crate::error::Error;
use serde::Serialize;

/// More periods than this without a reading are a gap; fewer are bridged by the readings on both sides.
const GAP_PERIODS: f64 = 5.5;

/// A longer gap, s, is not bridged at all: the estimate stays as it was.
const BRIDGED_S: f64 = 1.0;

/// The time, s, that a break of the clock is taken to have lasted at most: no heading is known after it.
const MOST_UNKNOWN_S: f64 = 60.0;

/// A rate beyond the range exceeds it by this part of the range, one deviation.
const EXCESS: f64 = 0.5;

/// What happened at a row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Events {
    /// It shares its stamp with another.
    pub duplicate: bool,
    /// Readings before it are missing.
    pub gap: bool,
    /// The clock ran back.
    pub backwards: bool,
    /// The clock jumped ahead.
    pub jump: bool,
    /// The gyroscope was at the end of its range.
    pub clipped_rate: bool,
    /// The accelerometer was.
    pub clipped_force: bool,
    /// The row has no reading of the gyroscope.
    pub no_rate: bool,
    /// The row has no reading of the accelerometer.
    pub no_force: bool,
    /// The sensor is at rest.
    pub rest: bool,
}

impl Events {
    /// The names of the events, but for rest.
    pub fn names(&self) -> Vec<&'static str> {
        let all = [
            (self.duplicate, "duplicate"),
            (self.gap, "gap"),
            (self.backwards, "backwards"),
            (self.jump, "jump"),
            (self.clipped_rate, "clipped_rate"),
            (self.clipped_force, "clipped_acceleration"),
            (self.no_rate, "no_rate"),
            (self.no_force, "no_acceleration"),
        ];
        all.into_iter().filter(|(is, _)| *is).map(|(_, name)| name).collect()
    }
}

/// The estimate at a row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instant {
    /// The row's number in the file.
    pub number: u64,
    /// Its stamp, ns.
    pub time: i64,
    /// What is known.
    pub estimate: Estimate,
    /// What happened.
    pub events: Events,
}

/// Who estimates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Profile {
    /// The sensor itself: `models/inertial.bp`.
    #[default]
    Imu,
    /// A person who moves with the sensor: `models/self_motion.bp`, with readings averaged over its instants.
    Human,
}

/// The settings of a stream.
#[derive(Clone, Copy, Debug, Default)]
pub struct Settings {
    /// Who estimates.
    pub profile: Profile,
    /// The numbers of the program.
    pub noise: Noise,
    /// The heading at the start, rad: arbitrary, since nothing measures it.
    pub heading: f64,
    /// The ends of the ranges of gyroscope (rad/s) and accelerometer (m/s²), where they are known.
    pub ranges: [Option<f64>; 2],
}

/// The filter of a file.
#[derive(Clone, Debug)]
pub struct Stream {
    settings: Settings,
    filter: Inertial,
    clock: Clock,
    rest: Rest,
    consistency: Consistency,
    clipping: [Clipping; 2],
    /// Of gyroscope and accelerometer: the usual period, and the time since the last reading.
    paces: [Pace; 2],
    since: [f64; 2],
    last_rate: Option<Vector>,
    /// How long the gyroscope has been clipped, s.
    clipped_s: f64,
    person: Option<Person>,
}

/// A person who moves with the sensor.
#[derive(Clone, Debug)]
struct Person {
    human: Human,
    /// Readings since the last instant: their time, and the sums of rates and forces over it.
    time: f64,
    sums: [Vector; 2],
    force: Vector,
}

impl Person {
    fn feel(&mut self, rate: Vector, force: Option<Vector>, step: f64) -> Result<(), Error> {
        self.force = force.unwrap_or(self.force);
        self.time += step;
        for axis in 0..3 {
            self.sums[0][axis] += step * rate[axis];
            self.sums[1][axis] += step * self.force[axis];
        }
        let means = self.sums.map(|sum| sum.map(|cell| cell / self.time));
        // A little rounding must not cost an instant.
        let instants = ((self.time + 1e-9) / DT).floor();
        for _ in 0..instants as u32 {
            self.human.move_on(means[0], means[1])?;
        }
        if instants > 0.0 {
            self.time = (self.time - instants * DT).max(0.0);
            self.sums = means.map(|mean| mean.map(|cell| cell * self.time));
        }
        Ok(())
    }
}

impl Stream {
    /// A sensor before its first row.
    pub fn new(settings: Settings) -> Self {
        Self {
            settings,
            filter: Inertial::new(settings.noise, settings.heading),
            clock: Clock::default(),
            rest: Rest::default(),
            consistency: Consistency::default(),
            clipping: settings.ranges.map(Clipping::new),
            paces: [Pace::default(), Pace::default()],
            since: [0.0; 2],
            last_rate: None,
            clipped_s: 0.0,
            person: None,
        }
    }

    /// Takes a row; gives the estimates of the rows whose time is known now.
    ///
    /// # Errors
    /// A clock that stands still, as a reason; the program's own checks.
    pub fn feel(&mut self, row: Row) -> Result<Vec<Instant>, Fault> {
        let ready = self.clock.tick(row).map_err(Fault::Clock)?;
        ready.into_iter().map(|(row, interval)| Ok(self.instant(row, interval)?)).collect()
    }

    /// The estimates of the rows that still wait for the time of the next one.
    ///
    /// # Errors
    /// The program's own checks.
    pub fn finish(&mut self) -> Result<Vec<Instant>, Error> {
        let ready = self.clock.flush();
        ready.into_iter().map(|(row, interval)| self.instant(row, interval)).collect()
    }

    /// The mistakes that the readings so far show; `stated`: which units were stated.
    pub fn verdict(&self, stated: [bool; 3]) -> Verdict {
        self.consistency.verdict(stated)
    }

    /// The sensor is known to rest: what the gyroscope measured over these seconds, rad/s, is its bias.
    pub fn still(&mut self, rate: Vector, seconds: f64) {
        self.filter.still(rate, seconds);
    }

    /// The filter.
    pub fn filter(&self) -> &Inertial {
        &self.filter
    }

    /// The usual time between rows, s.
    pub fn period(&self) -> Option<f64> {
        self.clock.period()
    }

    fn instant(&mut self, row: Row, interval: Interval) -> Result<Instant, Error> {
        let (no_rate, no_force) = (row.rate.is_none(), row.force.is_none());
        let mut events = Events { no_rate, no_force, ..Events::default() };
        let step = match interval {
            Interval::First => None,
            Interval::Step(step) => Some(step),
            Interval::Shared(step) => {
                events.duplicate = true;
                Some(step)
            }
            Interval::Back(seconds) | Interval::Jump(seconds) => {
                events.backwards = matches!(interval, Interval::Back(_));
                events.jump = !events.backwards;
                self.break_off(seconds.min(MOST_UNKNOWN_S), &mut events);
                None
            }
        };
        if let Some(step) = step {
            self.since = self.since.map(|since| since + step);
        }
        if self.settings.profile == Profile::Human {
            self.person(&row, step)?;
        }
        if let Some(rate) = row.rate {
            self.turn(rate, &mut events);
        }
        let mut stretch = 0.0;
        if let Some(force) = row.force {
            stretch = self.push(force, &mut events);
        }
        // The sensors may have rows of their own: the last reading of the gyroscope holds.
        if let (Some(rate), Some(force)) = (row.rate.or(self.last_rate), row.force) {
            if self.clipped_s > 0.0 || events.clipped_force {
                self.consistency.forget();
            } else {
                self.consistency.add(row.number, rate, force, stretch);
                events.rest = self.rests(rate, force, stretch)?;
            }
        }
        let estimate =
            self.person.as_ref().map_or_else(|| self.filter.estimate(), |person| person.human.estimate());
        Ok(Instant { number: row.number, time: row.time, estimate, events })
    }

    /// At rest, the reading of the gyroscope is its bias.
    fn rests(&mut self, rate: Vector, force: Vector, seconds: f64) -> Result<bool, Error> {
        if seconds <= 0.0 {
            return Ok(false);
        }
        let bias = self.filter.bias();
        let seen = std::array::from_fn(|axis| rate[axis] - bias[axis]);
        let densities = [self.settings.noise.gyroscope, self.settings.noise.accelerometer];
        let rests = self.rest.feel(seen, force, self.filter.bias_deviations(), densities, seconds)?;
        if rests {
            self.filter.still(rate, seconds);
        }
        Ok(rests)
    }

    /// A person starts at rest, with the first force; what was not measured for long is not felt.
    fn person(&mut self, row: &Row, step: Option<f64>) -> Result<(), Error> {
        match (&mut self.person, row.force) {
            (None, Some(force)) => {
                let human = Human::at_rest(force, self.settings.heading);
                self.person = Some(Person { human, time: 0.0, sums: [[0.0; 3]; 2], force });
            }
            (Some(person), force) => {
                if let Some((rate, step)) =
                    row.rate.or(self.last_rate).zip(step.filter(|step| *step <= BRIDGED_S))
                {
                    person.feel(rate, force, step)?;
                }
            }
            (None, None) => {}
        }
        Ok(())
    }

    /// The gyroscope's reading stands for the time since the one before.
    fn turn(&mut self, rate: Vector, events: &mut Events) {
        let step = std::mem::take(&mut self.since[0]);
        let end = self.clipping[0].of(rate);
        let last = self.last_rate.replace(rate).unwrap_or(rate);
        let usual = self.paces[0].median();
        if step > 0.0 {
            self.paces[0].add(step);
        }
        let periods = usual.map_or(1.0, |usual| step / usual);
        if periods > GAP_PERIODS && step > BRIDGED_S {
            self.break_off(step, events);
        } else if periods > 1.5 {
            let bridge = std::array::from_fn(|axis| 0.5 * (last[axis] + rate[axis]));
            let change = (0..3).map(|axis| (last[axis] - rate[axis]).powi(2)).sum::<f64>().sqrt();
            let is_gap = periods > GAP_PERIODS;
            let prior = if is_gap { self.settings.noise.omega } else { 0.0 };
            self.filter.turn(bridge, prior.hypot(0.5 * change), step);
            if is_gap {
                self.silence(events);
            }
        } else if step > 0.0 {
            self.filter.turn(rate, 0.0, step);
        } else {
            self.filter.look(rate);
        }
        match end {
            Some(end) => {
                events.clipped_rate = true;
                // The excess of a plateau is one error, not a new one at each reading.
                let grown =
                    (EXCESS * end).powi(2) * ((self.clipped_s + step).powi(2) - self.clipped_s.powi(2));
                // The first readings of a plateau are known as such only at its third.
                let late = if self.clipped_s == 0.0 { (EXCESS * end * 2.0 * step).powi(2) } else { 0.0 };
                self.filter.blind(0.0, Some((grown + late).sqrt()));
                self.clipped_s += step;
            }
            None => self.clipped_s = 0.0,
        }
    }

    /// The accelerometer's reading; returns the time that it stands for.
    fn push(&mut self, force: Vector, events: &mut Events) -> f64 {
        let step = std::mem::take(&mut self.since[1]);
        let usual = self.paces[1].median();
        if step > 0.0 {
            self.paces[1].add(step);
        }
        if self.clipping[1].of(force).is_some() {
            events.clipped_force = true;
            self.filter.forget_velocity();
            return step;
        }
        if step <= 0.0 {
            self.filter.start(force);
            return 0.0;
        }
        let is_gap = usual.is_some_and(|usual| step > GAP_PERIODS * usual);
        if is_gap {
            self.silence(events);
        }
        let step = usual.filter(|_| is_gap).unwrap_or(step);
        self.filter.push(force, step);
        step
    }

    /// Readings are missing: velocity and rest are not known.
    fn silence(&mut self, events: &mut Events) {
        events.gap = true;
        self.filter.forget_velocity();
        self.rest.forget();
        self.consistency.forget();
    }

    /// Nothing is known for some seconds: the estimate stays.
    fn break_off(&mut self, seconds: f64, events: &mut Events) {
        let is_break = events.backwards || events.jump;
        self.filter.blind(seconds, None);
        self.silence(events);
        events.gap = !is_break;
        self.since = [0.0; 2];
        self.last_rate = None;
    }
}

/// Why a row cannot be used.
#[derive(Debug)]
pub enum Fault {
    /// The clock, in words.
    Clock(String),
    /// The program's checks.
    Program(Error),
}

impl From<Error> for Fault {
    fn from(error: Error) -> Self {
        Fault::Program(error)
    }
}
