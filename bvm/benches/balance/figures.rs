//! The pictures of `docs/balance.md`.
//!
//! In: the errors of the filters, trials, and motions of a person. Out: bars for each trial, errors within their bands, and what is
//! felt. Invariant: each curve is that of the filter that `bvm balance` uses.

use super::{RATE_HZ, Sample, row_of};
use bvm::report::{Band, Bars, Line, Picture, bands, bars, lines};
use bvm::vestibular::human::{DT, Human};
use bvm::vestibular::inertial::GRAVITY;
use bvm::vestibular::rotation;
use bvm::vestibular::{Settings, Stream};
use std::error::Error;
use std::ops::Range;
use std::path::Path;

/// Inclination and heading of each filter and trial, apart; the filter of `bvm balance` and those of others.
pub(super) fn bars_of(all: &[(&str, Vec<[f64; 3]>)]) -> Picture {
    let trials = ["02 slow rotation", "06 fast rotation", "16 translation", "25 tapping"];
    let shown: Vec<&(&str, Vec<[f64; 3]>)> = all.iter().filter(|it| !it.0.starts_with("ours,")).collect();
    let of = |title: &str, error: usize| {
        let series = |it: &&(&str, Vec<[f64; 3]>)| Bars {
            name: it.0.to_owned(),
            values: it.1.iter().map(|errors| errors[error]).collect(),
        };
        let series: Vec<Bars> = shown.iter().map(series).collect();
        bars(title, "root mean square error (degrees)", &trials, &series)
    };
    Picture::stacked(&[of("BROAD: inclination", 0), of("BROAD: heading, without magnetometer", 1)])
}

/// The range of a gyroscope that the fastest turns of trial 06 exceed, rad/s.
const CLIPPED_AT: f64 = 14.0;

/// What happens to the readings from a second of the trial on.
#[derive(Clone, Copy)]
enum Event {
    None,
    /// Nothing is read for a second.
    Gap,
    /// The gyroscope reads at most [`CLIPPED_AT`].
    Clipped,
}

/// The error of inclination about the x axis of the world and its 90 % band, over the seconds since `from`, for the samples
/// `shown`; an event begins at `from`.
fn course(samples: &[Sample], event: Event, from: usize, shown: Range<usize>, every: usize) -> Vec<[f64; 4]> {
    let mut stream = Stream::new(Settings::default());
    let mut points = Vec::new();
    let lasts = from..from + RATE_HZ as usize;
    let mut aligned = None;
    for (number, sample) in samples.iter().enumerate().take(shown.end) {
        let is_during = lasts.contains(&number);
        let rate = match event {
            Event::Gap if is_during => continue,
            Event::Clipped => sample.rate.map(|rate| rate.clamp(-CLIPPED_AT, CLIPPED_AT)),
            _ => sample.rate,
        };
        let Ok(instants) = stream.feel(row_of(number, rate, sample.force)) else { continue };
        let (Some(instant), Some([w, x, y, z])) = (instants.last(), sample.truth) else { continue };
        let difference = rotation::product(instant.estimate.orientation, [w, -x, -y, -z]);
        let turn = *aligned.get_or_insert(2.0 * difference[3].atan2(difference[0]));
        let [w, x, _, _] = rotation::product(rotation::from_vector([0.0, 0.0, -turn]), difference);
        let error = (2.0 * x * w.signum()).to_degrees();
        let spread = stream.filter().rotation_covariance()[0][0] + stream.filter().level().powi(2);
        let band = 1.645 * spread.max(0.0).sqrt().to_degrees();
        if number >= shown.start && number.is_multiple_of(every) {
            let time = (number as f64 - from as f64) / RATE_HZ;
            points.push([time, error, -band, band]);
        }
    }
    points
}

pub(super) fn draw(trials: [&[Sample]; 2], folder: &Path) -> Result<(), Box<dyn Error>> {
    let seconds = |seconds: f64| (seconds * RATE_HZ) as usize;
    let begin = |samples: &[Sample]| samples.iter().position(|sample| sample.truth.is_some()).unwrap_or(0);
    let [slow, fast] = trials;
    let clipped =
        fast.iter().position(|sample| sample.rate.iter().any(|rate| rate.abs() > CLIPPED_AT)).unwrap_or(0);
    let curve = |name: &str, event, from: usize| Band {
        name: name.to_owned(),
        points: course(fast, event, from, from - seconds(2.0).min(from)..from + seconds(6.0), 7),
    };
    let curves = [
        curve("a gap of 1 s", Event::Gap, begin(fast) + seconds(20.0)),
        curve("rates clipped at 14 rad/s", Event::Clipped, clipped),
    ];
    let title = "Trial 06: error of the inclination, and its 90 % band";
    bands(title, ["s since the event", "degrees"], &curves).write(&folder.join("balance_events.png"))?;
    let moving = begin(slow);
    let points = course(slow, Event::None, moving, moving..slow.len(), 57);
    let whole = [Band { name: "error about the x axis of the world".to_owned(), points }];
    let title = "Trial 02: error of the inclination inside its own 90 % band";
    bands(title, ["s since the motion began", "degrees"], &whole).write(&folder.join("balance_band.png"))?;
    Ok(())
}

/// A person who moves: gravity in the head's axes, and the estimate.
#[derive(Clone)]
struct Head {
    orientation: rotation::Quaternion,
    human: Human,
}

impl Head {
    fn upright() -> Self {
        let mut head =
            Self { orientation: [1.0, 0.0, 0.0, 0.0], human: Human::at_rest([0.0, 0.0, GRAVITY], 0.0) };
        (0..6000).for_each(|_| head.step([0.0; 3], [0.0; 3]));
        head
    }

    /// One instant: rate, rad/s, and acceleration, m/s², in the axes of the head.
    fn step(&mut self, rate: [f64; 3], acceleration: [f64; 3]) {
        let turn = rotation::from_vector(rate.map(|rate| DT * rate));
        self.orientation = rotation::normalised(rotation::product(self.orientation, turn));
        let to_head = rotation::transposed(&rotation::matrix(self.orientation));
        let up = rotation::apply(&to_head, [0.0, 0.0, GRAVITY]);
        let force = std::array::from_fn(|axis| up[axis] + acceleration[axis]);
        self.human.move_on(rate, force).expect("finite readings");
    }
}

/// What a person feels: a rotation that stops after a minute, upright or rolled; a long acceleration.
pub(super) fn felt() -> Picture {
    let rate = f64::to_radians(30.0);
    let rotation = |name: &str, roll: f64| {
        let mut head = Head::upright();
        let points = (0..9000).map(|step| {
            let rolls = if (6000..6100).contains(&step) { f64::to_radians(roll) } else { 0.0 };
            head.step([rolls, 0.0, if step < 6000 { rate } else { 0.0 }], [0.0; 3]);
            (f64::from(step) * DT, head.human.rate()[2].to_degrees())
        });
        Line { name: name.to_owned(), points: points.collect() }
    };
    let turned = [
        rotation("felt, upright after the stop", 0.0),
        rotation("rolled by 45 degrees within a second", 45.0),
        rotation("rolled by 90 degrees", 90.0),
    ];
    let tilt = |name: &str, g: f64| {
        let mut head = Head::upright();
        let points = (0..800).map(|step| {
            let acceleration = if step < 100 { 0.0 } else { g * GRAVITY };
            head.step([0.0; 3], [acceleration, 0.0, 0.0]);
            let [x, _, z] = head.human.gravity();
            (f64::from(step) * DT - 1.0, x.atan2(z).to_degrees())
        });
        Line { name: name.to_owned(), points: points.collect() }
    };
    let tilted = [tilt("0.2 g", 0.2), tilt("0.5 g", 0.5), tilt("1 g", 1.0)];
    let limits = [[[0.0, 90.0], [-32.0, 32.0]], [[-1.0, 7.0], [-2.0, 55.0]]];
    Picture::stacked(&[
        lines("A rotation at 30 degrees/s for a minute", ["s", "felt rate (degrees/s)"], limits[0], &turned),
        lines("A long acceleration is felt as a tilt", ["s", "felt tilt (degrees)"], limits[1], &tilted),
    ])
}
