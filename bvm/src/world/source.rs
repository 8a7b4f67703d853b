//! What sounds in the world.
//!
//! In: a time. Out: where a source is, and what it plays: one channel, as at one metre. Invariant: the same seed gives
//! the same sound, and a source that is silent plays zeros.

use super::World;
use bp_core::compiler::random::seeded;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;

/// Where a source is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// `[x, y, z]`, m.
    Fixed([f64; 3]),
    /// With a body, by its number, at a height in metres.
    Carried(usize, f64),
}

/// What a source plays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sound {
    /// White noise.
    Noise,
    /// Noise in the bands and with the syllables of speech.
    Speech,
    /// A tone of 500 Hz with its harmonics.
    Tone,
}

/// A source of sound.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    /// Its name.
    pub name: String,
    /// Where it is.
    pub place: Place,
    /// What it plays.
    pub sound: Sound,
    /// Root mean square at one metre, as a share of full scale, dB.
    pub level_db: f64,
    /// From when to when it plays, s.
    pub plays_s: [f64; 2],
}

impl World {
    /// Where a source is at a time, `[x, y, z]` in m.
    pub fn source_at(&self, source: &Source, time_s: f64) -> [f64; 3] {
        match source.place {
            Place::Fixed(point) => point,
            Place::Carried(body, height) => {
                let [x, y] = self.bodies[body].motion.place(time_s).at;
                [x, y, height]
            }
        }
    }
}

impl Source {
    /// Samples of the source, as at one metre, for some seconds from a time; `seed` is the world's.
    pub fn samples(&self, time_s: f64, seconds: f64, rate_hz: f64, seed: u64) -> Vec<f64> {
        let count = (seconds * rate_hz).round() as usize;
        // The noise of a stretch depends on its time, so that a run can be resumed at any look.
        let mut random = seeded(seed ^ (time_s * 1e6) as u64, &self.name);
        let deviation = 10f64.powf(self.level_db / 20.0);
        let (mut low, mut high) = (0.0, 0.0);
        let filter = |cut_hz: f64| (TAU * cut_hz / rate_hz).min(1.0);
        let sample = |at: usize| {
            let time = time_s + at as f64 / rate_hz;
            let noise: f64 = StandardNormal.sample(&mut random);
            let value = match self.sound {
                Sound::Noise => noise,
                Sound::Tone => {
                    (1..=6).map(|n| (TAU * 500.0 * f64::from(n) * time).sin() / f64::from(n)).sum::<f64>()
                        * 1.1
                }
                Sound::Speech => {
                    // Between 200 Hz and 4 kHz, four syllables a second.
                    low += filter(4000.0) * (noise - low);
                    high += filter(200.0) * (low - high);
                    let syllable = (TAU * 2.0 * time).sin();
                    3.2 * (low - high) * syllable * syllable
                }
            };
            let plays = (self.plays_s[0]..self.plays_s[1]).contains(&time);
            if plays { (deviation * value).clamp(-1.0, 1.0) } else { 0.0 }
        };
        (0..count).map(sample).collect()
    }
}
