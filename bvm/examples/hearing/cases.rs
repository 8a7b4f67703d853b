//! Test sounds: what arrives at the ears of a head.
//!
//! In: responses of a head, dry sounds, a place, a ratio of signal to noise. Out: the waveforms of one case, with its truth.
//! Invariant: a case depends on its own description and random seed only.

use bp_core::compiler::random::seeded;
use bvm::audition::synthesis::{Waypoint, add_noise, binaural, convolved};
use bvm::audition::wave::WaveReader;
use bvm::audition::{AuditionError, BANDS, BinauralUnit, Head, PART_S, Responses, Turns, resampled};
use bvm::frame::{Spherical, great_circle};
use rand_distr::{Distribution, StandardNormal};
use std::path::Path;

/// The angle by which the head turns to the left during a sound, degrees.
const TURN_DEG: f64 = 20.0;

/// Sampling rate of all cases, Hz.
pub(crate) const RATE_HZ: f64 = 44_100.0;
/// Length of a sound, s, and where in a recording it begins.
const LENGTH_S: f64 = 1.0;
const BEGIN_S: f64 = 0.8;

/// A dry sound of one second.
#[derive(Clone)]
pub(crate) struct Sound {
    /// Samples at [`RATE_HZ`].
    pub(crate) samples: Vec<f64>,
}

impl Sound {
    /// White noise.
    pub(crate) fn noise() -> Sound {
        let mut random = seeded(1, "dry noise");
        let samples = (0..(LENGTH_S * RATE_HZ) as usize).map(|_| {
            let value: f64 = StandardNormal.sample(&mut random);
            0.1 * value
        });
        Sound { samples: samples.collect() }
    }

    /// One second of a recording of one channel.
    pub(crate) fn read(path: &Path) -> Result<Sound, AuditionError> {
        let mut wave = WaveReader::open(path)?;
        let rate_hz = wave.rate_hz();
        let all = wave.read(((BEGIN_S + LENGTH_S) * rate_hz) as usize)?.remove(0);
        let begin = ((BEGIN_S * rate_hz) as usize).min(all.len() / 2);
        let ratio = RATE_HZ / rate_hz;
        let length = ((all.len() - begin) as f64 * ratio) as usize;
        Ok(Sound { samples: resampled(&all[begin..], ratio, 0.0, length) })
    }
}

/// A room whose walls return a part of the pressure: a box with the head in it (mirror images of the source).
pub(crate) struct Room {
    /// Lengths along the axes, m.
    pub(crate) size_m: [f64; 3],
    /// The middle of the head, m.
    pub(crate) head_m: [f64; 3],
    /// What a wall returns.
    pub(crate) reflection: f64,
    /// Reflections per axis.
    pub(crate) order: i32,
}

impl Room {
    /// The responses of both ears to a source at a place that is given relative to the head.
    pub(crate) fn responses(&self, head: &Responses, place: Spherical) -> [Vec<f64>; 2] {
        let source = place.to_cartesian();
        let mut ears = [Vec::new(), Vec::new()];
        let orders = -self.order..=self.order;
        for (i, j, k) in orders.clone().flat_map(|i| {
            let orders = orders.clone();
            orders.clone().flat_map(move |j| orders.clone().map(move |k| (i, j, k)))
        }) {
            // The image of number n along an axis of length L: at n L + x if n is even, else at (n + 1) L − x.
            let image: [f64; 3] = std::array::from_fn(|axis| {
                let (n, length) = (f64::from([i, j, k][axis]), self.size_m[axis]);
                let at = self.head_m[axis] + source[axis];
                let mirrored =
                    if n.rem_euclid(2.0) == 0.0 { n * length + at } else { (n + 1.0) * length - at };
                mirrored - self.head_m[axis]
            });
            let seen = Spherical::from_cartesian(image);
            let walls = i.abs() + j.abs() + k.abs();
            let gain = self.reflection.powi(walls) / seen.rho_m;
            let delay = (seen.rho_m / bvm::audition::sphere::SOUND_SPEED_M_S * RATE_HZ).round() as usize;
            let (responses, _) = Head::Measured(nearest_only(head, seen)).responses(seen, RATE_HZ);
            for (ear, response) in ears.iter_mut().zip(&responses) {
                if ear.len() < delay + response.len() {
                    ear.resize(delay + response.len(), 0.0);
                }
                ear[delay..].iter_mut().zip(response).for_each(|(sum, value)| *sum += gain * value);
            }
        }
        ears
    }
}

/// The nearest measurement alone: converting all is slow.
fn nearest_only(head: &Responses, place: Spherical) -> Responses {
    let away = |one: &Spherical| great_circle((one.azimuth, one.elevation), (place.azimuth, place.elevation));
    let nearest = (head.measured.iter()).min_by(|one, other| away(&one.place).total_cmp(&away(&other.place)));
    Responses { rate_hz: head.rate_hz, measured: nearest.cloned().into_iter().collect() }
}

/// A sound from a place, with noise in each ear.
pub(crate) fn rendered(
    head: &Head,
    sound: &[f64],
    place: Spherical,
    snr_db: f64,
    seed: u64,
) -> [Vec<f64>; 2] {
    let mut ears = binaural(head, sound, RATE_HZ, &[Waypoint { time_s: 0.0, place }]);
    add_noise(&mut ears, snr_db, seed);
    ears
}

/// Two sounds from two places.
pub(crate) fn both(
    head: &Head,
    sounds: [&[f64]; 2],
    places: [Spherical; 2],
    snr_db: f64,
    seed: u64,
) -> [Vec<f64>; 2] {
    let [mut ears, other] =
        [0, 1].map(|at| binaural(head, sounds[at], RATE_HZ, &[Waypoint { time_s: 0.0, place: places[at] }]));
    for (ear, other) in ears.iter_mut().zip(&other) {
        ear.iter_mut().zip(other).for_each(|(sum, value)| *sum += value);
    }
    add_noise(&mut ears, snr_db, seed);
    ears
}

/// The same in a room.
pub(crate) fn in_room(
    room: &Room,
    head: &Responses,
    sound: &[f64],
    place: Spherical,
    snr_db: f64,
    seed: u64,
) -> [Vec<f64>; 2] {
    let mut ears = room.responses(head, place).map(|response| convolved(sound, &response));
    add_noise(&mut ears, snr_db, seed);
    ears
}

/// A sound from a place, heard by a head that turns evenly to the left while it sounds; places are relative to its start.
pub(crate) fn turned(
    head: &Head,
    sound: &[f64],
    place: Spherical,
    snr_db: f64,
    seed: u64,
    independent: &[f64; BANDS],
) -> Turns {
    let length_s = sound.len() as f64 / RATE_HZ;
    let turn = |time_s: f64| (TURN_DEG * (time_s / length_s).clamp(0.0, 1.0)).to_radians();
    let at = |time_s: f64| Waypoint {
        time_s,
        place: Spherical { azimuth: place.azimuth - turn(time_s), ..place },
    };
    let mut ears = binaural(head, sound, RATE_HZ, &[at(0.0), at(length_s)]);
    add_noise(&mut ears, snr_db, seed);
    let mut unit = BinauralUnit::new(RATE_HZ, independent);
    let mut heard = Turns::default();
    let length = (PART_S * RATE_HZ) as usize;
    for (number, (left, right)) in ears[0].chunks(length).zip(ears[1].chunks(length)).enumerate() {
        let mut cues = unit.silence();
        unit.add(left, right, &mut cues);
        let half = 0.5 * turn((number as f64 + 0.5) * PART_S);
        heard.push([half.cos(), 0.0, 0.0, half.sin()], &cues);
    }
    heard
}
