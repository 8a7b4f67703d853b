//! The cochlear unit: a bank of gammatone filters and hair cells for two ears.
//!
//! In: blocks of samples of the left and the right ear, of any length. Out: for each band and ear the output of the
//! hair cell and the power of the band, at [`Cochlea::rate_hz`], which is near 20 kHz or the rate of the input.
//! Invariant: the outputs do not depend on how the samples are cut into blocks.
//!
//! A band is a cascade of four complex one-pole filters (V. Hohmann, *Acta Acustica* 88, 2002) with the pole
//! `λ exp(i β)`, `λ = exp(-2π · 1.019 · ERB(f) / rate)`, `β = 2π f / rate`: its impulse response is
//! `2 (1 - λ)⁴ C(n + 3, 3) λⁿ exp(i β n)`, a gammatone of order 4 with gain one at f. Poles lie inside the unit circle
//! at every rate; direct forms of order eight do not at low frequencies. ERB and the ERB rate are those of Glasberg and
//! Moore (1990). A hair cell is half-wave rectification and two one-pole low-pass filters, −3 dB together at 1.1 kHz:
//! it follows the fine structure in low bands and the envelope in high ones.

use std::f64::consts::TAU;

/// Number of bands.
pub const BANDS: usize = 32;
/// Centre frequency of the lowest and of the highest band, Hz.
const CENTRES_HZ: [f64; 2] = [100.0, 15_000.0];
/// Bandwidth of a gammatone of order 4, in equivalent rectangular bandwidths.
const WIDTH: f64 = 1.019;
/// −3 dB frequency of the hair cell's low-pass, Hz.
const HAIR_HZ: f64 = 1100.0;
/// The lowest rate of the outputs, Hz, if the input has twice that or more.
const LEAST_RATE_HZ: f64 = 20_000.0;
/// The highest centre frequency that is analysed, as a share of the sampling rate.
const HIGHEST: f64 = 0.42;
/// Lanes: the bands of the left ear, then those of the right.
const LANES: usize = 2 * BANDS;

/// The equivalent rectangular bandwidth at a frequency, both in Hz (Glasberg and Moore 1990).
pub fn erb_hz(frequency_hz: f64) -> f64 {
    24.7 * (4.37e-3 * frequency_hz + 1.0)
}

/// The centre frequencies of the bands in Hz: equally spaced on the scale `21.4 log10(1 + 0.00437 f)`.
pub fn centres_hz() -> [f64; BANDS] {
    let [low, high] = CENTRES_HZ.map(|frequency| (4.37e-3 * frequency + 1.0).ln());
    std::array::from_fn(|band| {
        ((low + (high - low) * band as f64 / (BANDS - 1) as f64).exp() - 1.0) / 4.37e-3
    })
}

/// The number of bands that a sampling rate can represent: those below 0.42 of it.
pub fn bands_at(rate_hz: f64) -> usize {
    centres_hz().iter().filter(|centre| **centre <= HIGHEST * rate_hz).count()
}

/// The outputs of one block: row by row, one row per output sample.
#[derive(Clone, Debug, Default)]
pub struct Cochleagram {
    /// Hair cells: left ear by band, then right ear by band.
    pub hair: Vec<[f32; LANES]>,
    /// Power of the band's complex output, in the same order.
    pub power: Vec<[f32; LANES]>,
}

/// The filters of two ears and their state.
#[derive(Clone, Debug)]
pub struct Cochlea {
    every: usize,
    rate_hz: f64,
    pole: [[f64; LANES]; 2],
    gain: [f64; LANES],
    stages: [[[f64; LANES]; 2]; 4],
    smooth: f64,
    hair: [[f64; LANES]; 2],
    power: [f64; LANES],
    phase: usize,
}

impl Cochlea {
    /// A bank at rest for a sampling rate in Hz. Bands from [`bands_at`] on have no meaning.
    pub fn new(rate_hz: f64) -> Cochlea {
        let every = ((rate_hz / LEAST_RATE_HZ) as usize).max(1);
        let centres = centres_hz();
        let mut cochlea = Cochlea {
            every,
            rate_hz: rate_hz / every as f64,
            pole: [[0.0; LANES]; 2],
            gain: [0.0; LANES],
            stages: [[[0.0; LANES]; 2]; 4],
            smooth: low_pass(HAIR_HZ / (2f64.sqrt() - 1.0).sqrt(), rate_hz),
            hair: [[0.0; LANES]; 2],
            power: [0.0; LANES],
            phase: 0,
        };
        for lane in 0..LANES {
            let centre = centres[lane % BANDS];
            let radius = (-TAU * WIDTH * erb_hz(centre) / rate_hz).exp();
            let (sine, cosine) = (TAU * centre / rate_hz).sin_cos();
            cochlea.pole[0][lane] = radius * cosine;
            cochlea.pole[1][lane] = radius * sine;
            cochlea.gain[lane] = 2.0 * (1.0 - radius).powi(4);
        }
        cochlea
    }

    /// The rate of the outputs, Hz.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Filters a block; `out` gets its outputs and nothing else. The two slices have one length.
    pub fn filter(&mut self, left: &[f64], right: &[f64], out: &mut Cochleagram) {
        out.hair.clear();
        out.power.clear();
        let share = 1.0 / self.every as f64;
        for (left, right) in left.iter().zip(right) {
            let [re, im] = self.gammatone([*left, *right]);
            for lane in 0..LANES {
                self.hair[0][lane] += self.smooth * (re[lane].max(0.0) - self.hair[0][lane]);
                self.hair[1][lane] += self.smooth * (self.hair[0][lane] - self.hair[1][lane]);
                self.power[lane] += share * (re[lane] * re[lane] + im[lane] * im[lane]);
            }
            self.phase += 1;
            if self.phase == self.every {
                self.phase = 0;
                out.hair.push(self.hair[1].map(|value| value as f32));
                out.power.push(self.power.map(|value| value as f32));
                self.power = [0.0; LANES];
            }
        }
    }

    /// The complex output of every band for the next sample of both ears.
    #[inline]
    fn gammatone(&mut self, sample: [f64; 2]) -> [[f64; LANES]; 2] {
        let mut re: [f64; LANES] = std::array::from_fn(|lane| self.gain[lane] * sample[lane / BANDS]);
        let mut im = [0.0; LANES];
        let [pole_re, pole_im] = &self.pole;
        for [state_re, state_im] in &mut self.stages {
            for lane in 0..LANES {
                let (a, b) = (state_re[lane], state_im[lane]);
                re[lane] += pole_re[lane] * a - pole_im[lane] * b;
                im[lane] += pole_im[lane] * a + pole_re[lane] * b;
            }
            (*state_re, *state_im) = (re, im);
        }
        [re, im]
    }
}

/// The coefficient of `y += c (x - y)` whose gain is −3 dB at a frequency: with `z = exp(iω)`,
/// `|c / (1 - (1 - c) / z)|² = 1/2`, that is `c² + 2 (1 - cos ω) c - 2 (1 - cos ω) = 0`.
fn low_pass(frequency_hz: f64, rate_hz: f64) -> f64 {
    let turn = 1.0 - (TAU * (frequency_hz / rate_hz).min(0.5)).cos();
    (turn * turn + 2.0 * turn).sqrt() - turn
}
