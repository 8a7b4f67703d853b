//! A head: what arrives at its ears from a place.
//!
//! In: measured responses, or the rigid sphere. Out: the responses of both ears to a source at a place, at any sampling
//! rate. Invariant: the left ear comes first; a place that was not measured gets the responses of the nearest direction.

use super::sphere;
use crate::frame::{Spherical, great_circle, wrap_angle};
use std::f64::consts::PI;

/// Half the length of the interpolating filter, in samples of the lower rate.
const HALF_LENGTH: f64 = 24.0;
/// The band that remains after a change of rate, as a share of the lower Nyquist frequency.
const BAND: f64 = 0.95;

/// One measurement.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// Where the source was.
    pub place: Spherical,
    /// The responses of the left and the right ear.
    pub ears: [Vec<f64>; 2],
}

/// Responses from many directions.
#[derive(Clone, Debug, PartialEq)]
pub struct Responses {
    /// The sampling rate, Hz.
    pub rate_hz: f64,
    /// The measurements.
    pub measured: Vec<Measured>,
}

impl Responses {
    /// The same with azimuths counted the other way.
    pub fn mirrored(mut self) -> Responses {
        for one in &mut self.measured {
            one.place.azimuth = wrap_angle(-one.place.azimuth);
        }
        self
    }
}

/// A head.
#[derive(Clone, Debug, PartialEq)]
pub enum Head {
    /// A rigid sphere of a radius in metres.
    Sphere(f64),
    /// A measured one.
    Measured(Responses),
}

impl Head {
    /// The responses of the left and the right ear to a source at a place, and the place at which they hold: that of the
    /// nearest measured direction, or the place itself.
    pub fn responses(&self, place: Spherical, rate_hz: f64) -> ([Vec<f64>; 2], Spherical) {
        match self {
            Head::Sphere(radius_m) => {
                let distance_m = place.rho_m.max(sphere::NEAREST_RADII * radius_m);
                let ears = sphere::responses(*radius_m, distance_m, lateral_sine(place), rate_hz);
                // The series is relative to the free field; a source at one metre has gain one.
                (ears.map(|ear| ear.iter().map(|value| value / distance_m).collect()), place)
            }
            Head::Measured(Responses { rate_hz: measured_hz, measured }) => {
                let angle = |one: &Measured| {
                    great_circle((one.place.azimuth, one.place.elevation), (place.azimuth, place.elevation))
                };
                let nearer = |one: &&Measured, other: &&Measured| angle(one).total_cmp(&angle(other));
                let Some(nearest) = measured.iter().min_by(nearer) else {
                    return ([Vec::new(), Vec::new()], place);
                };
                let ratio = rate_hz / measured_hz;
                let convert = |ear: &Vec<f64>| {
                    if ratio == 1.0 {
                        return ear.clone();
                    }
                    let taps = (ear.len() as f64 * ratio).ceil() as usize + 16;
                    // A response is a density: its samples shrink as they become more.
                    resampled(ear, ratio, 8.0, taps).iter().map(|value| value / ratio).collect()
                };
                ([convert(&nearest.ears[0]), convert(&nearest.ears[1])], nearest.place)
            }
        }
    }
}

/// The sine of the lateral angle of a place, positive to the left.
pub(super) fn lateral_sine(place: Spherical) -> f64 {
    (place.azimuth.sin() * place.elevation.cos()).clamp(-1.0, 1.0)
}

/// A sound at `ratio` times its sampling rate, `delay` samples of the new rate later, with `length` samples: band-limited
/// interpolation with a raised cosine window.
pub fn resampled(sound: &[f64], ratio: f64, delay: f64, length: usize) -> Vec<f64> {
    let band = BAND.max(if ratio == 1.0 { 1.0 } else { 0.0 }) * ratio.min(1.0);
    let half = HALF_LENGTH / ratio.min(1.0);
    let value = |n: usize| {
        let time = (n as f64 - delay) / ratio;
        let [first, last] = [time - half, time + half].map(|end| end.clamp(0.0, sound.len() as f64));
        (first.ceil() as usize..last.ceil() as usize)
            .map(|k| {
                let away = time - k as f64;
                let angle = PI * band * away;
                let sinc = if angle.abs() < 1e-9 { 1.0 } else { angle.sin() / angle };
                sound[k] * band * sinc * 0.5 * (1.0 + (PI * away / half).cos())
            })
            .sum()
    };
    (0..length).map(value).collect()
}
