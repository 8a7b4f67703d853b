//! The pictures of docs/hearing.md.
//!
//! In: calibrations, cases and their outcomes. Out: PNG files. Invariant: figures of other programs are those of the reference
//! runs that docs/hearing.md names.

use crate::score::{Case, Outcome, Summary, summary};
use bvm::audition::sphere::{HEAD_RADIUS_M, SOUND_SPEED_M_S};
use bvm::audition::{Calibration, Listening};
use bvm::report::{Heat, Line, Picture, heat, lines};
use std::error::Error;
use std::path::Path;

/// Frontal azimuth RMS of other programs on the same head at 20, 10 and 0 dB, degrees.
const PEERS_DEG: [(&str, [f64; 3]); 3] = [
    ("GCC-PHAT, Woodworth", [4.6, 4.9, 5.2]),
    ("SRP-PHAT (pyroomacoustics)", [4.9, 5.2, 6.7]),
    ("NormMUSIC (pyroomacoustics)", [6.8, 6.7, 6.8]),
];
/// Front–back errors over the sphere of a template matcher with coherent moments, percent.
const TEMPLATE_PERCENT: [f64; 3] = [2.3, 2.3, 25.0];
const RATIOS_DB: [f64; 3] = [20.0, 10.0, 0.0];
/// Rows and columns of a panorama, two degrees each.
const PANORAMA: [usize; 2] = [90, 180];
const CIRCLE_DEG: [f64; 9] = [180.0, 135.0, 90.0, 45.0, 0.0, -45.0, -90.0, -135.0, -180.0];
const HEIGHTS_DEG: [f64; 5] = [-90.0, -45.0, 0.0, 45.0, 90.0];

/// The time differences of the horizontal plane beside the formulas of Kuhn (below 1.5 kHz) and Woodworth (above).
pub(crate) fn itd(calibration: &Calibration, path: &Path) -> Result<(), Box<dyn Error>> {
    let mean_us = |within: std::ops::Range<f64>, cues: &[f64]| {
        let chosen = calibration.centres_hz.iter().zip(cues).filter(|(centre, _)| within.contains(centre));
        let (sum, count) = chosen.fold((0.0, 0.0), |(sum, count), (_, itd)| (sum + itd, count + 1.0));
        sum / count
    };
    let of = |within: std::ops::Range<f64>| -> Vec<(f64, f64)> {
        let plane = calibration.directions.iter().filter(|one| one.elevation_deg.abs() < 0.1);
        let ahead = plane.filter(|one| one.azimuth_deg.abs() <= 90.0);
        let mut points: Vec<(f64, f64)> =
            ahead.map(|one| (one.azimuth_deg, mean_us(within.clone(), &one.cues.itd_us))).collect();
        points.sort_by(|one, other| one.0.total_cmp(&other.0));
        points
    };
    let unit_us = 1e6 * HEAD_RADIUS_M / SOUND_SPEED_M_S;
    let formula = |value: &dyn Fn(f64) -> f64| -> Vec<(f64, f64)> {
        (-90..=90)
            .map(|degrees| (f64::from(degrees), unit_us * value(f64::from(degrees).to_radians())))
            .collect()
    };
    let curve = |name: &str, points| Line { name: name.to_owned(), points };
    let curves = [
        curve("calibrated, 200 to 700 Hz", of(200.0..700.0)),
        curve("Kuhn: 3 (a/c) sin θ", formula(&|angle| 3.0 * angle.sin())),
        curve("calibrated, 3 to 15 kHz", of(3000.0..15_001.0)),
        curve("Woodworth: (a/c) (θ + sin θ)", formula(&|angle| angle + angle.sin())),
    ];
    let names = ["azimuth in degrees (positive to the left)", "time difference in µs"];
    lines("Interaural time difference, a = 8.75 cm", names, [[-90.0, 90.0], [-900.0, 900.0]], &curves)
        .write(path)?;
    Ok(())
}

fn rows<'a>(all: &'a [Summary], set: &'a str, is_noise: bool) -> impl Iterator<Item = &'a Summary> + 'a {
    all.iter().filter(move |row| row.set == set && row.is_noise == is_noise)
}

/// Azimuth RMS, and front–back errors, over the ratio of signal to noise.
pub(crate) fn over_noise(cases: &[Case], outcomes: &[Outcome], path: &Path) -> Result<(), Box<dyn Error>> {
    let all = summary(cases, outcomes);
    let names = ["signal to noise in dB", "azimuth RMS in degrees"];
    let own = |name: &str, set, is_noise, value: fn(&Summary) -> f64| Line {
        name: name.to_owned(),
        points: rows(&all, set, is_noise).map(|row| (row.snr_db, value(row))).collect(),
    };
    let of_others = |name: &str, values: [f64; 3]| Line {
        name: name.to_owned(),
        points: RATIOS_DB.iter().copied().zip(values).rev().collect(),
    };
    let rms = |row: &Summary| row.azimuth_rms_deg;
    let mut curves = vec![
        own("bvm, own head, voices", "front", false, rms),
        own("bvm, own head, noise", "front", true, rms),
        own("bvm, another head, voices", "other", false, rms),
        own("bvm, another head in a room, voices", "room", false, rms),
    ];
    curves.extend(PEERS_DEG.iter().map(|(name, values)| of_others(name, *values)));
    curves.iter_mut().for_each(|curve| curve.points.sort_by(|one, other| one.0.total_cmp(&other.0)));
    let azimuth = lines("Azimuth of frontal sounds", names, [[0.0, 20.0], [0.0, 14.0]], &curves);
    let exchanged = |row: &Summary| row.exchanged_percent;
    let mut curves = vec![
        own("bvm, voices", "sphere", false, exchanged),
        own("bvm, noise", "sphere", true, exchanged),
        own("bvm, voices, head turns by 20°", "turned", false, exchanged),
        own("bvm, noise, head turns by 20°", "turned", true, exchanged),
        of_others("templates", TEMPLATE_PERCENT),
    ];
    curves.iter_mut().for_each(|curve| curve.points.sort_by(|one, other| one.0.total_cmp(&other.0)));
    let names = ["signal to noise in dB", "front–back errors in %"];
    let sides = lines("Front and back, all directions", names, [[0.0, 20.0], [0.0, 50.0]], &curves);
    Picture::stacked(&[azimuth, sides]).write(path)?;
    Ok(())
}

/// The stated probability that a source is within 10 degrees, and how often it was.
pub(crate) fn reliability(outcomes: &[Outcome], path: &Path) -> Result<(), Box<dyn Error>> {
    let mut points = Vec::new();
    for tenth in 0..10 {
        let inside = |one: &&Outcome| (10.0 * one.stated.0).min(9.999) as usize == tenth;
        let row: Vec<&Outcome> = outcomes.iter().filter(inside).collect();
        if row.len() >= 5 {
            let count = row.len() as f64;
            let there = row.iter().filter(|one| one.stated.1).count() as f64 / count;
            points.push((row.iter().map(|one| one.stated.0).sum::<f64>() / count, there));
        }
    }
    let curves = [
        Line { name: "bvm, all cases".to_owned(), points },
        Line { name: "calibrated".to_owned(), points: vec![(0.0, 0.0), (1.0, 1.0)] },
    ];
    let names =
        ["stated probability of a source within 10 degrees", "share of the cases with a source there"];
    lines("Reliability of the posterior", names, [[0.0, 1.0], [0.0, 1.0]], &curves).write(path)?;
    Ok(())
}

/// The true and the most probable distances of near sources.
pub(crate) fn distances(
    cases: &[Case],
    outcomes: &[Outcome],
    found_m: &[f64],
    path: &Path,
) -> Result<(), Box<dyn Error>> {
    let mut true_m: Vec<f64> =
        cases.iter().filter(|case| case.set == "near").map(|case| case.place.rho_m).collect();
    true_m.sort_by(f64::total_cmp);
    true_m.dedup();
    let mut pictures = Vec::new();
    for snr_db in RATIOS_DB {
        let mut table = vec![0.0; true_m.len() * found_m.len()];
        for (case, outcome) in cases.iter().zip(outcomes) {
            let row = true_m.iter().position(|own| *own == case.place.rho_m);
            let column = found_m.iter().position(|own| *own == outcome.distance_m);
            if let (true, Some((row, column))) =
                (case.set == "near" && case.snr_db == snr_db, row.zip(column))
            {
                table[row * found_m.len() + column] += 1.0;
            }
        }
        for row in table.chunks_mut(found_m.len()) {
            let total: f64 = row.iter().sum();
            row.iter_mut().for_each(|value| *value /= total.max(1.0));
        }
        let metres = |all: &[f64]| all.iter().map(f64::to_string).collect::<Vec<_>>().join(", ");
        pictures.push(heat(&Heat {
            title: &format!("Distance of near sources at {snr_db} dB"),
            names: [
                &format!("most probable distance: {} m", metres(found_m)),
                &format!("true distance: {} m", metres(&true_m)),
            ],
            across: [0.0, found_m.len() as f64],
            upwards: [0.0, true_m.len() as f64],
            columns: found_m.len(),
            values: &table,
            quantity: "share of the row",
            ticks: [&[0.5, 1.5, 2.5, 3.5, 4.5, 5.5][..found_m.len().min(6)], &[]],
        })?);
    }
    Picture::stacked(&pictures).write(path)?;
    Ok(())
}

/// Posteriors of the direction, one above the other.
pub(crate) fn panoramas(looks: &[(&str, &Listening)], path: &Path) -> Result<(), Box<dyn Error>> {
    let picture = |(title, listening): &(&str, &Listening)| {
        heat(&Heat {
            title,
            names: ["azimuth in degrees (positive to the left)", "elevation in degrees"],
            across: [180.0, -180.0],
            upwards: [-90.0, 90.0],
            columns: PANORAMA[1],
            values: &listening.pictured(PANORAMA).0,
            quantity: "probability per square degree",
            ticks: [&CIRCLE_DEG, &HEIGHTS_DEG],
        })
    };
    Picture::stacked(&looks.iter().map(picture).collect::<Result<Vec<_>, _>>()?).write(path)?;
    Ok(())
}
