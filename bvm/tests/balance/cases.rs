//! Traps: mistakes and faults of recordings, each an error that names its factor and option, or an estimate that says how little it
//! knows.

use super::{estimates, shared};
use bvm::vestibular::Instant;
use bvm::vestibular::columns::{ACCELERATIONS, RATES};
use bvm::vestibular::reader::Format;
use bvm::vestibular::rotation::{self, Vector};
use std::f64::consts::FRAC_1_SQRT_2;
use std::fmt::Write;

fn case(name: &str) -> Option<String> {
    let path = shared("cases/senses")?.join(name);
    Some(std::fs::read_to_string(path).unwrap())
}

fn heading(instant: &Instant) -> f64 {
    rotation::heading(instant.estimate.orientation).unwrap()
}

/// The quaternion of a roll by 90° about x, by hand.
const ROLLED: [f64; 4] = [FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0, 0.0];

fn ends_rolled(text: &str, format: Format) {
    let (instants, verdict) = estimates(text, format).unwrap();
    assert!(verdict.mistakes.is_empty(), "{verdict:?}");
    let q = instants.last().unwrap().estimate.orientation;
    assert!(q.iter().zip(ROLLED).all(|(found, right)| (found - right).abs() < 0.01), "{q:?}");
}

#[test]
fn a_roll_in_any_order_of_columns() {
    let Some(text) = case("19/truth_rad.csv") else { return };
    ends_rolled(&text, Format::default());
    ends_rolled(&case("22/swapped_columns.csv").unwrap(), Format::default());
    let without = case("22/no_header.csv").unwrap();
    let message = estimates(&without, Format::default()).unwrap_err();
    assert!(message.contains("no header") && message.contains("--columns"), "{message}");
    let named = ["t_s", "ax", "ay", "az", "gx", "gy", "gz"].map(str::to_owned).to_vec();
    ends_rolled(&without, Format { columns: Some(named), ..Format::default() });
}

#[test]
fn units_are_found_from_the_data() {
    let Some(degrees) = case("19/deg_per_s.csv") else { return };
    for (text, words) in [
        (&degrees, vec!["0.01745", "--rate-unit deg/s"]),
        (&case("19/g_units.csv").unwrap(), vec!["9.80665", "--acceleration-unit g"]),
        (&case("19/milli_g_mdps.csv").unwrap(), vec!["--acceleration-unit mg", "--rate-unit mdps"]),
        (&case("21/gyro_clockwise.csv").unwrap(), vec!["k = -1.0", "clockwise", "mirrored"]),
        (&case("21/mirrored_y.csv").unwrap(), vec!["k = -1.0", "clockwise", "mirrored"]),
    ] {
        let mistakes = estimates(text, Format::default()).unwrap().1.mistakes.join("; ");
        assert!(words.iter().all(|word| mistakes.contains(word)), "{mistakes}");
    }
    ends_rolled(&degrees, Format { rate: Some(RATES[1]), ..Format::default() });
    let milli = case("19/milli_g_mdps.csv").unwrap();
    ends_rolled(
        &milli,
        Format { rate: Some(RATES[2]), acceleration: Some(ACCELERATIONS[2]), ..Format::default() },
    );
}

#[test]
fn the_sign_of_gravity_is_an_option() {
    let Some(text) = case("20/gravity_down.csv") else { return };
    ends_rolled(&text, Format { reports_gravity: true, ..Format::default() });
    let (_, verdict) = estimates(&text, Format::default()).unwrap();
    assert!(verdict.mistakes.is_empty(), "the data cannot tell it: {verdict:?}");
}

#[test]
fn stamps_that_repeat_keep_their_time() {
    let Some(text) = case("24/duplicates.csv") else { return };
    let (instants, _) = estimates(&text, Format::default()).unwrap();
    assert!((heading(instants.last().unwrap()) - 1.0).abs() < 1e-3, "{}", heading(instants.last().unwrap()));
    assert!(instants.iter().filter(|it| it.events.duplicate).count() > 100);
}

#[test]
fn breaks_of_the_clock_hold_the_state() {
    let Some(jump) = case("25/clock_jump.csv") else { return };
    for (text, name) in [
        (jump, "jump"),
        (case("25/backwards.csv").unwrap(), "backwards"),
        (case("25/gap_1s.csv").unwrap(), "gap"),
    ] {
        let (instants, _) = estimates(&text, Format::default()).unwrap();
        let at = instants.iter().position(|it| it.events.names().contains(&name)).unwrap();
        let [before, after] =
            [at - 1, at].map(|at| (heading(&instants[at]), instants[at].estimate.sd_heading));
        assert!((after.0 - before.0).abs() < 0.003, "{name}: held, {before:?} {after:?}");
        assert!(after.1 > before.1 + 0.1, "{name}: the deviation grows, {before:?} {after:?}");
        // At rest: the truth is heading 0, upright, all the time.
        let wrong = |it: &&Instant| heading(it).abs() > 2.0 * it.estimate.sd_heading + 1e-3;
        assert_eq!(instants.iter().filter(wrong).count(), 0, "{name}");
        assert!(instants.iter().all(|it| it.estimate.orientation[0].abs() > 0.999), "{name}");
    }
}

/// A table of a motion: at each instant the true rate in rad/s; its orientations too.
fn motion(
    steps: u32,
    dt: f64,
    rate: impl Fn(f64) -> Vector,
    sensed: impl Fn(u32, Vector, Vector) -> Option<(Vector, Vector)>,
) -> (String, Vec<[f64; 4]>) {
    let mut text = "t_s,gx,gy,gz,ax,ay,az\n".to_owned();
    let (mut orientation, mut truth) = ([1.0, 0.0, 0.0, 0.0], Vec::new());
    for step in 0..steps {
        let time = f64::from(step) * dt;
        let now = if step == 0 { [0.0; 3] } else { rate(time - 0.5 * dt) };
        orientation = rotation::product(orientation, rotation::from_vector(now.map(|rate| dt * rate)));
        let force =
            rotation::apply(&rotation::transposed(&rotation::matrix(orientation)), [0.0, 0.0, 9.80665]);
        if let Some((gyro, force)) = sensed(step, now, force) {
            let [a, b, c] = gyro;
            let [x, y, z] = force;
            writeln!(text, "{time:.6},{a},{b},{c},{x},{y},{z}").unwrap();
            truth.push(orientation);
        }
    }
    (text, truth)
}

/// The angle between an estimate and the truth, and the deviation of the estimate, rad.
fn error(instant: &Instant, truth: [f64; 4]) -> (f64, f64) {
    let q = instant.estimate.orientation;
    let cosine = q.iter().zip(truth).map(|(a, b)| a * b).sum::<f64>().abs().min(1.0);
    let tilt = instant.estimate.sd_gravity.iter().map(|sd| (sd / 9.8).powi(2)).sum::<f64>();
    (2.0 * cosine.acos(), (tilt + instant.estimate.sd_heading.powi(2)).sqrt())
}

#[test]
fn a_lost_stretch_while_turning_is_covered() {
    let rate = |time: f64| [0.0, 0.2 * (3.0 * time).sin(), 0.8 + 0.3 * (2.0 * time).sin()];
    let (text, truth) =
        motion(1000, 0.01, rate, |step, gyro, force| (!(400..480).contains(&step)).then_some((gyro, force)));
    let (instants, _) = estimates(&text, Format::default()).unwrap();
    assert_eq!(instants.iter().filter(|it| it.events.gap).count(), 1);
    for (instant, truth) in instants.iter().zip(&truth) {
        let (error, deviation) = error(instant, *truth);
        assert!(error < 3.0 * deviation + 0.01, "row {}: {error} {deviation}", instant.number);
    }
    assert!(error(&instants[500], truth[500]).1 > 0.3, "the deviation stays");
}

#[test]
fn clipped_rates_are_flagged_and_covered() {
    let noise = |step: u32| 0.002 * (f64::from(step * step) * 0.37).sin();
    let rate = |time: f64| [0.0, 0.0, 6.0 * (2.0 * time).sin()];
    let (text, truth) = motion(600, 0.01, rate, |step, gyro, force| {
        Some(([0.0, 0.0, (gyro[2] + noise(step)).clamp(-4.36, 4.36)], force))
    });
    let (instants, _) = estimates(&text, Format::default()).unwrap();
    let clipped = instants.iter().filter(|it| it.events.clipped_rate).count();
    // |6 sin 2t| > 4.36 four times for 0.757 s, but for the first readings of the first plateau.
    assert!((290..=303).contains(&clipped), "{clipped}");
    let errors: Vec<(f64, f64)> = instants.iter().zip(&truth).map(|(it, truth)| error(it, *truth)).collect();
    assert!(errors.iter().map(|it| it.0).fold(0.0, f64::max) > 0.3, "the estimate is wrong");
    let wrong = errors.iter().filter(|(error, deviation)| *error > 2.0 * deviation + 0.02).count();
    assert!(wrong < 20, "and says so: {wrong}");
}

#[test]
fn sensors_in_rows_of_their_own_and_missing_readings() {
    let rate = |time: f64| [0.5 * (2.0 * time).sin(), 0.0, 0.3];
    let (whole, truth) = motion(800, 0.005, rate, |_, gyro, force| Some((gyro, force)));
    let mut text = String::new();
    for (number, line) in whole.lines().enumerate() {
        let cells: Vec<&str> = line.split(',').collect();
        match number {
            0 => writeln!(text, "{line}").unwrap(),
            300 => writeln!(
                text,
                "{},nan,{},{},{},{},{}",
                cells[0], cells[2], cells[3], cells[4], cells[5], cells[6]
            )
            .unwrap(),
            _ => {
                writeln!(text, "{},{},{},{},,,", cells[0], cells[1], cells[2], cells[3]).unwrap();
                let time: f64 = cells[0].parse().unwrap();
                writeln!(text, "{:.6},,,,{},{},{}", time + 0.001, cells[4], cells[5], cells[6]).unwrap();
            }
        }
    }
    let (instants, verdict) = estimates(&text, Format::default()).unwrap();
    assert!(verdict.mistakes.is_empty());
    let (error, _) = error(instants.last().unwrap(), truth[799]);
    assert!(error < 0.02, "{error}");
    assert!(
        instants.iter().filter(|it| it.events.no_rate).count() == 800,
        "799 rows of the accelerometer, and the nan"
    );
    assert_eq!(instants.iter().filter(|it| it.events.gap).count(), 0);
}

#[test]
fn slow_and_fast_sensors() {
    for (dt, steps) in [(0.1, 200), (0.0001, 30_000)] {
        let rate = |time: f64| [0.4 * (1.5 * time).sin(), 0.3 * time.cos(), 0.1];
        let (text, truth) = motion(steps, dt, rate, |_, gyro, force| Some((gyro, force)));
        let (instants, verdict) = estimates(&text, Format::default()).unwrap();
        assert!(verdict.mistakes.is_empty() && (verdict.k.unwrap() - 1.0).abs() < 0.05, "{verdict:?}");
        let (error, _) = error(instants.last().unwrap(), *truth.last().unwrap());
        assert!(error < 0.02, "{dt}: {error}");
    }
}

#[test]
fn a_gyroscope_at_rest_shows_its_bias() {
    let (text, _) = motion(
        3000,
        0.01,
        |_| [0.0; 3],
        |step, _, force| {
            let noise = 0.0015 * (f64::from(step * 7919 % 1000) / 500.0 - 1.0);
            Some(([0.004 + noise, -0.003 - noise, 0.01], force))
        },
    );
    let (instants, _) = estimates(&text, Format::default()).unwrap();
    let last = instants.last().unwrap();
    assert!(last.events.rest);
    assert!(last.estimate.rate.iter().all(|rate| rate.abs() < 0.002), "{:?}", last.estimate.rate);
    // Without the bias 0.01 rad/s would turn by 0.3 rad in 30 s.
    assert!(
        heading(last).abs() < 0.01 && heading(last).abs() < 3.0 * last.estimate.sd_heading,
        "{}",
        heading(last)
    );
}
