//! Orientation filters on recorded motion: ours beside VQF, Madgwick and Mahony.
//!
//! In: trials of BROAD (Laidig et al., *Data* 6:72, 2021) in `../shared/data/imu`, where they are there. Out: for each filter and
//! trial the root mean square errors of inclination and of the whole orientation over the movement, the heading aligned at
//! its start, without magnetometer; and the time of a sample, best of five runs. With `--figures DIR`, the pictures of
//! `docs/balance.md`, which show the heading apart. The peers are the crates `vqf-rs` (defaults) and `ahrs` (Madgwick with β = 0.12, Mahony with its defaults
//! of the publication of BROAD, kp = 0.74 and ki = 0.0012).
//!
//! ```sh
//! cargo bench -p bvm --bench balance -- --figures docs/images
//! ```

mod figures;

use ahrs::Ahrs;
use bvm::vestibular::inertial::Inertial;
use bvm::vestibular::reader::Row;
use bvm::vestibular::rotation::{self, Quaternion, Vector};
use bvm::vestibular::{Noise, Settings, Stream};
use std::error::Error;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::Instant;

const TRIALS: [&str; 4] = [
    "02_undisturbed_slow_rotation_B",
    "06_undisturbed_fast_rotation_A",
    "16_undisturbed_fast_translation_B",
    "25_disturbed_tapping_B",
];
/// Numbers in a row: gyroscope, accelerometer, magnetometer, truth (quaternion, position), movement.
const COLUMNS: usize = 17;
const RATE_HZ: f64 = 2000.0 / 7.0;
const RUNS: usize = 5;

/// One sample of a trial.
struct Sample {
    rate: Vector,
    force: Vector,
    /// From the sensor to the world, where it was measured while the sensor moved.
    truth: Option<Quaternion>,
}

fn read(path: &Path) -> Result<Vec<Sample>, Box<dyn Error>> {
    let bytes = std::fs::read(path)?;
    let numbers: Vec<f64> = (bytes.chunks_exact(4))
        .map(|four| Ok(f64::from(f32::from_le_bytes(four.try_into()?))))
        .collect::<Result<_, Box<dyn Error>>>()?;
    let sample = |row: &[f64]| Sample {
        rate: [row[0], row[1], row[2]],
        force: [row[3], row[4], row[5]],
        truth: (row[16] > 0.5 && row[9].is_finite()).then(|| [row[9], row[10], row[11], row[12]]),
    };
    Ok(numbers.chunks_exact(COLUMNS).map(sample).collect())
}

/// A filter: the orientation after each sample.
type Filter = fn(&[Sample]) -> Vec<Quaternion>;

fn ours(samples: &[Sample]) -> Vec<Quaternion> {
    let mut stream = Stream::new(Settings::default());
    let mut found = Vec::with_capacity(samples.len());
    for (number, sample) in samples.iter().enumerate() {
        let row = row_of(number, sample.rate, sample.force);
        if let Ok(instants) = stream.feel(row) {
            found.extend(instants.iter().map(|one| one.estimate.orientation));
        }
    }
    found
}

fn row_of(number: usize, rate: Vector, force: Vector) -> Row {
    let time = (number as f64 * 1e9 / RATE_HZ).round() as i64;
    Row { number: number as u64 + 2, time, rate: Some(rate), force: Some(force) }
}

/// The filter alone, without the tests of the readings, of rest and of the clock.
fn bare(samples: &[Sample]) -> Vec<Quaternion> {
    let mut filter = Inertial::new(Noise::default(), 0.0);
    let one = |sample: &Sample| {
        filter.turn(sample.rate, 0.0, 1.0 / RATE_HZ);
        filter.push(sample.force, 1.0 / RATE_HZ);
        filter.orientation()
    };
    samples.iter().map(one).collect()
}

/// The same with the deviations of all that is estimated.
fn with_deviations(samples: &[Sample]) -> Vec<Quaternion> {
    let mut filter = Inertial::new(Noise::default(), 0.0);
    let one = |sample: &Sample| {
        filter.turn(sample.rate, 0.0, 1.0 / RATE_HZ);
        filter.push(sample.force, 1.0 / RATE_HZ);
        black_box(filter.estimate()).orientation
    };
    samples.iter().map(one).collect()
}

fn vqf(samples: &[Sample]) -> Vec<Quaternion> {
    let mut filter = vqf_rs::VQF::new(1.0 / RATE_HZ, None, None, None);
    let one = |sample: &Sample| {
        filter.update(sample.rate, sample.force, None);
        let vqf_rs::Quaternion(w, x, y, z) = filter.quat_6d();
        [w, x, y, z]
    };
    samples.iter().map(one).collect()
}

/// A filter of the crate `ahrs`; one that refuses a sample stays where it is.
fn of_ahrs<F: Ahrs<f64>>(mut filter: F, samples: &[Sample]) -> Vec<Quaternion> {
    let mut now = [1.0, 0.0, 0.0, 0.0];
    let one = |sample: &Sample| {
        if let Ok(q) = filter.update_imu(&sample.rate.into(), &sample.force.into()) {
            now = [q.w, q.i, q.j, q.k];
        }
        now
    };
    samples.iter().map(one).collect()
}

fn madgwick(samples: &[Sample]) -> Vec<Quaternion> {
    of_ahrs(ahrs::Madgwick::new(1.0 / RATE_HZ, 0.12), samples)
}

fn mahony(samples: &[Sample]) -> Vec<Quaternion> {
    of_ahrs(ahrs::Mahony::new(1.0 / RATE_HZ, 0.74, 0.0012), samples)
}

const FILTERS: [(&str, Filter); 6] = [
    ("ours", ours),
    ("ours, filter alone", bare),
    ("ours, with deviations", with_deviations),
    ("vqf-rs", vqf),
    ("ahrs Madgwick", madgwick),
    ("ahrs Mahony", mahony),
];

/// Root mean square errors of inclination, of heading, and of the whole orientation, degrees.
fn errors(samples: &[Sample], found: &[Quaternion]) -> [f64; 3] {
    let (mut aligned, mut squares, mut count) = (None, [0.0; 3], 0.0);
    for (sample, q) in samples.iter().zip(found) {
        let Some([w, x, y, z]) = sample.truth else { continue };
        let difference = rotation::product(*q, [w, -x, -y, -z]);
        let turn = *aligned.get_or_insert(2.0 * difference[3].atan2(difference[0]));
        let [w, _, _, z] = rotation::product(rotation::from_vector([0.0, 0.0, -turn]), difference);
        squares[0] += (2.0 * w.hypot(z).min(1.0).acos()).powi(2);
        squares[1] += (2.0 * (z * w.signum()).atan2(w.abs())).powi(2);
        squares[2] += (2.0 * w.abs().min(1.0).acos()).powi(2);
        count += 1.0;
    }
    squares.map(|sum: f64| (sum / count).sqrt().to_degrees())
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/imu");
    let mut trials = Vec::new();
    for name in TRIALS {
        let path = folder.join(format!("broad_{name}.f32"));
        if !path.exists() {
            println!("skipped: {} is not there", path.display());
            return Ok(());
        }
        trials.push(read(&path)?);
    }
    println!("Root mean square errors in degrees: inclination / whole orientation");
    println!("filter                  trial 02     06           16           25           ns");
    let mut all = Vec::new();
    for (name, filter) in FILTERS {
        let errors: Vec<[f64; 3]> = trials.iter().map(|samples| errors(samples, &filter(samples))).collect();
        let cell = |[inclination, _, total]: &[f64; 3]| format!("{inclination:.2} / {total:<6.2}");
        let cells: Vec<String> = errors.iter().map(cell).collect();
        all.push((name, errors));
        let best = (0..RUNS)
            .map(|_| {
                let begun = Instant::now();
                black_box(filter(black_box(&trials[0])));
                begun.elapsed().as_secs_f64() * 1e9 / trials[0].len() as f64
            })
            .fold(f64::INFINITY, f64::min);
        println!("{name:22} {} {best:5.0}", cells.join(" "));
    }
    let mut arguments = std::env::args().skip_while(|word| word != "--figures");
    if let Some(folder) = arguments.nth(1).map(PathBuf::from) {
        figures::bars_of(&all).write(&folder.join("balance_broad.png"))?;
        figures::draw([&trials[0], &trials[1]], &folder)?;
        figures::felt().write(&folder.join("balance_felt.png"))?;
    }
    Ok(())
}
