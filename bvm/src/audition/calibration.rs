//! The calibration of hearing: the cues of each direction and band, and how they change with distance.
//!
//! In: a head. Out: `head.json`, readable text: what the front end measures when white noise is played from each
//! direction, and the same for a rigid sphere at several distances. Invariant: time differences of all bands are those
//! of one cycle; a head whose time differences contradict its azimuths is refused.

use super::binaural::independent;
use super::cochlea::{BANDS, centres_hz};
use super::error::AuditionError;
use super::head::{Head, Measured, Responses, lateral_sine};
use super::played::{UNAMBIGUOUS_HZ, played};
use super::sphere;
use crate::error::Error;
use crate::frame::Spherical;
use crate::input;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;

/// The version of the file's format and of the front end whose numbers are in it.
const VERSION: u32 = 2;
/// Most bytes of the file: 16 MiB.
const MOST_BYTES: u64 = 16 << 20;
/// Sampling rate at which the sphere is calibrated, Hz.
const SPHERE_RATE_HZ: f64 = 44_100.0;
/// Distances of sources, m.
const DISTANCES_M: [f64; 6] = [0.25, 0.4, 0.63, 1.0, 1.6, 2.5];
/// Lateral angles of the sphere, from ahead to the left.
const ANGLES: usize = 19;
/// Elevations and azimuths of the directions of a sphere, degrees.
const SPHERE_STEPS: [f64; 2] = [10.0, 5.0];
/// Largest time difference of a head of a human's size, µs.
const LARGEST_ITD_US: [f64; 2] = [400.0, 1000.0];
/// The correlation between the time differences and the sines of the lateral angles of a head as described.
const LEAST_CORRELATION: f64 = 0.8;

/// Where a head comes from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Origin {
    /// A rigid sphere.
    Sphere {
        /// Its radius, m.
        radius_m: f64,
    },
    /// A SOFA file.
    Sofa {
        /// Its path, as given.
        file: String,
        /// FNV-1a of its bytes, 64 bits, in hexadecimal digits.
        checksum: String,
        /// Whether azimuths were counted clockwise, and have been mirrored.
        mirrored: bool,
    },
}

/// Cues of all bands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CueRow {
    /// Time differences, µs, positive when the left ear leads.
    pub itd_us: Vec<f64>,
    /// Level differences, dB, positive when the left ear is louder.
    pub ild_db: Vec<f64>,
    /// The slope of the spectrum of white noise: the power of both ears in the next band, relative to this one, dB.
    pub slope_db: Vec<f64>,
}

/// The cues of a direction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DirectionCues {
    /// Azimuth, degrees, positive to the left.
    pub azimuth_deg: f64,
    /// Elevation, degrees, positive upwards.
    pub elevation_deg: f64,
    /// The cues.
    #[serde(flatten)]
    pub cues: CueRow,
}

/// How cues change with distance: those of a sphere.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DistanceLaw {
    /// The distance at which the directions were calibrated, m.
    pub reference_m: f64,
    /// Distances of sources, m, ascending.
    pub distances_m: Vec<f64>,
    /// For each distance the cues at lateral angles in equal steps from 0 (ahead) to 90 degrees (left).
    pub rows: Vec<Vec<CueRow>>,
}

/// The calibration of hearing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    version: u32,
    /// Where the head comes from.
    pub head: Origin,
    /// Centre frequencies of the bands, Hz.
    pub centres_hz: Vec<f64>,
    /// Coherence of independent noises in each band.
    pub independent: Vec<f64>,
    /// The directions.
    pub directions: Vec<DirectionCues>,
    /// The law of distance.
    pub distance: DistanceLaw,
}

impl Calibration {
    /// Measures a head.
    ///
    /// # Errors
    /// A head whose time differences contradict its azimuths, or are not those of a head.
    pub fn of(head: &Head, origin: Origin) -> Result<Calibration, Error> {
        let independent = independent();
        let radius_m = match head {
            Head::Sphere(radius_m) => *radius_m,
            Head::Measured(_) => sphere::HEAD_RADIUS_M,
        };
        let sphere = Head::Sphere(radius_m);
        let rows = DISTANCES_M
            .par_iter()
            .map(|distance| {
                let at = |index: usize| {
                    let azimuth = FRAC_PI_2 * index as f64 / (ANGLES - 1) as f64;
                    let place = Spherical { rho_m: *distance, azimuth, elevation: 0.0 };
                    played(&sphere.responses(place, SPHERE_RATE_HZ).0, SPHERE_RATE_HZ, &independent)
                };
                (0..ANGLES).into_par_iter().map(at).collect()
            })
            .collect::<Result<Vec<Vec<CueRow>>, Error>>()?;
        let mut distance =
            DistanceLaw { reference_m: DISTANCES_M[5], distances_m: DISTANCES_M.to_vec(), rows };
        let directions = match head {
            Head::Sphere(_) => sphere_directions(&distance),
            Head::Measured(responses) => {
                let mut distances: Vec<f64> = responses.measured.iter().map(|one| one.place.rho_m).collect();
                distances.sort_by(f64::total_cmp);
                distance.reference_m = distances.get(distances.len() / 2).copied().unwrap_or(DISTANCES_M[5]);
                check(measured_directions(responses, &independent)?)?
            }
        };
        Ok(Calibration {
            version: VERSION,
            head: origin,
            centres_hz: centres_hz().to_vec(),
            independent: independent.to_vec(),
            directions,
            distance,
        })
    }

    /// Reads a calibration.
    ///
    /// # Errors
    /// A file that cannot be read, or is not a calibration of this version.
    pub fn read(path: &Path) -> Result<Calibration, AuditionError> {
        let text = input::text(path, MOST_BYTES).map_err(|error| AuditionError::Input(Box::new(error)))?;
        let refuse = |reason: String| AuditionError::File { path: path.to_path_buf(), reason };
        let found: Calibration = serde_json::from_str(&text).map_err(|error| {
            refuse(format!("not a calibration of hearing: {error}; make one with `bvm calibrate audition`"))
        })?;
        let rows = found.directions.iter().map(|one| &one.cues).chain(found.distance.rows.iter().flatten());
        let complete = |row: &CueRow| {
            let all = [&row.itd_us, &row.ild_db, &row.slope_db];
            all.iter().all(|row| row.len() == BANDS && row.iter().all(|value| value.is_finite()))
        };
        let same_bands = found.centres_hz.len() == BANDS
            && found
                .centres_hz
                .iter()
                .zip(centres_hz())
                .all(|(one, other)| (one - other).abs() < 1e-6 * other);
        let law = &found.distance;
        let has_law = law.distances_m.len() == law.rows.len()
            && law.distances_m.first().is_some_and(|first| *first > 0.0)
            && law.distances_m.windows(2).all(|pair| pair[0] < pair[1])
            && law.rows.iter().all(|row| row.len() >= 2)
            && law.reference_m > 0.0;
        if found.version != VERSION || !same_bands || found.independent.len() != BANDS {
            return Err(refuse(format!(
                "a calibration of version {} with {} bands: expected version {VERSION} with {BANDS}; make it again with `bvm calibrate audition`",
                found.version,
                found.centres_hz.len()
            )));
        }
        if found.directions.is_empty() || !has_law || !rows.into_iter().all(complete) {
            return Err(refuse(
                "directions, distances or bands are missing; make it again with `bvm calibrate audition`"
                    .to_owned(),
            ));
        }
        Ok(found)
    }

    /// The largest time difference of a direction in the bands that have one cycle, µs.
    pub fn largest_itd_us(&self) -> f64 {
        self.directions.iter().map(|one| middle_itd_us(&one.cues).abs()).fold(0.0, f64::max)
    }

    /// The calibration as text.
    pub fn text(&self) -> String {
        serde_json::to_string(self).expect("internal: a calibration is numbers and names")
    }
}

impl DistanceLaw {
    /// The cues of the sphere at a distance (m) and a sine of the lateral angle.
    pub fn cues(&self, distance_m: f64, sine: f64) -> CueRow {
        let (distances, last) = (&self.distances_m, self.distances_m.len() - 1);
        let far = distances.partition_point(|one| *one < distance_m).min(last);
        let near = far.saturating_sub(1);
        let share = if far == near {
            0.0
        } else {
            ((distance_m / distances[near]).ln() / (distances[far] / distances[near]).ln()).clamp(0.0, 1.0)
        };
        let [one, other] = [near, far].map(|index| at_angle(&self.rows[index], sine));
        between(&one, &other, share)
    }
}

/// The cues at a sine of the lateral angle, from rows at equal steps of that angle from 0 to 90 degrees.
fn at_angle(rows: &[CueRow], sine: f64) -> CueRow {
    let place = sine.abs().min(1.0).asin() / FRAC_PI_2 * (rows.len() - 1) as f64;
    let below = (place as usize).min(rows.len() - 2);
    let row = between(&rows[below], &rows[below + 1], place - below as f64);
    let sign = if sine < 0.0 { -1.0 } else { 1.0 };
    let signed = |values: &[f64]| values.iter().map(|value| sign * value).collect();
    CueRow { itd_us: signed(&row.itd_us), ild_db: signed(&row.ild_db), slope_db: row.slope_db }
}

/// Cues between two others.
pub(super) fn between(one: &CueRow, other: &CueRow, share: f64) -> CueRow {
    let mix = |one: &[f64], other: &[f64]| one.iter().zip(other).map(|(a, b)| a + share * (b - a)).collect();
    CueRow {
        itd_us: mix(&one.itd_us, &other.itd_us),
        ild_db: mix(&one.ild_db, &other.ild_db),
        slope_db: mix(&one.slope_db, &other.slope_db),
    }
}

fn measured_directions(
    responses: &Responses,
    independent: &[f64; BANDS],
) -> Result<Vec<DirectionCues>, Error> {
    let of = |one: &Measured| {
        let degrees = |angle: f64| (angle.to_degrees() * 1e4).round() / 1e4;
        Ok(DirectionCues {
            azimuth_deg: degrees(one.place.azimuth),
            elevation_deg: degrees(one.place.elevation),
            cues: played(&one.ears, responses.rate_hz, independent)?,
        })
    };
    responses.measured.par_iter().map(of).collect()
}

fn sphere_directions(law: &DistanceLaw) -> Vec<DirectionCues> {
    let mut directions = Vec::new();
    let rows = (180.0 / SPHERE_STEPS[0]) as i32;
    for row in 0..=rows {
        let elevation_deg = SPHERE_STEPS[0] * f64::from(row) - 90.0;
        let around = 360.0 / SPHERE_STEPS[1] * elevation_deg.to_radians().cos();
        // A multiple of four, so that both sides and both ends are there.
        let count = ((around / 4.0).round() as usize * 4).max(1);
        for column in 0..count {
            let turned = 360.0 * column as f64 / count as f64;
            let azimuth_deg = if turned > 180.0 { turned - 360.0 } else { turned };
            let sine = lateral_sine(Spherical {
                rho_m: 1.0,
                azimuth: azimuth_deg / 180.0 * PI,
                elevation: elevation_deg / 180.0 * PI,
            });
            let cues = law.cues(law.reference_m, sine);
            directions.push(DirectionCues { azimuth_deg, elevation_deg, cues });
        }
    }
    directions
}

/// The median time difference of the bands that have one cycle, µs.
fn middle_itd_us(cues: &CueRow) -> f64 {
    let centres = centres_hz();
    let is_sure = |band: &usize| (UNAMBIGUOUS_HZ[0]..UNAMBIGUOUS_HZ[1]).contains(&centres[*band]);
    let mut sure: Vec<f64> = (0..BANDS).filter(is_sure).map(|band| cues.itd_us[band]).collect();
    sure.sort_by(f64::total_cmp);
    sure[sure.len() / 2]
}

/// Compares the time differences of directions with the sines of their lateral angles.
fn check(directions: Vec<DirectionCues>) -> Result<Vec<DirectionCues>, AuditionError> {
    let sine = |one: &DirectionCues| {
        let [azimuth, elevation] = [one.azimuth_deg, one.elevation_deg].map(f64::to_radians);
        lateral_sine(Spherical { rho_m: 1.0, azimuth, elevation })
    };
    let pairs: Vec<(f64, f64)> = directions.iter().map(|one| (middle_itd_us(&one.cues), sine(one))).collect();
    let [itd, both, sines] =
        pairs.iter().fold([0.0; 3], |[itd, both, sines], (x, y)| [itd + x * x, both + x * y, sines + y * y]);
    let largest = pairs.iter().map(|(itd, _)| itd.abs()).fold(0.0, f64::max);
    let correlation = both / (itd * sines).sqrt();
    let refuse = |reason: String| Err(AuditionError::Head(reason));
    if sines <= 0.1 {
        return refuse("the head has no directions to the side: azimuths cannot be checked".to_owned());
    }
    if correlation < -LEAST_CORRELATION {
        return refuse(format!(
            "sounds with azimuths to the left reach the right ear first (correlation {correlation:.2}): azimuth is counted clockwise, or the ears are exchanged; if it is the azimuth, mirror it with `--mirror`"
        ));
    }
    if correlation.is_nan() || correlation <= LEAST_CORRELATION {
        return refuse(format!(
            "time differences do not follow the lateral angle (correlation {correlation:.2}, expected above {LEAST_CORRELATION}): are angles in the units that the file says, and are delays in the responses or in `Data.Delay`?"
        ));
    }
    if !(LARGEST_ITD_US[0]..=LARGEST_ITD_US[1]).contains(&largest) {
        return refuse(format!(
            "the largest time difference is {:.0} µs, expected {:.0} to {:.0} µs: is it a head, and is its sampling rate right?",
            largest, LARGEST_ITD_US[0], LARGEST_ITD_US[1]
        ));
    }
    Ok(directions)
}

/// FNV-1a of some bytes, in hexadecimal digits.
pub fn checksum(bytes: &[u8]) -> String {
    let hash = bytes.iter().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
    });
    format!("{hash:016x}")
}
