//! Recorded motions with optical truth: four trials of BROAD (Laidig et al., *Data* 6:72, 2021, CC BY 4.0).
//!
//! In: `shared/data/imu`, where it is there. Out: errors of inclination and of the whole orientation over the movement, the heading
//! aligned at its start, beside those of VQF without magnetometer on the same trials (Laidig and Seel, *Information Fusion* 91, 2023;
//! `vqf` 2.1.2 from Python): 0.54° and 1.48° on average.

use super::shared;
use bvm::vestibular::reader::Row;
use bvm::vestibular::{Settings, Stream, rotation};

const TRIALS: [&str; 4] = [
    "02_undisturbed_slow_rotation_B",
    "06_undisturbed_fast_rotation_A",
    "16_undisturbed_fast_translation_B",
    "25_disturbed_tapping_B",
];

/// Root mean square errors of inclination and orientation, degrees, and how often the truth lies in the 90 % regions of
/// inclination and heading.
struct Score {
    inclination: f64,
    total: f64,
    covered: [f64; 2],
    k: f64,
}

fn score(numbers: &[f64]) -> Score {
    let mut stream = Stream::new(Settings::default());
    let (mut aligned, mut squares, mut inside, mut count) = (None, [0.0; 2], [0.0; 2], 0.0);
    for (number, row) in numbers.chunks_exact(17).enumerate() {
        let time = (number as f64 * 1e9 / 285.714_285_714_285_7).round() as i64;
        let (rate, force) = (Some([row[0], row[1], row[2]]), Some([row[3], row[4], row[5]]));
        let instants = stream.feel(Row { number: number as u64 + 2, time, rate, force }).unwrap();
        let [instant] = instants.as_slice() else { panic!("a row for a row") };
        if row[16] < 0.5 || !row[9].is_finite() {
            continue;
        }
        let truth = [row[9], -row[10], -row[11], -row[12]];
        let difference = rotation::product(instant.estimate.orientation, truth);
        let variance = stream.filter().rotation_covariance();
        let (turn, variance_then) =
            *aligned.get_or_insert((2.0 * difference[3].atan2(difference[0]), variance[2][2]));
        let [w, x, y, z] = rotation::product(rotation::from_vector([0.0, 0.0, -turn]), difference);
        let [w, x, y, z] = if w < 0.0 { [-w, -x, -y, -z] } else { [w, x, y, z] };
        squares[0] += (2.0 * w.hypot(z).min(1.0).acos()).powi(2);
        squares[1] += (2.0 * w.min(1.0).acos()).powi(2);
        let level = stream.filter().level().powi(2);
        let [a, b, c] = [variance[0][0] + level, variance[0][1], variance[1][1] + level];
        let (x, y) = (2.0 * x, 2.0 * y);
        // Two dimensions: χ² of 90 % is 4.605; one: 1.645².
        inside[0] += f64::from((c * x * x - 2.0 * b * x * y + a * y * y) / (a * c - b * b) < 4.605);
        let heading = 2.0 * z.atan2(w);
        inside[1] += f64::from(heading * heading < 2.706 * (variance[2][2] - variance_then + 1e-7));
        count += 1.0;
    }
    let [inclination, total] = squares.map(|sum: f64| (sum / count).sqrt().to_degrees());
    let k = stream.verdict([false; 3]).k.unwrap_or(f64::NAN);
    Score { inclination, total, covered: inside.map(|inside: f64| inside / count), k }
}

#[test]
fn four_trials_of_broad() {
    let Some(folder) = shared("data/imu") else { return };
    let scores = TRIALS.map(|trial| {
        let bytes = std::fs::read(folder.join(format!("broad_{trial}.f32"))).unwrap();
        let number = |four: &[u8]| f64::from(f32::from_le_bytes(four.try_into().unwrap()));
        let score = score(&bytes.chunks_exact(4).map(number).collect::<Vec<f64>>());
        println!(
            "{trial}: inclination {:.3}, total {:.3}, covered {:.2} and {:.2}, k {:.3}",
            score.inclination, score.total, score.covered[0], score.covered[1], score.k
        );
        score
    });
    let mean = |of: fn(&Score) -> f64| scores.iter().map(of).sum::<f64>() / 4.0;
    let [inclination, total] = [mean(|it| it.inclination), mean(|it| it.total)];
    let covered = [mean(|it| it.covered[0]), mean(|it| it.covered[1])];
    println!("mean: inclination {inclination:.3}, total {total:.3}, covered {covered:.3?}");
    assert!(inclination <= 0.54 && total <= 1.48, "{inclination} {total}");
    assert!(covered.iter().all(|covered| (0.85..=0.95).contains(covered)), "{covered:?}");
    assert!(scores.iter().all(|it| it.k.is_nan() || (0.8..1.25).contains(&it.k)));
}
