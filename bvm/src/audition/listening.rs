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
use super::expected::Expected;
use super::region::{Found, Posterior};
use super::turns::{Turn, Turns};
use super::voices::{Unit, separated};
use crate::error::Error;
use crate::frame::unit_vector;
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

/// A listener with a calibrated head.
#[derive(Clone, Debug)]
pub struct Listening {
    sphere: Sphere,
    /// All calibrated directions.
    calibrated: Sphere,
    law: DistanceLaw,
    cells: Vec<Searched>,
    expected: Expected,
    /// Sines of the lateral angles of the front half of the horizontal plane, and the cues that are expected in each band for a
    /// distant source there.
    sines: Vec<f64>,
    of_angles: Vec<Expected>,
    frequency: Vec<f64>,
    /// The posteriors of the last look: one for each voice.
    last: Vec<(Vec<Searched>, Vec<f64>)>,
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
            calibrated: Sphere::new(&calibration.directions, false),
            cells,
            frequency: calibration.centres_hz.iter().map(|centre| centre * 1e-3).collect(),
            last: Vec::new(),
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
        self.last.clear();
        self.resolve(cues, &[])
    }

    /// The sources of a look during which the head was turned, in the axes of the map.
    ///
    /// # Errors
    /// Only the kernel's own checks, which valid data pass.
    pub fn find_turned(&mut self, heard: &Turns) -> Result<Found, Error> {
        self.last.clear();
        let (turns, groups) = heard.groups();
        let mut cues: Vec<BandCue> = groups.iter().flat_map(|group| group.bands()).collect();
        // The spectrum of the source is the same in all groups: it is evidence once.
        let slopes = |group: &[BandCue]| group.iter().map(|cue| cue.slope_count).sum::<f64>();
        let most = cues.chunks(BANDS).map(slopes).fold(0.0, f64::max);
        let mut is_used = false;
        for group in cues.chunks_mut(BANDS) {
            let is_this = !is_used && slopes(group) >= most;
            is_used |= is_this;
            if !is_this {
                group.iter_mut().for_each(|cue| cue.slope_count = 0.0);
            }
        }
        self.resolve(&cues, &turns)
    }

    /// The sources of cues: those of all bands, for each turn if there are any.
    fn resolve(&mut self, cues: &[BandCue], turns: &[Turn]) -> Result<Found, Error> {
        if cues.iter().all(|cue| cue.count == 0.0) {
            return Ok(Found::flat());
        }
        let frequency = self.frequency.repeat(turns.len().max(1));
        let turned;
        let expected = if turns.is_empty() {
            &self.expected
        } else {
            turned =
                Expected::turned(&self.cells, &self.law, self.sphere.is_plane(), turns, &self.calibrated);
            &turned
        };
        ask(expected, &frequency, cues, &mut self.answer)?;
        let places = self.answer.distribution()[expected.area.len()..].to_vec();
        let coarse = self.sources(&places);
        let cells = match self.resolved(&places) {
            Some(cells) if !coarse.sources.is_empty() => cells,
            _ => {
                self.last.push((self.cells.clone(), places));
                return Ok(coarse);
            }
        };
        let is_plane = self.sphere.is_plane();
        let expected = if turns.is_empty() {
            Expected::of(&cells, &self.law, &self.law.distances_m, is_plane)
        } else {
            Expected::turned(&cells, &self.law, is_plane, turns, &self.calibrated)
        };
        ask(&expected, &frequency, cues, &mut self.answer)?;
        let fine = self.answer.distribution()[expected.area.len()..].to_vec();
        let found = Posterior { cells: &cells, distances_m: &self.law.distances_m, places: &fine }.sources();
        // What needs too many small cells may do with the larger ones.
        let (cells, places, found) =
            if found.flat { (self.cells.clone(), places, coarse) } else { (cells, fine, found) };
        self.last.push((cells, places));
        Ok(found)
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
        self.last.clear();
        let mut found: Option<Found> = None;
        for voice in separated(parts, &units, &self.sines, silence)? {
            let of_voice = self.resolve(&voice.bands(), &[])?;
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

    /// The posterior of the last look, for pictures: the density of each of `rows` by `columns` directions, per square
    /// degree, from the left to the right and from below to above; and the probability of each distance. Those of several voices
    /// are added.
    pub fn pictured(&self, [rows, columns]: [usize; 2]) -> (Vec<f64>, Vec<f64>) {
        let distances = self.law.distances_m.len();
        let (mut densities, mut of_distance) = (vec![0.0; rows * columns], vec![0.0; distances]);
        for (cells, places) in &self.last {
            for (cell, places) in cells.iter().zip(places.chunks(distances)) {
                of_distance.iter_mut().zip(places).for_each(|(sum, p)| *sum += p);
                let square = cell.area() * (180.0 / std::f64::consts::PI).powi(2);
                let density = places.iter().sum::<f64>() / square.max(1e-9);
                for (row, column) in cell.pixels([rows, columns]) {
                    densities[row * columns + column] += density;
                }
            }
        }
        (densities, of_distance)
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
        .level_coherence(&each(|cue| cue.level_coherence))
        .slope_count(&each(|cue| cue.slope_count))
        .tau(&each(|cue| 1e3 * cue.itd_s))
        .l(&each(|cue| cue.ild_db.clamp(-MOST_DB, MOST_DB)))
        .slope(&each(|cue| cue.slope_db.clamp(-MOST_DB, MOST_DB)))
        .run_into(answer)?;
    Ok(())
}
