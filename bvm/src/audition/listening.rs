//! Listening: the place of a sound, as a posterior (`models/listening.bp`).
//!
//! In: a calibration, and the cues of a look. Out: P(S C | τ ΔL), over places, which are directions times distances.
//! Invariant: every probability is that of the program; what is computed here are the expected cues of places, and sums of
//! probabilities over places.

use super::binaural::BandCue;
use super::calibration::{Calibration, CueRow, DirectionCues, between};
use super::cochlea::BANDS;
use super::error::AuditionError;
use super::head::lateral_sine;
use crate::error::Error;
use crate::frame::{Spherical, great_circle, unit_vector};
use crate::programs::listening;
use serde::Serialize;

/// Directions of one elevation are at most this far apart, in degrees of azimuth; others are put between them.
const STEP_DEG: f64 = 5.5;
/// Gaps of more degrees of azimuth stay.
const GAP_DEG: f64 = 45.0;
/// A source is found within this angle, degrees.
const NEAR_DEG: f64 = 10.0;
/// Two sources are at least this far apart, degrees.
const APART_DEG: f64 = 20.0;
/// Least probability of a further source, and most sources.
const LEAST: f64 = 0.05;
const MOST_SOURCES: usize = 5;
/// Level differences beyond this are this, dB: the bound of the program.
const MOST_ILD_DB: f64 = 60.0;
/// Most boxes of a region.
const MOST_BOXES: usize = 200;

/// The directions that are searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Directions {
    /// All that are calibrated.
    All,
    /// The front half of the horizontal plane.
    Frontal,
}

/// A direction that is searched.
#[derive(Clone, Debug, PartialEq)]
struct Searched {
    azimuth_deg: f64,
    elevation_deg: f64,
    /// Half the sizes of its cell in azimuth and elevation, degrees.
    half_deg: [f64; 2],
    cues: CueRow,
}

/// A box of the region of the posterior.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RegionBox {
    /// From and to, degrees.
    pub azimuth_deg: [f64; 2],
    /// From and to, degrees.
    pub elevation_deg: [f64; 2],
    /// From and to, m.
    pub distance_m: [f64; 2],
}

/// A source.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Source {
    /// Azimuth, degrees, positive to the left.
    pub azimuth_deg: f64,
    /// Elevation, degrees, positive upwards.
    pub elevation_deg: f64,
    /// The most probable distance, m.
    pub distance_m: f64,
    /// Probability that a source is within 10 degrees of this direction.
    pub probability: f64,
    /// Probability of the other side, front or back, of the plane through the ears.
    pub front_back_mass: f64,
    /// The most probable directions that have 90 % together, with their distances.
    pub region90: Vec<RegionBox>,
}

/// The sources of a look.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Found {
    /// Whether there is no direction: no source, or one whose direction does not fit into boxes.
    pub flat: bool,
    /// The probability of a source.
    pub sounding: f64,
    /// The sources, most probable first.
    pub sources: Vec<Source>,
}

impl Found {
    /// No source.
    pub fn flat() -> Found {
        Found { flat: true, sounding: 0.0, sources: Vec::new() }
    }
}

/// A listener with a calibrated head.
#[derive(Clone, Debug)]
pub struct Listening {
    directions: Vec<Searched>,
    distances_m: Vec<f64>,
    mu_tau: Vec<f64>,
    mu_l: Vec<f64>,
    frequency: Vec<f64>,
    answer: listening::place::Answer<f64>,
}

impl Listening {
    /// The expected cues of each place.
    ///
    /// # Errors
    /// A calibration without any of these directions.
    pub fn new(calibration: &Calibration, directions: Directions) -> Result<Listening, AuditionError> {
        let all = searched(&calibration.directions);
        let frontal = |one: &Searched| {
            directions == Directions::All || one.azimuth_deg.abs() <= 90.01 && one.elevation_deg.abs() <= 5.0
        };
        let directions: Vec<Searched> = all.into_iter().filter(frontal).collect();
        if directions.is_empty() {
            let reason = "the head is not calibrated in the front half of the horizontal plane";
            return Err(AuditionError::Head(reason.to_owned()));
        }
        let law = &calibration.distance;
        let (mut mu_tau, mut mu_l) = (Vec::new(), Vec::new());
        for one in &directions {
            let [azimuth, elevation] = [one.azimuth_deg, one.elevation_deg].map(f64::to_radians);
            let sine = lateral_sine(Spherical { rho_m: 1.0, azimuth, elevation });
            let far = law.cues(law.reference_m, sine);
            for distance in &law.distances_m {
                let near = law.cues(*distance, sine);
                let moved = |cue: &[f64], near: &[f64], far: &[f64], unit: f64| -> Vec<f64> {
                    (0..BANDS).map(|band| unit * (cue[band] + near[band] - far[band])).collect()
                };
                // ms, dB
                mu_tau.extend(moved(&one.cues.itd_us, &near.itd_us, &far.itd_us, 1e-3));
                mu_l.extend(moved(&one.cues.ild_db, &near.ild_db, &far.ild_db, 1.0));
            }
        }
        Ok(Listening {
            directions,
            distances_m: law.distances_m.clone(),
            mu_tau,
            mu_l,
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
        let each = |value: fn(&BandCue) -> f64| cues.iter().map(value).collect::<Vec<f64>>();
        let places = self.directions.len() * self.distances_m.len();
        listening::place()
            .places(places)
            .bands(BANDS)
            .mu_tau(&self.mu_tau)
            .mu_l(&self.mu_l)
            .frequency(&self.frequency)
            .coherence(&each(|cue| cue.coherence))
            .count(&each(|cue| cue.count))
            .level_count(&each(|cue| cue.level_count))
            .tau(&each(|cue| 1e3 * cue.itd_s))
            .l(&each(|cue| cue.ild_db.clamp(-MOST_ILD_DB, MOST_ILD_DB)))
            .run_into(&mut self.answer)?;
        Ok(&self.answer.distribution()[places..])
    }

    /// The distances of each direction, m.
    pub fn distances_m(&self) -> &[f64] {
        &self.distances_m
    }

    /// The unit vector of each direction that is searched.
    pub fn rays(&self) -> Vec<[f64; 3]> {
        let ray = |one: &Searched| unit_vector(one.angles().0, one.angles().1);
        self.directions.iter().map(ray).collect()
    }

    /// The sources of a look.
    ///
    /// # Errors
    /// Only the kernel's own checks, which valid data pass.
    pub fn find(&mut self, cues: &[BandCue; BANDS]) -> Result<Found, Error> {
        if cues.iter().all(|cue| cue.count == 0.0) {
            return Ok(Found::flat());
        }
        let posterior = self.posterior(cues)?.to_vec();
        Ok(self.sources(&posterior))
    }

    /// The sources of a [`Listening::posterior`].
    pub fn sources(&self, posterior: &[f64]) -> Found {
        let distances = self.distances_m.len();
        let of_direction: Vec<f64> =
            posterior.chunks_exact(distances).map(|places| places.iter().sum()).collect();
        let mut free: Vec<bool> = vec![true; of_direction.len()];
        let region = self.region(posterior, &of_direction);
        let sounding = of_direction.iter().sum::<f64>().min(1.0);
        if sounding < 0.5 {
            return Found { sounding, ..Found::flat() };
        }
        let mut found = Found { flat: region.is_empty(), sounding, sources: Vec::new() };
        while found.sources.len() < MOST_SOURCES {
            let likelier = |best: Option<usize>, at: usize| match best {
                Some(best) if of_direction[best] >= of_direction[at] => Some(best),
                _ => Some(at),
            };
            let Some(best) = (0..free.len()).filter(|at| free[*at]).fold(None, likelier) else { break };
            let source = self.source(best, posterior, &of_direction, &region);
            if source.probability < LEAST && !found.sources.is_empty() {
                break;
            }
            let centre = (source.azimuth_deg.to_radians(), source.elevation_deg.to_radians());
            for (free, one) in free.iter_mut().zip(&self.directions) {
                *free &= one.angle_deg(centre) > APART_DEG;
            }
            free[best] = false;
            found.sources.push(source);
        }
        found.sources.sort_by(|one, other| other.probability.total_cmp(&one.probability));
        found
    }

    /// The source around a direction.
    fn source(&self, best: usize, posterior: &[f64], of_direction: &[f64], region: &[RegionBox]) -> Source {
        let distances = self.distances_m.len();
        let near = |centre: (f64, f64)| {
            let is_near = move |at: &usize| self.directions[*at].angle_deg(centre) <= NEAR_DEG;
            (0..self.directions.len()).filter(is_near)
        };
        let [mut x, mut y, mut z] = [0.0; 3];
        for at in near(self.directions[best].angles()) {
            let (azimuth, elevation) = self.directions[at].angles();
            let [dx, dy, dz] = unit_vector(azimuth, elevation).map(|part| part * of_direction[at]);
            (x, y, z) = (x + dx, y + dy, z + dz);
        }
        let mean = Spherical::from_cartesian([x, y, z]);
        let centre = (mean.azimuth, mean.elevation);
        let mut by_distance = vec![0.0; distances];
        for at in near(centre) {
            for (sum, value) in by_distance.iter_mut().zip(&posterior[at * distances..]) {
                *sum += value;
            }
        }
        let likeliest =
            (0..distances).fold(0, |best, at| if by_distance[at] > by_distance[best] { at } else { best });
        let ahead = centre.0.cos() * centre.1.cos();
        let across = |at: &usize| {
            let (azimuth, elevation) = self.directions[*at].angles();
            azimuth.cos() * elevation.cos() * ahead < -1e-9
        };
        Source {
            azimuth_deg: mean.azimuth.to_degrees(),
            elevation_deg: mean.elevation.to_degrees(),
            distance_m: self.distances_m[likeliest],
            probability: by_distance.iter().sum::<f64>().min(1.0),
            front_back_mass: (0..of_direction.len())
                .filter(across)
                .fold(0.0, |sum, at| sum + of_direction[at])
                .min(1.0),
            region90: region.to_vec(),
        }
    }

    /// The most probable directions that have 90 % together; empty if they are too many to say anything.
    fn region(&self, posterior: &[f64], of_direction: &[f64]) -> Vec<RegionBox> {
        let mut order: Vec<usize> = (0..of_direction.len()).collect();
        order.sort_by(|one, other| of_direction[*other].total_cmp(&of_direction[*one]));
        let (mut boxes, mut sum) = (Vec::new(), 0.0);
        let enough = 0.9 * of_direction.iter().sum::<f64>();
        for at in order {
            if boxes.len() == MOST_BOXES {
                return Vec::new();
            }
            let one = &self.directions[at];
            let [azimuth, elevation] = one.half_deg;
            boxes.push(RegionBox {
                azimuth_deg: [one.azimuth_deg - azimuth, one.azimuth_deg + azimuth],
                elevation_deg: [one.elevation_deg - elevation, one.elevation_deg + elevation]
                    .map(|edge| edge.clamp(-90.0, 90.0)),
                distance_m: self
                    .distances(&posterior[at * self.distances_m.len()..][..self.distances_m.len()]),
            });
            sum += of_direction[at];
            if sum >= enough {
                break;
            }
        }
        boxes
    }

    /// The range of distances that holds 90 %: the most probable ones, and those between them.
    fn distances(&self, places: &[f64]) -> [f64; 2] {
        let total: f64 = places.iter().sum();
        let mut order: Vec<usize> = (0..places.len()).collect();
        order.sort_by(|one, other| places[*other].total_cmp(&places[*one]));
        let (mut sum, mut low, mut high) = (0.0, order[0], order[0]);
        for at in order {
            (low, high) = (low.min(at), high.max(at));
            sum += places[at];
            if sum >= 0.9 * total {
                break;
            }
        }
        // Edges lie in the middle, by ratio.
        let distance = |at: usize| self.distances_m[at];
        let last = self.distances_m.len() - 1;
        let first_edge = if low == 0 { distance(0) } else { (distance(low - 1) * distance(low)).sqrt() };
        let last_edge =
            if high == last { distance(last) } else { (distance(high) * distance(high + 1)).sqrt() };
        [first_edge, last_edge]
    }
}

impl Searched {
    fn angles(&self) -> (f64, f64) {
        (self.azimuth_deg.to_radians(), self.elevation_deg.to_radians())
    }

    fn angle_deg(&self, from: (f64, f64)) -> f64 {
        great_circle(self.angles(), from).to_degrees()
    }
}

/// The calibrated directions, ring by ring, with others between those that are far apart.
fn searched(directions: &[DirectionCues]) -> Vec<Searched> {
    let mut order: Vec<&DirectionCues> = directions.iter().collect();
    let key = |one: &DirectionCues| (one.elevation_deg * 100.0).round();
    order.sort_by(|one, other| {
        key(one).total_cmp(&key(other)).then(one.azimuth_deg.total_cmp(&other.azimuth_deg))
    });
    let rings: Vec<&[&DirectionCues]> = order.chunk_by(|one, other| key(one) == key(other)).collect();
    let heights: Vec<f64> = rings.iter().map(|ring| ring[0].elevation_deg).collect();
    let mut found = Vec::new();
    for (index, ring) in rings.iter().enumerate() {
        let gaps = heights.iter().enumerate().filter(|(other, _)| *other != index);
        let apart = gaps.map(|(_, height)| (height - heights[index]).abs()).fold(f64::INFINITY, f64::min);
        let up = if apart.is_finite() { 0.5 * apart } else { NEAR_DEG };
        for (at, one) in ring.iter().enumerate() {
            let next = ring[(at + 1) % ring.len()];
            let gap = (next.azimuth_deg - one.azimuth_deg).rem_euclid(360.0);
            let is_split = ring.len() > 1 && gap > STEP_DEG && gap <= GAP_DEG;
            let parts = if is_split { (gap / STEP_DEG).ceil() } else { 1.0 };
            let width = if ring.len() == 1 { 180.0 } else { 0.5 * gap.min(GAP_DEG) / parts };
            for part in 0..parts as usize {
                let share = part as f64 / parts;
                let azimuth_deg = one.azimuth_deg + share * gap;
                found.push(Searched {
                    azimuth_deg: if azimuth_deg > 180.0 { azimuth_deg - 360.0 } else { azimuth_deg },
                    elevation_deg: one.elevation_deg,
                    half_deg: [width, up],
                    cues: between(&one.cues, &next.cues, share),
                });
            }
        }
    }
    found
}
