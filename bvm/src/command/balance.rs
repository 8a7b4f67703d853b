//! `bvm balance`: how a sensor moved.
//!
//! In: a recording of a gyroscope and an accelerometer (CSV). Out: orientation, rate, gravity and acceleration with deviations, a
//! row for each row of the recording; a summary; curves. Invariant: memory does not grow with the length of the file; a recording
//! whose units or axes contradict its own numbers is refused, and nothing is written.

use super::print;
use bvm::error::Error;
use bvm::report::{Line, lines};
use bvm::vestibular::columns::{ACCELERATIONS, RATES, TIMES, Unit, unit_of};
use bvm::vestibular::inertial::GRAVITY;
use bvm::vestibular::reader::{Axes, Format, Reader, Units};
use bvm::vestibular::{
    BalanceError, Fault, Instant, Noise, Profile, Settings, Stream, Table, Verdict, rotation,
};
use clap::Args;
use serde::Serialize;
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::PathBuf;

/// Estimate the orientation of a head from an inertial sensor.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  bvm balance --imu imu.csv --out orientation.csv\n  bvm balance --imu V1_01_easy/mav0/imu0/data.csv --out o.csv --plot o.png\n  bvm balance --imu phone.csv --rate-unit deg/s --acceleration-unit g\n\n\
Columns go by the header: t_s, gx, gy, gz (rad/s), ax, ay, az (m/s2), EuRoC's\n\
names, or others with units such as `gyro_x [deg/s]`. Quaternions are w first,\n\
sensor to world, z up. The heading is that of the start, --initial-heading:\n\
nothing measures it, and its deviation grows."
)]
pub(crate) struct Arguments {
    /// The recording (CSV with a header).
    #[arg(long, value_name = "FILE")]
    imu: PathBuf,
    /// Who estimates: the sensor (imu), or a person who moves with it (human).
    #[arg(long, value_name = "NAME", value_enum, default_value_t, hide_possible_values = true)]
    profile: ProfileName,
    /// Heading of the sensor's x axis at the start, rad, positive to the left.
    #[arg(long, value_name = "RAD", default_value_t = 0.0, allow_negative_numbers = true)]
    initial_heading: f64,
    /// Unit of the rates: rad/s, deg/s, mdps, mrad/s.
    #[arg(long, value_name = "UNIT", value_parser = |text: &str| unit(text, &RATES))]
    rate_unit: Option<Unit>,
    /// Unit of the accelerations: m/s2, g, mg, mm/s2, ft/s2.
    #[arg(long, value_name = "UNIT", value_parser = |text: &str| unit(text, &ACCELERATIONS))]
    acceleration_unit: Option<Unit>,
    /// Unit of the stamps: s, ms, us, ns.
    #[arg(long, value_name = "UNIT", value_parser = |text: &str| unit(text, &TIMES))]
    time_unit: Option<Unit>,
    /// What the accelerometer reports.
    #[arg(
        long,
        value_name = "KIND",
        value_enum,
        default_value_t,
        hide_possible_values = true,
        help = "What the accelerometer reports: the specific force,\nupwards at rest (force), or gravity, downwards\n(gravity); the data cannot decide it"
    )]
    accelerometer: Accelerometer,
    /// Names of the columns, of a file without a header.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    columns: Option<Vec<String>>,
    /// Axes of the gyroscope, such as -x,y,-z.
    #[arg(long, value_name = "AXES", value_parser = axes, allow_hyphen_values = true)]
    gyroscope_axes: Option<Axes>,
    /// Axes of the accelerometer.
    #[arg(long, value_name = "AXES", value_parser = axes, allow_hyphen_values = true)]
    accelerometer_axes: Option<Axes>,
    /// Range of the gyroscope, rad/s [default: found from clipped readings].
    #[arg(long, value_name = "RAD/S")]
    rate_range: Option<f64>,
    /// Range of the accelerometer, m/s² [default: found from clipped readings].
    #[arg(long, value_name = "M/S2")]
    acceleration_range: Option<f64>,
    /// Density of the gyroscope's noise, rad/s/√Hz.
    #[arg(long, value_name = "DENSITY")]
    gyroscope_noise: Option<f64>,
    /// Density of the accelerometer's noise, m/s²/√Hz.
    #[arg(long, value_name = "DENSITY")]
    accelerometer_noise: Option<f64>,
    /// Do not compare units and axes with the data.
    #[arg(long)]
    unchecked: bool,
    /// Output table (CSV).
    #[arg(long, value_name = "FILE", default_value = "orientation.csv")]
    out: PathBuf,
    /// Draw the vertical and the heading (PNG).
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

/// [`Profile`], as an argument.
#[derive(Clone, Copy, Default, PartialEq, clap::ValueEnum)]
enum ProfileName {
    #[default]
    Imu,
    Human,
}

/// What an accelerometer reports.
#[derive(Clone, Copy, Default, PartialEq, clap::ValueEnum)]
enum Accelerometer {
    #[default]
    Force,
    Gravity,
}

fn unit(text: &str, units: &[Unit]) -> Result<Unit, String> {
    unit_of(text, units).ok_or_else(|| {
        let names: Vec<&str> = units.iter().map(|unit| unit.name).collect();
        format!("expected {}", names.join(", "))
    })
}

/// `-x,y,-z`: the axes of a sensor in terms of its columns.
fn axes(text: &str) -> Result<Axes, String> {
    let mut found = [(0, 1.0); 3];
    let parts: Vec<&str> = text.split(',').map(str::trim).collect();
    let axis = |part: &str| {
        let (sign, name) =
            part.strip_prefix('-').map_or((1.0, part.trim_start_matches('+')), |name| (-1.0, name));
        Some((["x", "y", "z"].iter().position(|own| *own == name)?, sign))
    };
    let complete = parts.len() == 3
        && (0..3).all(|at| parts.iter().any(|part| axis(part).is_some_and(|own| own.0 == at)));
    if !complete {
        return Err("expected three different axes, such as -x,y,-z".to_owned());
    }
    for (own, part) in found.iter_mut().zip(parts) {
        *own = axis(part).expect("internal: all were axes");
    }
    Ok(found)
}

/// What was found, in the printed JSON.
#[derive(Serialize)]
struct Summary {
    /// Axes and order of the quaternions.
    frame: &'static str,
    rows: u64,
    duration_s: f64,
    /// Median rate of the rows.
    rate_hz: Option<f64>,
    time_unit: &'static str,
    rate_unit: &'static str,
    acceleration_unit: &'static str,
    accelerometer: &'static str,
    /// k of da/dt = −k ω × a: 1 if units and axes agree; none if the sensor did not tilt.
    k: Option<f64>,
    /// Rows with each event.
    events: BTreeMap<&'static str, u64>,
    rest_rows: u64,
    /// At the last row.
    quaternion: [f64; 4],
    heading_deg: f64,
    sd_heading_deg: f64,
    sd_inclination_deg: f64,
    bias_rad_s: [f64; 3],
    sd_bias_rad_s: [f64; 3],
}

const FRAME: &str = "quaternions w first, sensor to world, z up; gravity and acceleration in the sensor's axes, specific force = gravity + acceleration";

pub(crate) fn run(arguments: &Arguments) -> Result<(), Error> {
    let settings = settings(arguments)?;
    let format = Format {
        columns: arguments.columns.clone(),
        time: arguments.time_unit,
        rate: arguments.rate_unit,
        acceleration: arguments.acceleration_unit,
        reports_gravity: arguments.accelerometer == Accelerometer::Gravity,
        rate_axes: arguments.gyroscope_axes,
        acceleration_axes: arguments.accelerometer_axes,
    };
    let mut reader = Reader::open(&arguments.imu, format)?;
    let mut stream = Stream::new(settings);
    let mut table = Table::create(&arguments.out)?;
    let mut tally = Tally::default();
    while let Some(row) = reader.next_row()? {
        let instants = stream.feel(row).map_err(|fault| match fault {
            Fault::Clock(reason) => reader.refusal(reason).into(),
            Fault::Program(error) => error,
        })?;
        for instant in &instants {
            table.write(instant)?;
            tally.add(instant);
        }
    }
    for instant in stream.finish()? {
        table.write(&instant)?;
        tally.add(&instant);
    }
    let Some(last) = tally.last else { return Err(reader.refusal("there are no rows".to_owned()).into()) };
    if tally.rows < 2 {
        return Err(reader.refusal("there is one row: time needs two".to_owned()).into());
    }
    let backwards = tally.events.get("backwards").copied().unwrap_or(0);
    if 2 * backwards > tally.rows {
        let rows = tally.rows;
        let reason = format!(
            "the stamps run back at {backwards} of {rows} rows: the rows are in reverse order, or the column is no time"
        );
        return Err(reader.refusal(reason).into());
    }
    let units = reader.units();
    let verdict = stream.verdict(units.stated);
    if !arguments.unchecked && !verdict.mistakes.is_empty() {
        return Err(reader.refusal(verdict.mistakes.join("; ")).into());
    }
    for (missing, what) in [("no_rate", "gyroscope"), ("no_acceleration", "accelerometer")] {
        if tally.events.get(missing) == Some(&tally.rows) {
            return Err(reader.refusal(format!("no row has a reading of the {what}")).into());
        }
    }
    table.finish()?;
    let summary = summary(arguments, &stream, &tally, &last, units, &verdict);
    if let Some(path) = &arguments.plot {
        tally.picture(&arguments.imu).write(path)?;
    }
    tell(arguments, &summary, units);
    Ok(())
}

fn settings(arguments: &Arguments) -> Result<Settings, BalanceError> {
    let mut noise = Noise::default();
    for (name, given, own) in [
        ("--gyroscope-noise", arguments.gyroscope_noise, &mut noise.gyroscope),
        ("--accelerometer-noise", arguments.accelerometer_noise, &mut noise.accelerometer),
    ] {
        if let Some(given) = given {
            *own = given;
        }
        if !(*own > 0.0 && *own < 1e3) {
            return Err(BalanceError::Option(format!("{name} is {own}: expected a density above 0")));
        }
    }
    if !arguments.initial_heading.is_finite() {
        return Err(BalanceError::Option("--initial-heading is not finite".to_owned()));
    }
    for (name, range) in
        [("--rate-range", arguments.rate_range), ("--acceleration-range", arguments.acceleration_range)]
    {
        if range.is_some_and(|range| range.is_nan() || range <= 0.0) {
            return Err(BalanceError::Option(format!("{name}: expected a number above 0")));
        }
    }
    let ranges = [arguments.rate_range, arguments.acceleration_range];
    let profile = match arguments.profile {
        ProfileName::Imu => Profile::Imu,
        ProfileName::Human => Profile::Human,
    };
    Ok(Settings { profile, noise, heading: arguments.initial_heading, ranges })
}

/// What is kept of the instants: counts, and at most [`MOST_POINTS`] of the curves.
#[derive(Default)]
struct Tally {
    rows: u64,
    events: BTreeMap<&'static str, u64>,
    rest: u64,
    first_ns: i64,
    last: Option<Instant>,
    /// Time in s, the vertical in the sensor's axes, the heading in turns.
    points: Vec<[f64; 5]>,
    /// The last heading, rad, and the whole turns so far.
    heading: (f64, f64),
    every: u64,
}

const MOST_POINTS: usize = 4000;

impl Tally {
    fn add(&mut self, instant: &Instant) {
        if self.rows == 0 {
            self.first_ns = instant.time;
            self.every = 1;
        }
        self.rows += 1;
        self.rest += u64::from(instant.events.rest);
        for name in instant.events.names() {
            *self.events.entry(name).or_default() += 1;
        }
        self.last = Some(*instant);
        let m = rotation::matrix(instant.estimate.orientation);
        let heading = m[1][0].atan2(m[0][0]);
        let turns = ((self.heading.0 - heading) / TAU).round();
        self.heading = (heading, self.heading.1 + turns);
        if self.rows.is_multiple_of(self.every) {
            let time = (instant.time - self.first_ns) as f64 * 1e-9;
            let [x, y, z] = m[2];
            self.points.push([time, x, y, z, heading / TAU + self.heading.1]);
            if self.points.len() == MOST_POINTS {
                let mut at = 0;
                self.points.retain(|_| {
                    at += 1;
                    at % 2 == 0
                });
                self.every *= 2;
            }
        }
    }

    fn picture(&self, file: &std::path::Path) -> bvm::report::Picture {
        let end = self.points.iter().map(|point| point[0]).fold(1e-3, f64::max);
        let headings = self.points.iter().map(|point| point[4]);
        let [low, high] =
            headings.fold([-1.05, 1.05], |[low, high], turns| [turns.min(low), turns.max(high)]);
        let curve = |name: &str, at: usize| Line {
            name: name.to_owned(),
            points: self.points.iter().map(|point| (point[0], point[at])).collect(),
        };
        let curves = [
            curve("up, along x", 1),
            curve("up, along y", 2),
            curve("up, along z", 3),
            curve("heading (turns)", 4),
        ];
        let title = format!("Orientation, {}", file.file_name().unwrap_or_default().to_string_lossy());
        lines(&title, ["time (s)", "the vertical in the sensor's axes"], [[0.0, end], [low, high]], &curves)
    }
}

fn summary(
    arguments: &Arguments,
    stream: &Stream,
    tally: &Tally,
    last: &Instant,
    units: Units,
    verdict: &Verdict,
) -> Summary {
    let it = &last.estimate;
    let m = rotation::matrix(it.orientation);
    let tilt = it.sd_gravity.iter().map(|sd| sd * sd).sum::<f64>() / 2.0;
    let [time_unit, rate_unit, acceleration_unit] = units.units.map(|unit| unit.name);
    Summary {
        frame: FRAME,
        rows: tally.rows,
        duration_s: (last.time - tally.first_ns) as f64 * 1e-9,
        rate_hz: stream.period().filter(|period| *period > 0.0).map(|period| 1.0 / period),
        time_unit,
        rate_unit,
        acceleration_unit,
        accelerometer: match arguments.accelerometer {
            Accelerometer::Force => {
                "specific force, upwards at rest; the data cannot decide it: --accelerometer gravity"
            }
            Accelerometer::Gravity => "gravity, downwards at rest",
        },
        k: verdict.k,
        events: tally.events.clone(),
        rest_rows: tally.rest,
        quaternion: it.orientation,
        heading_deg: m[1][0].atan2(m[0][0]).to_degrees(),
        sd_heading_deg: it.sd_heading.to_degrees(),
        sd_inclination_deg: (tilt.sqrt() / GRAVITY).to_degrees(),
        bias_rad_s: stream.filter().bias(),
        sd_bias_rad_s: stream.filter().bias_deviations(),
    }
}

fn tell(arguments: &Arguments, it: &Summary, units: Units) {
    if arguments.json {
        return print(&serde_json::to_string(it).expect("internal: a summary is numbers"));
    }
    let rate = it.rate_hz.map_or(String::new(), |rate| format!(", {rate:.1} Hz"));
    print(&format!("recording     {} rows, {:.3} s{rate}", it.rows, it.duration_s));
    let stated = units.stated.map(|stated| if stated { "" } else { " (assumed)" });
    print(&format!(
        "units         {}{}, {}{}, {}{}",
        it.time_unit, stated[0], it.rate_unit, stated[1], it.acceleration_unit, stated[2]
    ));
    print(&format!("accelerometer {}", it.accelerometer));
    match it.k {
        Some(k) => print(&format!("axes          k = {k:.3} in da/dt = -k w x a, expected 1")),
        None => print("axes          not checked: tilts explain too little of the accelerometer's readings"),
    }
    for (name, count) in &it.events {
        print(&format!("event         {name}: {count} rows"));
    }
    print(&format!("rest          {:.1} % of the rows", 100.0 * it.rest_rows as f64 / it.rows as f64));
    print(&format!("bias          {:.5?} rad/s, deviation {:.5?}", it.bias_rad_s, it.sd_bias_rad_s));
    print(&format!(
        "at the end    heading {:.2}°, deviation {:.2}°; inclination, deviation {:.2}°",
        it.heading_deg, it.sd_heading_deg, it.sd_inclination_deg
    ));
    print(&format!("wrote {}", arguments.out.display()));
    if let Some(path) = &arguments.plot {
        print(&format!("wrote {}", path.display()));
    }
}
