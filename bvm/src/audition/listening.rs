//! Listening: the place of a sound, as a posterior (`models/listening.bp`).
//!
//! In: a calibration, and the cues of a look. Out: P(S C | τ ΔL slopes), over places, which are directions times distances:
//! first over a cell around each calibrated direction, then over parts of the cells that hold nearly all.
//! Invariant: every probability is that of the program; what is computed here are the expected cues of places.

use super::binaural::{BandCue, Cues};
use super::calibration::{Calibration, DistanceLaw};
use super::cochlea::BANDS;
use super::directions::{Searched, Sphere};
use super::error::AuditionError;
use super::head::lateral_sine;
use super::region::{Found, Posterior};
use super::voices::{Unit, voices};
use crate::error::Error;
use crate::frame::{Spherical, unit_vector};
use crate::programs::listening;

/// Level differences and slopes beyond this are this, dB: the bound of the program.
const MOST_DB: f64 = 60.0;
/// The share of the posterior that is resolved further, and the most cells that are.
const RESOLVED: f64 = 0.998;
const MOST_RESOLVED: usize = 40;

/// The directions that are searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Directions {
    /// All that are calibrated.
    All,
    /// The front half of the horizontal plane.
    Frontal,
}

/// The expected cues of places: of each direction at each distance, in ms and dB.
#[derive(Clone, Debug, Default)]
struct Expected {
    tau: Vec<f64>,
    l: Vec<f64>,
    slope: Vec<f64>,
    /// The solid angle of the cell.
    area: Vec<f64>,
    /// Half the usual size of a cell, degrees. It is one number: a deviation for each cell would be counted once for each
    /// band, and make a source in a larger cell improbable.
    size_deg: f64,
}

impl Expected {
    fn of(cells: &[Searched], law: &DistanceLaw, distances_m: &[f64], is_plane: bool) -> Expected {
        let mut sizes: Vec<f64> = cells.iter().map(|one| one.size_deg(is_plane)).collect();
        sizes.sort_by(f64::total_cmp);
        let size_deg = sizes.get(sizes.len() / 2).copied().unwrap_or_default();
        let mut all = Expected { size_deg, ..Expected::default() };
        for one in cells {
            let (azimuth, elevation) = one.angles();
            let sine = lateral_sine(Spherical { rho_m: 1.0, azimuth, elevation });
            let far = law.cues(law.reference_m, sine);
            for distance in distances_m {
                let near = law.cues(*distance, sine);
                for band in 0..BANDS {
                    all.tau.push(1e-3 * (one.cues.itd_us[band] + near.itd_us[band] - far.itd_us[band]));
                    all.l.push(one.cues.ild_db[band] + near.ild_db[band] - far.ild_db[band]);
                    all.slope.push(one.cues.slope_db[band] + near.slope_db[band] - far.slope_db[band]);
                }
                all.area.push(if is_plane { one.edges_deg[0].iter().sum() } else { one.area() });
            }
        }
        all
    }

    /// The same for one band.
    fn band(&self, band: usize) -> Expected {
        let of = |all: &[f64]| all.iter().skip(band).step_by(BANDS).copied().collect();
        let [tau, l, slope] = [&self.tau, &self.l, &self.slope].map(|all| of(all));
        Expected { tau, l, slope, area: self.area.clone(), size_deg: self.size_deg }
    }
}

/// A listener with a calibrated head.
#[derive(Clone, Debug)]
pub struct Listening {
    sphere: Sphere,
    law: DistanceLaw,
    cells: Vec<Searched>,
    expected: Expected,
    /// Sines of the lateral angles of the front half of the horizontal plane, and the cues that are expected in each band for a
    /// distant source there.
    sines: Vec<f64>,
    of_angles: Vec<Expected>,
    frequency: Vec<f64>,
    answer: listening::place::Answer<f64>,
}

impl Listening {
    /// The expected cues of each place.
    ///
    /// # Errors
    /// A calibration without any of these directions.
    pub fn new(calibration: &Calibration, directions: Directions) -> Result<Listening, AuditionError> {
        let sphere = Sphere::new(&calibration.directions, directions == Directions::Frontal);
        let cells = sphere.cells();
        if cells.is_empty() {
            let reason = "the head is not calibrated in the front half of the horizontal plane";
            return Err(AuditionError::Head(reason.to_owned()));
        }
        let law = &calibration.distance;
        let abreast = Sphere::new(&calibration.directions, true).cells();
        let of_angles = Expected::of(&abreast, law, &law.distances_m[law.distances_m.len() - 1..], true);
        Ok(Listening {
            sines: abreast.iter().map(|one| one.angles().0.sin()).collect(),
            of_angles: (0..BANDS).map(|band| of_angles.band(band)).collect(),
            law: law.clone(),
            expected: Expected::of(&cells, law, &law.distances_m, sphere.is_plane()),
            sphere,
            cells,
            frequency: calibration.centres_hz.iter().map(|centre| centre * 1e-3).collect(),
            answer: Default::default(),
        })
    }

    /// The probability of a source in each place given the cues of a look: `[direction][distance]`. They sum to that of a
    /// source.
    ///
    /// # Errors
    /// Only the kernel's own checks, which valid data pass.
    pub fn posterior(&mut self, cues: &[BandCue; BANDS]) -> Result<&[f64], Error> {
        ask(&self.expected, &self.frequency, cues, &mut self.answer)?;
        Ok(&self.answer.distribution()[self.expected.area.len()..])
    }

    /// The probability of a source in each place before the sound, as [`Listening::posterior`].
    pub fn prior(&self) -> Vec<f64> {
        let total: f64 = self.expected.area.iter().sum();
        self.expected.area.iter().map(|area| listening::DEFAULT_RATE * area / total).collect()
    }

    /// The distances of each direction, m.
    pub fn distances_m(&self) -> &[f64] {
        &self.law.distances_m
    }

    /// The unit vector of each direction that is searched.
    pub fn rays(&self) -> Vec<[f64; 3]> {
        let ray = |one: &Searched| unit_vector(one.angles().0, one.angles().1);
        self.cells.iter().map(ray).collect()
    }

    /// The sources of a look.
    ///
    /// # Errors
    /// Only the kernel's own checks, which valid data pass.
    pub fn find(&mut self, cues: &[BandCue; BANDS]) -> Result<Found, Error> {
        if cues.iter().all(|cue| cue.count == 0.0) {
            return Ok(Found::flat());
        }
        let places = self.posterior(cues)?.to_vec();
        let coarse = self.sources(&places);
        let cells = match self.resolved(&places) {
            Some(cells) if !coarse.sources.is_empty() => cells,
            _ => return Ok(coarse),
        };
        let expected = Expected::of(&cells, &self.law, &self.law.distances_m, self.sphere.is_plane());
        ask(&expected, &self.frequency, cues, &mut self.answer)?;
        let fine = Posterior {
            cells: &cells,
            distances_m: &self.law.distances_m,
            places: &self.answer.distribution()[expected.area.len()..],
        };
        let found = fine.sources();
        // What needs too many small cells may do with the larger ones.
        Ok(if found.flat { coarse } else { found })
    }

    /// The sources of a look, of which the cues of its parts are given: a part is a tenth of a second or so, in which each
    /// band has one source. Voices that are separated have sources of their own, most probable first.
    ///
    /// # Errors
    /// Only the kernel's own checks, which valid data pass.
    pub fn find_voices(&mut self, parts: &[Cues]) -> Result<Found, Error> {
        let Some(silence) = parts.first().map(Cues::silence) else { return Ok(Found::flat()) };
        let mut units = Vec::new();
        for (part, cues) in parts.iter().enumerate() {
            let heard = |(_, cue): &(usize, &BandCue)| cue.count > 0.0 && !self.sines.is_empty();
            for (band, cue) in cues.bands().iter().enumerate().filter(heard) {
                ask(&self.of_angles[band], &self.frequency[band..=band], &[*cue], &mut self.answer)?;
                let (without, with) = self.answer.distribution().split_at(self.sines.len());
                let odds = without.iter().sum::<f64>().max(f64::MIN_POSITIVE) * listening::DEFAULT_RATE
                    / (1.0 - listening::DEFAULT_RATE);
                let area = &self.of_angles[band].area;
                let total: f64 = area.iter().sum();
                let ratios = with.iter().zip(area).map(|(p, area)| p * total / area / odds).collect();
                units.push(Unit { part, band, ratios });
            }
        }
        let mut found: Option<Found> = None;
        for voice in voices(parts, &units, &self.sines, silence) {
            let of_voice = self.find(&voice.bands())?;
            match &mut found {
                None => found = Some(of_voice),
                Some(found) => {
                    found.flat &= of_voice.flat;
                    found.sounding = found.sounding.max(of_voice.sounding);
                    found.sources.extend(of_voice.sources);
                }
            }
        }
        let mut found = found.unwrap_or_else(Found::flat);
        found.sources.sort_by(|one, other| other.probability.total_cmp(&one.probability));
        Ok(found)
    }

    /// The sources of a [`Listening::posterior`].
    pub fn sources(&self, places: &[f64]) -> Found {
        Posterior { cells: &self.cells, distances_m: &self.law.distances_m, places }.sources()
    }

    /// The parts of the cells that hold nearly all; `None` if these are too many.
    fn resolved(&self, places: &[f64]) -> Option<Vec<Searched>> {
        let of_direction =
            Posterior { cells: &self.cells, distances_m: &self.law.distances_m, places }.of_directions();
        let mut order: Vec<usize> = (0..of_direction.len()).collect();
        order.sort_by(|one, other| of_direction[*other].total_cmp(&of_direction[*one]));
        let enough = RESOLVED * of_direction.iter().sum::<f64>();
        let mut sum = 0.0;
        let mut parts = Vec::new();
        for (number, at) in order.into_iter().enumerate() {
            if number == MOST_RESOLVED {
                return None;
            }
            parts.extend(self.sphere.parts(&self.cells[at]));
            sum += of_direction[at];
            if sum >= enough {
                break;
            }
        }
        Some(parts)
    }
}

/// The program's posterior of places.
fn ask(
    expected: &Expected,
    frequency: &[f64],
    cues: &[BandCue],
    answer: &mut listening::place::Answer<f64>,
) -> Result<(), Error> {
    let each = |value: fn(&BandCue) -> f64| cues.iter().map(value).collect::<Vec<f64>>();
    listening::place()
        .places(expected.area.len())
        .bands(cues.len())
        .mu_tau(&expected.tau)
        .mu_l(&expected.l)
        .mu_slope(&expected.slope)
        .size(expected.size_deg)
        .area(&expected.area)
        .frequency(frequency)
        .coherence(&each(|cue| cue.coherence))
        .count(&each(|cue| cue.count))
        .level_count(&each(|cue| cue.level_count))
        .slope_count(&each(|cue| cue.slope_count))
        .tau(&each(|cue| 1e3 * cue.itd_s))
        .l(&each(|cue| cue.ild_db.clamp(-MOST_DB, MOST_DB)))
        .slope(&each(|cue| cue.slope_db.clamp(-MOST_DB, MOST_DB)))
        .run_into(answer)?;
    Ok(())
}
