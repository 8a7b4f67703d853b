//! Scores of cases.
//!
//! In: the truth of a case, and what was found. Out: a row of the table for each set, kind of sound and ratio.
//! Invariant: a case without a source counts as straight ahead and as not covered.

use bvm::audition::Found;
use bvm::frame::{Spherical, great_circle, wrap_angle};
use std::collections::BTreeMap;

/// Directions within this of the plane through the ears have no front and back: the cosine.
const SIDEWAYS: f64 = 0.26;

/// What is asked of one case.
#[derive(Clone)]
pub(crate) struct Case {
    pub(crate) set: &'static str,
    pub(crate) place: Spherical,
    /// The number of its sound, and whether that is noise.
    pub(crate) sound: usize,
    pub(crate) is_noise: bool,
    pub(crate) snr_db: f64,
    pub(crate) seed: u64,
}

/// How one case came out.
pub(crate) struct Outcome {
    azimuth_error_deg: f64,
    great_circle_deg: f64,
    is_covered: bool,
    /// Whether front and back were exchanged; `None` where there is no front and back.
    exchanged: Option<bool>,
    is_distance: bool,
    /// The most probable distance, m; 0 if there was no source.
    pub(crate) distance_m: f64,
    /// The probability that was stated, and whether the source was within 10 degrees.
    pub(crate) stated: (f64, bool),
}

impl Outcome {
    pub(crate) fn of(place: Spherical, found: &Found) -> Outcome {
        let Some(first) = found.sources.first() else {
            let away = great_circle((0.0, 0.0), (place.azimuth, place.elevation)).to_degrees();
            return Outcome {
                azimuth_error_deg: place.azimuth.to_degrees(),
                great_circle_deg: away,
                is_covered: false,
                exchanged: None,
                is_distance: false,
                distance_m: 0.0,
                stated: (0.0, false),
            };
        };
        let [azimuth, elevation] = [first.azimuth_deg, first.elevation_deg].map(f64::to_radians);
        let truth = place.azimuth.cos() * place.elevation.cos();
        let within = |value: f64, [low, high]: [f64; 2]| {
            [-360.0, 0.0, 360.0].iter().any(|turn| (low - 1e-9..=high + 1e-9).contains(&(value + turn)))
        };
        let is_covered = first.region90.iter().any(|one| {
            within(place.azimuth.to_degrees(), one.azimuth_deg)
                && within(place.elevation.to_degrees(), one.elevation_deg)
        });
        let away = great_circle((azimuth, elevation), (place.azimuth, place.elevation)).to_degrees();
        Outcome {
            azimuth_error_deg: wrap_angle(azimuth - place.azimuth).to_degrees(),
            great_circle_deg: away,
            is_covered: is_covered || found.flat,
            exchanged: (truth.abs() > SIDEWAYS).then(|| truth * azimuth.cos() * elevation.cos() < 0.0),
            is_distance: (first.distance_m / place.rho_m).ln().abs() < 1e-6,
            distance_m: first.distance_m,
            stated: (first.probability, away <= 10.0),
        }
    }
}

/// A row of the table.
pub(crate) struct Summary {
    pub(crate) set: &'static str,
    pub(crate) is_noise: bool,
    pub(crate) snr_db: f64,
    count: usize,
    pub(crate) azimuth_rms_deg: f64,
    great_circle_deg: f64,
    pub(crate) exchanged_percent: f64,
    covered_percent: f64,
    distance_percent: f64,
}

/// The rows, by set, kind of sound, and falling ratio.
pub(crate) fn summary(cases: &[Case], outcomes: &[Outcome]) -> Vec<Summary> {
    let mut rows: BTreeMap<(&'static str, bool, i64), Vec<&Outcome>> = BTreeMap::new();
    for (case, outcome) in cases.iter().zip(outcomes) {
        rows.entry((case.set, case.is_noise, -case.snr_db as i64)).or_default().push(outcome);
    }
    let row = |((set, is_noise, snr_db), row): ((&'static str, bool, i64), Vec<&Outcome>)| {
        let count = row.len() as f64;
        let share = |test: &dyn Fn(&Outcome) -> bool| {
            100.0 * row.iter().filter(|one| test(one)).count() as f64 / count
        };
        let sided = row.iter().filter(|one| one.exchanged.is_some()).count().max(1) as f64;
        let exchanged = row.iter().filter(|one| one.exchanged == Some(true)).count() as f64;
        Summary {
            set,
            is_noise,
            snr_db: -snr_db as f64,
            count: row.len(),
            azimuth_rms_deg: (row.iter().map(|one| one.azimuth_error_deg.powi(2)).sum::<f64>() / count)
                .sqrt(),
            great_circle_deg: row.iter().map(|one| one.great_circle_deg).sum::<f64>() / count,
            exchanged_percent: 100.0 * exchanged / sided,
            covered_percent: share(&|one| one.is_covered),
            distance_percent: share(&|one| one.is_distance),
        }
    };
    rows.into_iter().map(row).collect()
}

/// The table.
pub(crate) fn table(cases: &[Case], outcomes: &[Outcome]) -> String {
    let mut text =
        "set     sound  dB    n  azimuth RMS  great circle  front-back  90 % holds  distance\n".to_owned();
    for row in summary(cases, outcomes) {
        let distance =
            if row.set == "near" { format!("{:6.1} %", row.distance_percent) } else { String::new() };
        text += &format!(
            "{:7} {:6} {:2} {:4}  {:9.2}°  {:10.2}°  {:8.1} %  {:8.1} %  {distance}\n",
            row.set,
            if row.is_noise { "noise" } else { "voices" },
            row.snr_db,
            row.count,
            row.azimuth_rms_deg,
            row.great_circle_deg,
            row.exchanged_percent,
            row.covered_percent,
        );
    }
    text
}

/// The stated probabilities in tenths, and how often the source was there.
pub(crate) fn reliability(outcomes: &[Outcome]) -> String {
    let mut text = "stated probability  mean    n  within 10°\n".to_owned();
    for tenth in 0..10 {
        let inside = |one: &&Outcome| (10.0 * one.stated.0).min(9.999) as usize == tenth;
        let row: Vec<&Outcome> = outcomes.iter().filter(inside).collect();
        if row.is_empty() {
            continue;
        }
        let count = row.len() as f64;
        let mean = row.iter().map(|one| one.stated.0).sum::<f64>() / count;
        let there = row.iter().filter(|one| one.stated.1).count() as f64 / count;
        let low = tenth as f64 / 10.0;
        text += &format!("{low:.1} to {:.1}          {mean:.3} {count:4}  {there:.3}\n", low + 0.1);
    }
    text
}
