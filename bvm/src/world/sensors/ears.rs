//! Two ears on a rigid sphere.
//!
//! In: the position of a sound relative to the head. Out: the interaural time difference (ITD, the lead of the left ear
//! in seconds) and level differences (ILD, the excess at the left ear in decibels, one for each frequency channel).
//! With the lateral angle `theta_l = asin(sin(azimuth) cos(elevation))`, positive to the left as azimuth is:
//!
//! - `ITD = (a / c) (theta_l + sin theta_l)` (Woodworth 1938): 0.656 ms at most; the same in front and
//!   behind;
//! - `ILD_k = 0.18 sqrt(f_k) sin theta_l + 20 log10(r_right / r_left)`: a head shadow that grows with frequency (Van
//!   Opstal 2016), and spherical spreading from the two ears, which distinguishes near from far (Shinn-Cunningham
//!   2000).
//!
//! Invariant: mirroring the source left to right changes the sign of every cue.

use crate::frame::Spherical;
use crate::world::{Source, World};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal, StandardUniform};

/// Number of frequency channels.
pub const CHANNELS: usize = 4;
/// Centre frequencies of the channels in hertz.
pub const CHANNEL_HZ: [f64; CHANNELS] = [500.0, 1000.0, 2000.0, 4000.0];
/// Radius of the head in metres.
pub const HEAD_RADIUS_M: f64 = 0.0875;
/// Speed of sound in metres per second.
pub const SOUND_SPEED_M_S: f64 = 343.0;

/// Interaural differences; positive when the source is on the left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cues {
    /// Lead of the left ear in seconds.
    pub itd_s: f64,
    /// Excess level at the left ear in decibels, one for each of [`CHANNEL_HZ`].
    pub ild_db: [f64; CHANNELS],
}

/// The cues of a source seen from the head, without noise. A source inside the head is heard as if on its
/// surface.
pub fn cues_of(source: Spherical) -> Cues {
    let sine = (source.azimuth.sin() * source.elevation.cos()).clamp(-1.0, 1.0);
    let lateral = sine.asin();
    let rho = source.rho_m.max(HEAD_RADIUS_M * 1.01);
    // The left ear is at y = +a.
    let ear = |side: f64| {
        let [x, y, z] = Spherical { rho_m: rho, ..source }.to_cartesian();
        (y - side * HEAD_RADIUS_M).hypot(x).hypot(z)
    };
    let spreading = 20.0 * (ear(-1.0) / ear(1.0)).log10();
    Cues {
        itd_s: HEAD_RADIUS_M / SOUND_SPEED_M_S * (lateral + sine),
        ild_db: CHANNEL_HZ.map(|frequency| 0.18 * frequency.sqrt() * sine + spreading),
    }
}

/// The noise of the ears.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ears {
    /// Standard deviation of the time difference in seconds.
    pub itd_sigma_s: f64,
    /// Standard deviation of each level difference in decibels.
    pub ild_sigma_db: f64,
    /// Share of the moments at which the loudspeaker is silent.
    pub silence: f64,
}

impl Default for Ears {
    /// 20 microseconds, 1.5 dB, silent three times in five.
    fn default() -> Ears {
        Ears { itd_sigma_s: 20e-6, ild_sigma_db: 1.5, silence: 0.6 }
    }
}

impl Ears {
    /// The cues of a source of the world at a time, s, for a head turned by `yaw` radians: of one that plays; `None` if
    /// there is none, or if it is silent at that moment.
    pub fn hear(&self, world: &World, yaw: f64, time_s: f64, random: &mut impl Rng) -> Option<Cues> {
        let silent: f64 = StandardUniform.sample(random);
        let playing = |source: &&Source| (source.plays_s[0]..source.plays_s[1]).contains(&time_s);
        let sources: Vec<&Source> = world.sources.iter().filter(playing).collect();
        let source = match sources.as_slice() {
            [] => return None,
            [only] => only,
            // Formulas know one source at a time.
            several => several[random.random_range(0..several.len())],
        };
        let exact = cues_of(world.source_from(source, yaw, time_s));
        let mut noisy = |value: f64, sigma: f64| {
            let noise: f64 = StandardNormal.sample(random);
            value + sigma * noise
        };
        let cues = Cues {
            itd_s: noisy(exact.itd_s, self.itd_sigma_s),
            ild_db: exact.ild_db.map(|level| noisy(level, self.ild_sigma_db)),
        };
        (silent >= self.silence).then_some(cues)
    }
}
