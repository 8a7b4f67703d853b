//! Binaural test sounds.
//!
//! In: a sound of one channel, a head, places over time, a ratio of signal to noise. Out: what arrives at the two ears.
//! Invariant: the noises of the ears are independent, and the same for the same random seed.

use super::head::Head;
use crate::frame::Spherical;
use bp_core::compiler::random::seeded;
use rand_distr::{Distribution, StandardNormal};

/// Time between two places of a source that moves, s.
const STEP_S: f64 = 20e-3;

/// A place at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waypoint {
    /// Seconds from the beginning.
    pub time_s: f64,
    /// The place; on the way between two, azimuth, elevation and distance change evenly.
    pub place: Spherical,
}

/// A sound filtered by a response, as long as both together.
pub fn convolved(sound: &[f64], response: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; sound.len() + response.len().saturating_sub(1)];
    for (delay, value) in response.iter().enumerate().filter(|(_, value)| **value != 0.0) {
        for (sum, sample) in out[delay..].iter_mut().zip(sound) {
            *sum += value * sample;
        }
    }
    out
}

/// A sound that comes from one place, or follows waypoints in the order of their times, at the ears of a head.
pub fn binaural(head: &Head, sound: &[f64], rate_hz: f64, path: &[Waypoint]) -> [Vec<f64>; 2] {
    let mut ears = [Vec::new(), Vec::new()];
    let mut add = |piece: &[f64], start: usize, place: Spherical| {
        let (responses, _) = head.responses(place, rate_hz);
        for (ear, response) in ears.iter_mut().zip(&responses) {
            let heard = convolved(piece, response);
            if ear.len() < start + heard.len() {
                ear.resize(start + heard.len(), 0.0);
            }
            ear[start..].iter_mut().zip(&heard).for_each(|(sum, value)| *sum += value);
        }
    };
    if let [only] = path {
        add(sound, 0, only.place);
        return ears;
    }
    // Overlapping triangles that sum to one.
    let step = ((STEP_S * rate_hz) as usize).max(1);
    for middle in (0..sound.len() + step).step_by(step) {
        let start = middle.saturating_sub(step);
        let end = (middle + step).min(sound.len());
        let window = |at: usize| 1.0 - (at as f64 - middle as f64).abs() / step as f64;
        let piece: Vec<f64> = (start..end).map(|at| sound[at] * window(at)).collect();
        add(&piece, start, along(path, middle as f64 / rate_hz));
    }
    ears
}

/// The place at a time.
fn along(path: &[Waypoint], time_s: f64) -> Spherical {
    let after = path.partition_point(|one| one.time_s <= time_s);
    let (Some(last), Some(from)) = (path.last(), path.get(after.saturating_sub(1))) else {
        return Spherical { rho_m: 1.0, azimuth: 0.0, elevation: 0.0 };
    };
    let Some(to) = path.get(after) else { return last.place };
    if after == 0 {
        return from.place;
    }
    let share = (time_s - from.time_s) / (to.time_s - from.time_s);
    let mix = |one: f64, other: f64| one + share * (other - one);
    Spherical {
        rho_m: mix(from.place.rho_m, to.place.rho_m),
        azimuth: mix(from.place.azimuth, to.place.azimuth),
        elevation: mix(from.place.elevation, to.place.elevation),
    }
}

/// Adds white noise to each ear, with the power of the mean of both ears divided by a ratio in dB.
pub fn add_noise(ears: &mut [Vec<f64>; 2], snr_db: f64, seed: u64) {
    let power = |ear: &[f64]| ear.iter().map(|value| value * value).sum::<f64>() / ear.len().max(1) as f64;
    let mean = 0.5 * (power(&ears[0]) + power(&ears[1]));
    let deviation = (mean * 10f64.powf(-snr_db / 10.0)).sqrt();
    for (ear, name) in ears.iter_mut().zip(["noise of the left ear", "noise of the right ear"]) {
        let mut random = seeded(seed, name);
        for value in ear {
            let noise: f64 = StandardNormal.sample(&mut random);
            *value += deviation * noise;
        }
    }
}
