//! Hearing: simulated waveforms at two ears through the front end of `bvm listen` to the map.
//!
//! In: what sounds in the world, and the true attitude, for the waveforms; the estimated attitude, for their place in the
//! map. Out: the likelihood of `models/sounding.bp`. Invariant: a dead ear gives no evidence; silence is no fault.

use super::{Faults, noise_seed};
use crate::audition::synthesis::{Waypoint, binaural};
use crate::audition::{
    self, BANDS, BinauralUnit, Calibration, Channels, Directions, Listening, Origin, sphere,
};
use crate::error::Error;
use crate::frame::{Spherical, unit_vector};
use crate::grid::Grid;
use crate::head::frames::{Attitude, Extrinsics};
use crate::head::sense::{Bearing, Evidence, Sense, Sensed};
use crate::head::stage::Shared;
use crate::map::{Likelihood, Map};
use crate::programs::sounding;
use crate::vestibular::rotation;
use crate::world::scene::{FaultKind, Organ};
use crate::world::{Place, seeded};
use rand_distr::{Distribution, StandardNormal};
use std::sync::OnceLock;
use std::time::Instant;

/// How long the head listens at each look, s.
pub const LOOK_S: f64 = 0.3;
/// Sampling rate, Hz.
pub const RATE_HZ: f64 = 44_100.0;
/// Deviation of the noise of each ear: −70 dB of full scale.
const NOISE: f64 = 3.2e-4;
/// A bearing is reported from this probability on.
const LEAST: f64 = 0.5;
/// The least sum of probabilities of occupancy in a place: the map may be wrong that a place is empty.
const LEAST_WEIGHT: f32 = 0.05;

/// The calibration of the sphere: it takes a second, and is the same for all heads.
fn calibration() -> Result<&'static Calibration, Error> {
    static SPHERE: OnceLock<Result<Calibration, String>> = OnceLock::new();
    let radius_m = sphere::HEAD_RADIUS_M;
    let made = SPHERE.get_or_init(|| {
        Calibration::of(&audition::Head::Sphere(radius_m), Origin::Sphere { radius_m })
            .map_err(|error| error.to_string())
    });
    made.as_ref().map_err(|reason| audition::AuditionError::Head(reason.clone()).into())
}

pub(super) struct EarPair {
    stage: Shared,
    extrinsics: Extrinsics,
    faults: Faults,
    listening: Listening,
    /// The directions that are searched, in the axes of the head.
    rays: Vec<[f64; 3]>,
    /// The distance of each shell, by number.
    distance_of_shell: Vec<usize>,
    independent: [f64; BANDS],
    last: Option<[Vec<f64>; 2]>,
    answer: sounding::heard::Answer<f32>,
}

impl EarPair {
    pub(super) fn new(
        stage: &Shared,
        extrinsics: Extrinsics,
        faults: Faults,
        grid: &Grid,
    ) -> Result<Self, Error> {
        let calibration = calibration()?;
        let listening = Listening::new(calibration, Directions::All)?;
        let edges = grid.edges_m();
        let nearest = |rho: usize| {
            let middle = (edges[rho] * edges[rho + 1]).sqrt();
            let away = |at: &usize| (listening.distances_m()[*at] / middle).ln().abs();
            (0..listening.distances_m().len())
                .min_by(|one, other| away(one).total_cmp(&away(other)))
                .unwrap_or(0)
        };
        Ok(Self {
            stage: stage.clone(),
            extrinsics,
            faults,
            rays: listening.rays(),
            distance_of_shell: (0..grid.cells_rho()).map(nearest).collect(),
            independent: std::array::from_fn(|band| calibration.independent[band]),
            listening,
            last: None,
            answer: Default::default(),
        })
    }

    /// What arrives at the ears during a look.
    fn waves(&mut self) -> [Vec<f64>; 2] {
        let count = (LOOK_S * RATE_HZ).round() as usize;
        let mut ears = [vec![0.0; count], vec![0.0; count]];
        let stage = self.stage.borrow();
        let head = audition::Head::Sphere(sphere::HEAD_RADIUS_M);
        let to_head = rotation::transposed(&stage.attitude.matrix());
        for source in &stage.world.sources {
            let sound = source.samples(stage.time_s, LOOK_S, RATE_HZ, stage.seed);
            if sound.iter().all(|sample| *sample == 0.0) {
                continue;
            }
            let waypoint = |time_s: f64| {
                let point = stage.world.source_at(source, stage.time_s + time_s);
                let place = Spherical::from_cartesian(rotation::apply(&to_head, point));
                Waypoint { time_s, place }
            };
            let path = match source.place {
                Place::Fixed(_) => vec![waypoint(0.0)],
                Place::Carried(..) => vec![waypoint(0.0), waypoint(LOOK_S)],
            };
            let heard = binaural(&head, &sound, RATE_HZ, &path);
            for (ear, heard) in ears.iter_mut().zip(&heard) {
                ear.iter_mut().zip(heard).for_each(|(sum, value)| *sum += value);
            }
        }
        let mut random = seeded(noise_seed(&stage), "ears");
        for sample in ears.iter_mut().flatten() {
            let noise: f64 = StandardNormal.sample(&mut random);
            *sample = (*sample + NOISE * noise).clamp(-1.0, 1.0);
        }
        drop(stage);
        for (ear, organ) in [Organ::LeftEar, Organ::RightEar].into_iter().enumerate() {
            match self.faults.of(organ) {
                Some(FaultKind::Lost) => ears[ear] = vec![0.0; count],
                Some(FaultKind::Frozen) => {
                    if let Some(last) = &self.last {
                        ears[ear].clone_from(&last[ear]);
                    }
                }
                None => {}
            }
        }
        ears
    }

    /// The likelihood of the cells from the probability of a source in each place.
    fn evidence(&mut self, places: &[f64], prior: &Map, attitude: &Attitude) -> Result<Likelihood, Error> {
        let grid = prior.grid();
        let (directions, distances) = (grid.directions(), self.listening.distances_m().len());
        let to_head = rotation::transposed(&attitude.matrix());
        let nearest = |direction| {
            let (azimuth, elevation) = grid.direction_centre(direction);
            let [x, y, z] = rotation::apply(&to_head, unit_vector(azimuth, elevation));
            let along = |ray: &[f64; 3]| ray[0] * x + ray[1] * y + ray[2] * z;
            let nearer = |best: (usize, f64), (at, ray): (usize, &[f64; 3])| match along(ray) {
                cosine if cosine > best.1 => (at, cosine),
                _ => best,
            };
            self.rays.iter().enumerate().fold((0, f64::NEG_INFINITY), nearer).0
        };
        let of_direction: Vec<usize> = grid.all_directions().map(nearest).collect();
        let place_of = |cell: usize| {
            of_direction[cell % directions] * distances + self.distance_of_shell[cell / directions]
        };
        let place: Vec<usize> = (0..grid.cells()).map(place_of).collect();
        let mut weights = vec![0f32; places.len()];
        place.iter().zip(prior.occupancy()).for_each(|(at, p)| weights[*at] += p);
        let each = |value: &dyn Fn(usize) -> f32| place.iter().map(|at| value(*at)).collect::<Vec<f32>>();
        let rates = self.listening.prior();
        sounding::heard()
            .grid(grid.cells())
            .prior(&each(&|at| rates[at] as f32))
            .place(&each(&|at| places[at].min(1.0) as f32))
            .weight(&each(&|at| weights[at].max(LEAST_WEIGHT)))
            .occupied(prior.occupancy())
            .run_into(&mut self.answer)?;
        let likelihood = self.answer.distribution();
        let most = likelihood.iter().fold(f32::MIN_POSITIVE, |most, value| most.max(*value));
        Ok(likelihood.iter().map(|value| value / most).collect())
    }
}

impl Sense for EarPair {
    fn name(&self) -> &'static str {
        "audio"
    }

    fn likelihood(&mut self, prior: &Map, attitude: &Attitude) -> Result<Sensed, Error> {
        let begun = Instant::now();
        let ears = self.waves();
        let simulated_ms = begun.elapsed().as_secs_f64() * 1e3;
        let [left, right] = &ears;
        let mut channels = Channels::new(RATE_HZ);
        channels.add(left, right);
        let mut fault = channels.fault();
        if let Some(last) = &self.last {
            let repeats =
                (0..2).find(|ear| last[*ear] == ears[*ear] && ears[*ear].iter().any(|value| *value != 0.0));
            if let Some(ear) = repeats {
                let name = ["left", "right"][ear];
                fault = Some(format!("the {name} ear repeats its last sound to the bit: not used"));
            }
        }
        let cues = BinauralUnit::new(RATE_HZ, &self.independent).hear(left, right).bands();
        self.last = Some(ears);
        if fault.is_some() {
            return Ok(Sensed { fault, ..Sensed::default() });
        }
        let readings = cues.iter().filter(|cue| cue.count > 0.0).count();
        if readings == 0 {
            return Ok(Sensed::default());
        }
        let places = self.listening.posterior(&cues)?.to_vec();
        let heard = self.listening.sources(&places);
        let bearing = |source: &audition::Source| {
            let (azimuth, elevation) = (source.azimuth_deg.to_radians(), source.elevation_deg.to_radians());
            let place = Spherical { rho_m: source.distance_m, azimuth, elevation };
            let seen = self.extrinsics.ears_to_map(attitude, place);
            Bearing {
                azimuth_deg: seen.azimuth.to_degrees(),
                elevation_deg: seen.elevation.to_degrees(),
                distance_m: seen.rho_m,
                probability: source.probability,
            }
        };
        let found = heard.sources.iter().filter(|_| heard.sounding >= LEAST).map(bearing).collect();
        let likelihood = self.evidence(&places, prior, attitude)?;
        Ok(Sensed {
            evidence: Evidence::Cells(likelihood),
            readings,
            found,
            simulated_ms,
            ..Sensed::default()
        })
    }

    fn skip(&mut self, _attitude: &Attitude) -> Result<(), Error> {
        // The sound before a frozen ear is the one that it repeats.
        self.last = None;
        Ok(())
    }
}
